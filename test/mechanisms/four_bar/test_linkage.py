import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from soak import many
from strategies import nudged

from testing.calls import calls
from tri_glide_kinematics.errors import (
    NotAChoiceError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)
from tri_glide_kinematics.mechanisms.four_bar import (
    AssembledFourBar,
    Branch,
    CrankLimitError,
    FourBar,
    NotAssemblableError,
)


def textbook(**more):
    return FourBar(crank=2.0, coupler=7.0, rocker=9.0, ground=6.0, **more)


TEXTBOOK = textbook()


def closure_error(linkage, branch):
    """Largest gap of the loop, worked out from the angles, over the longest link."""
    lengths = linkage.lengths
    loop = (
        lengths.crank * np.exp(1j * branch.crank_angles)
        + lengths.coupler * np.exp(1j * branch.coupler_angles)
        - lengths.rocker * np.exp(1j * branch.rocker_angles)
        - lengths.ground * np.exp(1j * linkage.ground_angle)
    )
    return np.nanmax(np.abs(loop)) / lengths.longest


def random_linkages(count, seed):
    """Lengths of linkages that can be assembled, spread evenly over almost three decades."""
    rng = np.random.default_rng(seed)
    lengths = np.exp(rng.uniform(np.log(0.05), np.log(20.0), (8 * count, 4)))
    lengths = lengths[2.0 * lengths.max(axis=1) < 0.999 * lengths.sum(axis=1)]
    assert len(lengths) >= count
    return lengths[:count].tolist()


class TestPrintedNumbers:
    def test_textbook_linkage(self):
        first, second = TEXTBOOK.solve(math.radians(30.0), 10.0, 0.0)
        assert (first.branch, second.branch) == (Branch.OPEN, Branch.CROSSED)
        printed = [
            (first, 88.837241, 117.286068, -5.990966, -3.991735, 26.08002, 53.33059),
            (second, -115.210812, -143.659639, -0.662352, -2.661583, 77.91986, 50.66928),
        ]
        for pose, coupler, rocker, *rates in printed:
            assert math.degrees(pose.coupler_angle) == pytest.approx(coupler, abs=5.1e-7)
            assert math.degrees(pose.rocker_angle) == pytest.approx(rocker, abs=5.1e-7)
            assert pose.coupler_velocity == pytest.approx(rates[0], abs=5.1e-7)
            assert pose.rocker_velocity == pytest.approx(rates[1], abs=5.1e-7)
            assert pose.coupler_acceleration == pytest.approx(rates[2], abs=5.1e-6)
            assert pose.rocker_acceleration == pytest.approx(rates[3], abs=5.1e-6)

    def test_sheet_of_source_002(self):
        linkage = FourBar.from_joints(
            crank_pivot=(0.0, 0.0),
            crank_pin=(65.183, 45.552),
            rocker_pin=(28.332, 46.047),
            rocker_pivot=(-74.783, 4.195),
        )
        lengths = (linkage.ground, linkage.crank, linkage.coupler, linkage.rocker)
        assert lengths == pytest.approx((74.901, 79.522, 36.854, 111.285), abs=5.1e-4)
        assert linkage.rocker_pivot == pytest.approx((-74.783, 4.195), abs=1e-12)
        assert linkage.assembled_branch is not None
        pose = linkage.pose(math.radians(37.964), linkage.assembled_branch)
        assert pose.crank_pin == pytest.approx((62.695, 48.919), abs=5.1e-4)
        assert pose.rocker_pin == pytest.approx((25.933, 51.529), abs=5.1e-4)


class TestPositions:
    def test_the_loop_is_closed_wherever_it_can_be_and_nowhere_else(self):
        """At all angles, and within rounding or little more of the crank's limits."""
        everywhere = np.linspace(-math.pi, math.pi, 721)
        beside = np.concatenate(([0.0], 10.0 ** -np.arange(3.0, 17.0)))
        for a, b, c, d in random_linkages(many(100), seed=6):
            linkage = FourBar(a, b, c, d, crank_pivot=(3.0, -2.0), ground_angle=0.7)
            ends = np.ravel(linkage.crank_ranges)
            near = [(end - beside, end + beside) for end in ends]
            angles = np.concatenate((everywhere, np.ravel(near)))
            sweep = linkage.sweep(angles)
            diagonal = np.abs(d - a * np.exp(1j * (angles - 0.7)))
            exists = (diagonal < b + c) & (diagonal > abs(b - c))
            margin = np.minimum(np.abs(diagonal - b - c), np.abs(diagonal - abs(b - c)))
            clear = margin > 1e-13 * linkage.lengths.longest
            for branch in (sweep.open, sweep.crossed):
                assert closure_error(linkage, branch) < 1e-12
                assert np.array_equal(branch.is_reachable[clear], exists[clear])

    @settings(derandomize=True, deadline=None, max_examples=200)
    @given(
        st.tuples(*[st.floats(0.1, 10.0)] * 4),
        st.floats(-math.pi, math.pi),
        st.floats(-math.pi, math.pi),
    )
    def test_from_joints_gives_back_the_joints(self, lengths, angle, ground_angle):
        if 2.0 * max(lengths) > 0.99 * sum(lengths):
            return
        linkage = FourBar(*lengths, crank_pivot=(1.0, 2.0), ground_angle=ground_angle)
        for pose in linkage.solve(angle):
            joints = (pose.crank_pivot, pose.crank_pin, pose.rocker_pin, pose.rocker_pivot)
            again = FourBar.from_joints(*joints)
            if abs(math.sin(pose.transmission_angle)) < 1e-4:
                continue
            if not (linkage.lengths.has_change_point or again.lengths.has_change_point):
                assert again.assembled_branch is pose.branch
            found = again.pose(again.assembled_crank_angle, again.assembled_branch)
            assert found.crank_pin == pytest.approx(pose.crank_pin, abs=1e-10)
            assert found.rocker_pin == pytest.approx(pose.rocker_pin, abs=1e-9)

    def test_placement_turns_and_moves_everything(self):
        placed = FourBar(2.0, 7.0, 9.0, 6.0, crank_pivot=(4.0, -1.0), ground_angle=0.9)
        for plain, moved in zip(TEXTBOOK.solve(0.4, 3.0, 2.0), placed.solve(1.3, 3.0, 2.0)):
            turn = np.exp(0.9j)
            expected = 4.0 - 1.0j + turn * complex(*plain.rocker_pin)
            assert complex(*moved.rocker_pin) == pytest.approx(expected, abs=1e-13)
            assert moved.coupler_angle - plain.coupler_angle == pytest.approx(0.9, abs=1e-13)
            assert moved.rocker_velocity == pytest.approx(plain.rocker_velocity, abs=1e-12)
            assert moved.coupler_acceleration == pytest.approx(
                plain.coupler_acceleration, abs=1e-12
            )
            first, second = (
                plain.point_of_coupler_plane(3.0, 2.0),
                moved.point_of_coupler_plane(3.0, 2.0),
            )
            assert complex(*second.velocity) == pytest.approx(
                turn * complex(*first.velocity), abs=1e-12
            )
            expected = turn * complex(*first.acceleration)
            assert complex(*second.acceleration) == pytest.approx(expected, abs=1e-11)

    def test_huge_and_tiny_linkages_have_the_same_angles(self):
        expected = TEXTBOOK.solve(0.3, 1.0)
        for size in (1e-150, 1e150):
            found = FourBar(2.0 * size, 7.0 * size, 9.0 * size, 6.0 * size).solve(0.3, 1.0)
            for one, other in zip(expected, found):
                assert other.coupler_angle == pytest.approx(one.coupler_angle, abs=1e-14)
                assert other.rocker_acceleration == pytest.approx(
                    one.rocker_acceleration, abs=1e-13
                )


class TestRates:
    def test_velocities_and_accelerations_against_central_differences(self):
        """Of fourth order, so that the step may be wide enough for rounding not to matter."""
        step = 3e-5
        rng = np.random.default_rng(11)
        checked = 0
        for lengths in random_linkages(300, seed=8):
            linkage = FourBar(*lengths, ground_angle=0.3)
            time = rng.uniform(-2.0, 2.0, 100)

            def sweep(t, linkage=linkage):
                return linkage.sweep(
                    0.4 + 1.3 * t + 0.35 * t**2, 1.3 + 0.7 * t, np.full_like(t, 0.7)
                )

            around = [sweep(time + shift * step) for shift in (-2, -1, 1, 2)]
            here = sweep(time)
            for branch in Branch:
                far = np.sin(here.branch(branch).transmission_angles) > 0.3
                far &= np.abs(here.branch(branch).rocker_accelerations) < 300.0
                checked += far.sum()
                for link in ("coupler", "rocker"):
                    angles = np.array(
                        [getattr(s.branch(branch), f"{link}_angles")[far] for s in around]
                    )
                    rates = np.array(
                        [getattr(s.branch(branch), f"{link}_velocities")[far] for s in around]
                    )
                    angles = np.unwrap(angles, axis=0)
                    velocity = getattr(here.branch(branch), f"{link}_velocities")[far]
                    acceleration = getattr(here.branch(branch), f"{link}_accelerations")[far]
                    for value, (low2, low, high, high2) in (
                        (velocity, angles),
                        (acceleration, rates),
                    ):
                        slope = (8.0 * (high - low) - (high2 - low2)) / (12.0 * step)
                        scale = 1.0 + np.abs(velocity) + np.abs(acceleration)
                        assert (np.abs(slope - value) / scale).max(initial=0.0) < 1e-6
        assert checked > 20_000

    def test_coupler_point_against_central_differences(self):
        step = 1e-5
        time = np.linspace(0.0, 3.0, 200)

        def sweep(t):
            return TEXTBOOK.sweep(0.2 + 2.0 * t - 0.4 * t**2, 2.0 - 0.8 * t, np.full_like(t, -0.8))

        for name in ("open", "crossed"):
            low, here, high = (
                getattr(sweep(time + shift), name).point_of_coupler_plane(3.0, -1.5)
                for shift in (-step, 0.0, step)
            )
            slope = (high.position - low.position) / (2.0 * step)
            assert np.abs(slope - here.velocity).max() < 1e-8
            slope = (high.velocity - low.velocity) / (2.0 * step)
            assert np.abs(slope - here.acceleration).max() < 1e-7

    def test_coupler_plane_has_its_origin_in_the_crank_pin(self):
        for pose in TEXTBOOK.solve(0.8, 2.0):
            at_pin = pose.point_of_coupler_plane(0.0, 0.0)
            assert at_pin.position == pytest.approx(pose.crank_pin, abs=1e-14)
            at_end = pose.point_of_coupler_plane(7.0, 0.0)
            assert at_end.position == pytest.approx(pose.rocker_pin, abs=1e-13)

    def test_transmission_angle_is_that_between_the_links(self):
        sweep = TEXTBOOK.sweep(np.linspace(-3.0, 3.0, 101))
        for branch in (sweep.open, sweep.crossed):
            between = np.abs(np.angle(np.exp(1j * (branch.rocker_angles - branch.coupler_angles))))
            assert branch.transmission_angles == pytest.approx(between, abs=1e-13)
            diagonal = 2.0**2 + 6.0**2 - 24.0 * np.cos(branch.crank_angles)
            cosine = (7.0**2 + 9.0**2 - diagonal) / (2.0 * 7.0 * 9.0)
            assert np.cos(branch.transmission_angles) == pytest.approx(cosine, abs=1e-13)


class TestSweep:
    def test_a_row_is_the_same_alone_and_in_company(self):
        angles = np.linspace(-7.0, 7.0, 20_011)
        velocity, acceleration = np.sin(angles), np.cos(3.0 * angles)
        sweep = TEXTBOOK.sweep(angles, velocity, acceleration)
        for index in (0, 100, 8191, 8192, 16383, 16384, 20_010):
            for pose in TEXTBOOK.solve(angles[index], velocity[index], acceleration[index]):
                branch = sweep.branch(pose.branch)
                assert branch.rocker_velocities[index] == pytest.approx(
                    pose.rocker_velocity, abs=1e-12
                )
                for link in ("coupler", "rocker"):
                    found = getattr(branch, f"{link}_accelerations")[index]
                    expected = getattr(pose, f"{link}_acceleration")
                    assert found == pytest.approx(expected, abs=1e-11)
                assert branch.coupler_angles[index] == pytest.approx(pose.coupler_angle, abs=1e-13)

    def test_no_angles(self):
        sweep = TEXTBOOK.sweep([])
        assert sweep.open.rocker_pins.shape == (0, 2)
        assert sweep.crossed.coupler_angles.shape == (0,)

    def test_does_not_change_its_arguments(self):
        angles = np.linspace(0.0, 1.0, 50)
        TEXTBOOK.sweep(angles, 2.0)
        assert np.array_equal(angles, np.linspace(0.0, 1.0, 50))


class TestCrankLimits:
    LIMITED = (
        FourBar(6.0, 4.0, 5.0, 8.0),  # triple rocker, stretched
        FourBar(5.0, 2.0, 6.0, 4.0),  # double rocker, folded and stretched
        FourBar(7.0, 9.0, 2.0, 6.0, crank_pivot=(1.0, 1.0), ground_angle=2.1),
        FourBar(4.0, 9.0, 3.0, 8.5, ground_angle=-0.4),
    )

    @pytest.mark.parametrize("linkage", LIMITED)
    def test_limits_from_both_sides(self, linkage):
        assert not linkage.crank_turns_fully
        for low, high in linkage.crank_ranges:
            for limit, inward in ((low, 1.0), (high, -1.0)):
                inside = linkage.solve(limit + inward * 1e-9, 1.0)
                assert len(inside) == 2
                assert linkage.solve(limit - inward * 1e-9, 1.0) == ()
                gap = complex(*inside[0].rocker_pin) - complex(*inside[1].rocker_pin)
                assert 0.0 < abs(gap) < 1e-2
                assert all(abs(pose.rocker_velocity) > 1e2 for pose in inside)
                assert not any(pose.is_singular for pose in inside)

    @pytest.mark.parametrize("linkage", LIMITED)
    def test_at_the_limit_both_branches_meet_and_say_so(self, linkage):
        for limit in (angle for interval in linkage.crank_ranges for angle in interval):
            poses = linkage.solve(limit, 1.0)
            assert len(poses) == 2
            first, second = (complex(*pose.rocker_pin) for pose in poses)
            assert abs(first - second) < 1e-6
            for pose in poses:
                assert pose.is_singular
                if first == second:
                    assert math.isnan(pose.rocker_velocity)
                    assert math.isnan(pose.coupler_acceleration)
                rocker = complex(*pose.rocker_pin) - complex(*pose.rocker_pivot)
                coupler = complex(*pose.rocker_pin) - complex(*pose.crank_pin)
                assert abs(rocker) == pytest.approx(
                    linkage.rocker, abs=1e-12 * linkage.lengths.longest
                )
                assert abs(coupler) == pytest.approx(
                    linkage.coupler, abs=1e-12 * linkage.lengths.longest
                )

    @pytest.mark.parametrize("linkage", LIMITED)
    def test_all_of_a_sweep_is_nan_beyond_the_limits(self, linkage):
        sweep = linkage.sweep(np.linspace(-4.0, 4.0, 5000), 1.0, 1.0)
        reachable = sweep.open.is_reachable
        assert 0 < reachable.sum() < len(reachable)
        for branch in (sweep.open, sweep.crossed):
            assert np.isnan(branch.motion[:, ~reachable]).all()
            assert np.isfinite(branch.motion[:, reachable]).all()
            assert np.isnan(branch.crank_pins[~reachable]).all()
            curve = branch.point_of_coupler_plane(1.0, 1.0)
            assert np.isnan(curve.position[~reachable]).all()

    def test_the_call_that_demands_a_pose_names_the_limits(self):
        linkage = self.LIMITED[0]
        with pytest.raises(CrankLimitError, match="reaches from -") as error:
            linkage.pose(3.0, Branch.OPEN)
        assert error.value.crank_angle == 3.0
        assert error.value.ranges == linkage.crank_ranges


class TestChangePoints:
    def test_parallelogram_stays_a_parallelogram(self):
        linkage = FourBar(2.0, 5.0, 2.0, 5.0)
        angles = np.linspace(-3.0 * math.pi, 3.0 * math.pi, 1201)
        assert np.abs(np.sin(angles)).min() < 1e-12
        branch = linkage.sweep(angles, 3.0, 0.5).open
        assert np.abs(branch.coupler_angles).max() < 1e-14
        assert np.abs(np.exp(1j * branch.rocker_angles) - np.exp(1j * angles)).max() < 1e-14
        assert branch.rocker_velocities == pytest.approx(np.full(1201, 3.0), abs=1e-13)
        assert branch.rocker_accelerations == pytest.approx(np.full(1201, 0.5), abs=1e-12)
        assert np.abs(branch.coupler_velocities).max() < 1e-13
        assert branch.is_singular.sum() == 7

    @pytest.mark.parametrize(
        ("lengths", "turns"),
        [
            ((2.0, 5.0, 2.0, 5.0), 1),  # parallelogram
            ((5.0, 2.0, 5.0, 2.0), 1),
            ((1.0, 1.0, 2.5, 2.5), 1),  # kite, crank equals coupler
            ((2.0, 3.0, 3.0, 2.0), 2),  # kite, crank equals ground: joints meet
            ((2.0, 2.0, 2.0, 2.0), 1),  # rhombus
            ((1.0, 4.0, 2.0, 5.0), 2),  # stretches only
            ((2.0, 6.0, 3.0, 5.0), 2),  # folds only, crank + coupler = rocker + ground
            ((1.0, 3.0, 6.0, 4.0), 2),  # folds only, crank + rocker = coupler + ground
            ((0.1, 0.3, 0.1, 0.1 + 0.2), 1),  # a parallelogram but for rounding
        ],
    )
    def test_both_branches_are_smooth_through_the_folds(self, lengths, turns):
        linkage = FourBar(*lengths, ground_angle=0.2)
        assert linkage.crank_turns_fully
        angles = 0.2 + np.linspace(0.0, turns * math.tau, 4001)  # meets 0 and pi exactly
        sweep = linkage.sweep(angles, 1.0)
        for branch in (sweep.open, sweep.crossed):
            assert np.isfinite(branch.motion).all()
            pins = branch.rocker_pins
            step = angles[1] - angles[0]
            for link in ("coupler", "rocker"):
                angle = np.unwrap(getattr(branch, f"{link}_angles"))
                rate = getattr(branch, f"{link}_velocities")
                slope = (angle[2:] - angle[:-2]) / (2.0 * step)
                assert np.abs(slope - rate[1:-1]).max() < 1e-3 * np.abs(rate).max() + 1e-12
                acceleration = getattr(branch, f"{link}_accelerations")
                slope = (rate[2:] - rate[:-2]) / (2.0 * step)
                scale = np.abs(acceleration).max() + np.abs(rate).max()
                assert np.abs(slope - acceleration[1:-1]).max() < 3e-3 * scale + 1e-9
            jump = np.linalg.norm(np.diff(pins, axis=0), axis=1)
            fastest = np.abs(branch.rocker_velocities).max() * linkage.rocker * step
            assert jump.max() < 1.01 * fastest + 1e-12
            assert np.abs(pins[0] - pins[-1]).max() < 1e-9
            assert closure_error(linkage, branch) < 1e-12

    @pytest.mark.parametrize(
        ("lengths", "fold"), [((3.0, 2.0, 4.0, 5.0), 0.0), ((2.0, 1.0, 4.0, 3.0), math.pi)]
    )
    def test_a_limited_crank_passes_its_change_point_as_well(self, lengths, fold):
        linkage = FourBar(*lengths)
        ((low, high),) = linkage.crank_ranges
        assert low < fold < high < low + math.tau
        angles = np.linspace(fold - 0.5, fold + 0.5, 2001)
        step = angles[1] - angles[0]
        sweep = linkage.sweep(angles, 1.0)
        for branch in (sweep.open, sweep.crossed):
            slope = np.diff(np.unwrap(branch.rocker_angles)) / step
            assert np.abs(np.diff(slope)).max() < 1e-2
            assert (
                np.abs(
                    slope - 0.5 * (branch.rocker_velocities[1:] + branch.rocker_velocities[:-1])
                ).max()
                < 1e-5
            )
        assert linkage.solve(low - 1e-6) == linkage.solve(high + 1e-6) == ()

    @pytest.mark.filterwarnings("error")
    def test_a_kite_next_to_the_meeting_of_its_joints(self):
        """g^2 passes through the smallest numbers there are, down to zero."""
        for lengths in ((2.0, 3.0, 3.0, 2.0), (2.0, 2.0, 2.0, 2.0)):
            linkage = FourBar(*lengths)
            angles = np.concatenate(([0.0], 10.0 ** -np.arange(5.0, 320.0)))
            sweep = linkage.sweep(angles, 1.0)
            for branch, meeting in zip((sweep.open, sweep.crossed), linkage.solve(0.0, 1.0)):
                assert np.abs(branch.rocker_pins - meeting.rocker_pin).max() < 1e-4
                assert np.abs(branch.rocker_velocities - meeting.rocker_velocity).max() < 1e-4
                assert (
                    np.abs(branch.coupler_accelerations - meeting.coupler_acceleration).max() < 1e-4
                )

    def test_one_change_point_swaps_the_branches_once_a_turn(self):
        linkage = FourBar(1.0, 4.0, 2.0, 5.0)
        sweep = linkage.sweep([0.3, 0.3 + math.tau, 0.3 + 2.0 * math.tau])
        first, second = sweep.open.rocker_pins, sweep.crossed.rocker_pins
        assert first[1] == pytest.approx(second[0], abs=1e-12)
        assert first[2] == pytest.approx(first[0], abs=1e-12)
        assert np.linalg.norm(first[0] - second[0]) > 0.1

    def test_without_tolerance_a_rounded_parallelogram_changes_over(self):
        """The case that the tolerance is for: the same lengths taken at their word."""
        lengths = (0.1, 0.3, 0.1, 0.1 + 0.2)
        exact = FourBar(*lengths, tolerance=0.0).sweep(np.linspace(-1.0, 1.0, 400)).open
        adjusted = FourBar(*lengths).sweep(np.linspace(-1.0, 1.0, 400)).open
        assert np.abs(adjusted.coupler_angles).max() < 1e-12
        assert not np.abs(np.nan_to_num(exact.coupler_angles, nan=1.0)).max() < 1e-3

    def test_without_tolerance_links_may_be_as_short_as_numbers_are(self):
        for lengths in ((2.0, 2.42, 1.11, 1e-307), (1e-307, 2.42, 1.11, 2.0)):
            motion = FourBar(*lengths, tolerance=0.0).sweep([1.0, 4.0], 1.0).motion
            assert np.all(np.isfinite(motion))

    def test_lengths_give_way_by_no_more_than_the_tolerance(self):
        rng = np.random.default_rng(2)
        angles = np.linspace(-3.0, 3.0, 61)
        for _ in range(200):
            a, d = rng.uniform(0.5, 2.0, 2)
            noise = rng.uniform(-1.0, 1.0, 2) * 0.2e-6
            linkage = FourBar(a, d + noise[0], a + noise[1], d, tolerance=1e-6)
            branch = linkage.sweep(angles).open
            assert closure_error(linkage, branch) < 2e-6
            assert np.abs(branch.coupler_angles).max() < 1e-9


TWO, NAN = ((0.0, 0.0), (1.0, 0.0)), math.nan
SWEEP = TEXTBOOK.sweep([0.0])


class TestBadInput:
    @pytest.mark.parametrize(
        ("make", "error", "text"),
        [
            (lambda: textbook(tolerance=-1e-9), OutOfBoundsError, "tolerance"),
            (lambda: textbook(tolerance=0.1), OutOfBoundsError, "tolerance"),
            (lambda: textbook(crank_pivot=(1.0, 2.0, 3.0)), WrongShapeError, "crank_pivot"),
            (lambda: textbook(ground_angle=math.nan), NotFiniteError, "ground_angle"),
            (lambda: textbook(ground_angle=1e300), OutOfBoundsError, "ground_angle = 1e.300 must"),
            (lambda: FourBar(*[1e300] * 4), OutOfBoundsError, "crank = 1e.300 must be at most"),
            (lambda: FourBar(2, 2.4, 1, 5e-324, tolerance=0), OutOfBoundsError, "5.34017726e-308"),
            (lambda: FourBar(5e-324, 2.4, 1, 2, tolerance=0), OutOfBoundsError, "2.23e-308 of"),
            (lambda: FourBar.from_joints(*TWO, (1, 0), (2, 1)), OutOfBoundsError, "coupler"),
            (lambda: FourBar.from_joints(*TWO, (1, NAN), (2, 1)), NotFiniteError, r"er_pin\[1\]"),
            (lambda: FourBar.from_joints(TWO[0], (1, 0, 0), *TWO), WrongShapeError, "crank_pin"),
            (lambda: TEXTBOOK.solve(math.nan), NotFiniteError, "crank_angle"),
            (lambda: TEXTBOOK.solve(1e300), OutOfBoundsError, "crank_angle = 1e.300 must"),
            (lambda: TEXTBOOK.solve(0.0, math.nan), NotFiniteError, "crank_velocity"),
            (lambda: TEXTBOOK.solve(1.0, 1e300), OutOfBoundsError, "crank_velocity = 1e.300 must"),
            (lambda: TEXTBOOK.sweep([0.0, math.inf]), NotFiniteError, r"crank_angles\[1\]"),
            (lambda: TEXTBOOK.sweep([1.0, 1e300]), OutOfBoundsError, r"crank_angles\[1\] = 1e.300"),
            (lambda: TEXTBOOK.sweep([[0.0, 1.0]]), WrongShapeError, "crank_angles"),
            (lambda: TEXTBOOK.sweep([0.0, 1.0], [1.0]), WrongShapeError, "crank_velocity"),
            (lambda: TEXTBOOK.sweep([0], 1, [NAN]), NotFiniteError, r"crank_acceleration\[0\]"),
            (lambda: SWEEP.open.point_of_coupler_plane(NAN, 0.0), NotFiniteError, "x = "),
        ],
    )
    def test_what_has_no_meaning_is_refused_by_its_name(self, make, error, text):
        with pytest.raises(error, match=text):
            make()

    @pytest.mark.parametrize("position", range(4))
    @pytest.mark.parametrize(
        ("length", "error"),
        [
            (0.0, OutOfBoundsError),
            (-1.0, OutOfBoundsError),
            (1e-13, OutOfBoundsError),
            (math.nan, NotFiniteError),
            (math.inf, NotFiniteError),
            (100.0, NotAssemblableError),
        ],
    )
    def test_lengths(self, position, length, error):
        lengths = [2.0, 7.0, 9.0, 6.0]
        lengths[position] = length
        with pytest.raises(error, match=("crank", "coupler", "rocker", "ground")[position]):
            FourBar(*lengths)

    def test_a_linkage_that_can_only_lie_stretched(self):
        with pytest.raises(NotAssemblableError) as error:
            FourBar(1.0, 2.0, 3.0, 6.0)
        assert (error.value.link, error.value.length, error.value.rest) == ("ground", 6.0, 6.0)

    def test_joints_in_line_have_no_branch(self):
        linkage = FourBar.from_joints((0.0, 0.0), (2.0, 0.0), (7.0, 0.0), (5.0, 0.0))
        assert linkage.assembled_branch is None


def test_angles_of_half_a_turn_are_positive():
    rng = np.random.default_rng(30)
    for _ in range(20):
        (ground_angle,) = nudged(rng, [math.pi])
        parallelogram = FourBar(0.03, 0.05, 0.03, 0.05, ground_angle=ground_angle)
        coupler = parallelogram.sweep(np.linspace(0.1, 6.1, 100)).open.coupler_angles
        np.testing.assert_allclose(coupler, math.pi)


def test_joints_in_a_row_give_one_and_the_same_linkage():
    rng = np.random.default_rng(31)
    for _ in range(50):
        pivot, pin, other_pivot = nudged(rng, ((0.0, 0.0), (-0.02, 0.0), (-0.06, 0.0)))
        linkage = FourBar.from_joints(pivot, pin, (-0.07, 0.05), other_pivot)
        assert linkage.ground_angle == pytest.approx(math.pi)
        assert linkage.assembled_crank_angle == pytest.approx(math.pi)


@pytest.mark.parametrize("branch", ["open", "crossed", "OPEN", 0, 1, True, None])
def test_what_is_no_branch_is_refused_by_what_there_is(branch):
    sweep = TEXTBOOK.sweep([0.5, 1.0])
    for ask in (
        lambda: TEXTBOOK.pose(1.0, branch),
        lambda: sweep.branch(branch),
        lambda: AssembledFourBar(2.0, 7.0, 9.0, 6.0, assembled_branch=branch or "open"),
    ):
        with pytest.raises(NotAChoiceError, match=r"Branch\.OPEN or Branch\.CROSSED$") as caught:
            ask()
        assert caught.value.choices == ("Branch.OPEN", "Branch.CROSSED")


def test_one_angle_takes_about_the_work_of_a_sweep():
    linkage = FourBar(0.02, 0.07, 0.09, 0.06)
    linkage.solve(0.5, 10.0)
    sweep = calls(linkage.sweep, [0.5], 10.0).total()
    assert calls(linkage.solve, 0.5, 10.0).total() < 3 * sweep
