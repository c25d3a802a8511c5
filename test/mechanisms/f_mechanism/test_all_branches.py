"""The overview of the F-mechanism: every branch once, as a connected curve."""

import math

import numpy as np
import pytest
from f_mechanism_samples import bifurcating_mechanism, example_1, example_2
from soak import many
from strategies import nudged

from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.mechanisms.f_mechanism import EventKind, FMechanism
from tri_glide_kinematics.mechanisms.f_mechanism.curve import Curve

TURNING_DEGREES = (135.044103675325, 169.594134356109, 250.222852740651, 294.188939730997)


def turning_degrees(branch):
    return sorted(math.degrees(event.crank_angle) % 360.0 for event in branch.turning_points)


def test_example_2():
    overview = example_2().overview()
    assert overview.crank_angles == pytest.approx(np.radians(np.arange(360.0)))
    degrees, steps = np.unique(overview.counts, return_counts=True)
    assert degrees.tolist() == [2, 4]
    assert steps.tolist() == [282, 78]
    four = np.flatnonzero(overview.counts == 4)
    assert four.tolist() == [*range(136, 170), *range(251, 295)]
    assert not np.any(overview.self_motion)
    assert len(overview.branches) == 2
    assert len(overview.fully_turning) == 1
    turning = overview.branches[overview.fully_turning[0]]
    other = overview.branches[1 - overview.fully_turning[0]]
    assert turning.turns == pytest.approx(1.0)
    assert turning_degrees(turning) == []
    assert turning_degrees(other) == pytest.approx(list(TURNING_DEGREES), abs=1e-9)
    assert other.closed
    assert other.turns == pytest.approx(1.0)
    assert not other.turns_fully


@pytest.mark.parametrize("base_side", [1.0, -1.0])
@pytest.mark.parametrize("platform_side", [1.0, -1.0])
def test_example_1_does_not_turn_fully_in_any_orientation(base_side, platform_side):
    # Source 001 calls it fully rotating, but gives no orientation of its two triangles.
    overview = example_1(base_side, platform_side).overview()
    assert np.min(overview.counts) == 0
    assert overview.fully_turning == ()
    for branch in overview.branches:
        assert branch.closed
        assert len(branch.turning_points) >= 2
        assert branch.turns == pytest.approx(0.0, abs=1e-9)


def near(mechanism, crank_angle, place):
    """Positions close to ``place``, an angle and an origin."""
    return [
        pose
        for pose in mechanism.poses(crank_angle)
        if abs(math.remainder(pose.angle - place[0], 2.0 * math.pi)) < 0.3
        and abs(complex(*pose.position) - place[1]) < 0.3
    ]


def test_branches_between_two_samples_are_found():
    # Where the conditions for a bifurcation hold, but no branches cross, the position is isolated.
    # A small change of one rod lets it vanish, or grow to a small closed branch.
    rng = np.random.default_rng(41)
    islands = 0
    for _ in range(60):
        mechanism, crank_angle, place = bifurcating_mechanism(rng)
        if any(near(mechanism, crank_angle + step, place) for step in (-0.05, 0.05)):
            continue
        linkage = mechanism.linkage
        for change in (1.0 - 1e-4, 1.0 + 1e-4):
            changed = FMechanism(
                [(p.real, p.imag) for p in linkage.pivots],
                linkage.cranks,
                (change * linkage.rods[0], *linkage.rods[1:]),
                [(p.real, p.imag) for p in linkage.joints],
                mechanism.phase_b,
                mechanism.phase_c,
                mechanism.counter_rotating,
            )
            apart = any(near(changed, crank_angle + step, place) for step in (-0.05, 0.05))
            on_sample = abs(math.remainder(crank_angle, math.radians(10.0))) < 0.05
            if apart or on_sample or not near(changed, crank_angle, place):
                continue
            islands += 1
            small = [
                branch
                for branch in changed.overview(36).branches
                if all(
                    abs(math.remainder(event.crank_angle - crank_angle, 2.0 * math.pi)) < 0.05
                    for event in branch.events
                )
            ]
            assert len(small) == 1
            assert small[0].closed
            assert len(small[0].turning_points) == 2
    assert islands > 4


@pytest.mark.slow
def test_mechanisms_on_a_grid():
    # Whole numbers and right angles make every special case frequent.
    rng = np.random.default_rng(44)
    bifurcations = singular = 0
    for _ in range(many(10)):
        base, platform = rng.integers(-3, 4, (3, 2)), rng.integers(-2, 3, (3, 2))
        if len(np.unique(platform, axis=0)) == 1:
            continue
        if rng.integers(2):
            base[:, 1] = platform[:, 1] = 0
            platform[0, 0] = 5
        mechanism = FMechanism(
            base,
            rng.integers(1, 3, 3),
            rng.integers(1, 5, 3),
            platform,
            *(0.5 * math.pi * rng.integers(0, 4, 2)),
            bool(rng.integers(2)),
        )
        overview = mechanism.overview(36)
        singular += len(overview.singular_poses)
        for branch in overview.branches:
            bifurcations += len(branch.bifurcations)
            assert np.max(branch.residual) < 1e-9 * mechanism.size
            # The triangle moves continuously along each branch.
            assert np.max(np.abs(np.diff(branch.crank_angle)), initial=0.0) < math.radians(10.1)
    assert bifurcations > 5
    assert singular > 0


def test_parallel_crank_mechanism_is_said_to_move_by_itself():
    triangle = [[0.0, 0.0], [2.0, 0.5], [0.7, 1.8]]
    mechanism = FMechanism(triangle, (0.5, 0.5, 0.5), (1.3, 1.3, 1.3), triangle)
    overview = mechanism.overview(36)
    assert np.all(overview.self_motion)
    assert overview.branches == ()


@pytest.fixture
def frames(monkeypatch):
    """All frames that are computed, one for each arc that is followed."""
    computed = []
    frame = Curve.frame

    def counted(*arguments):
        computed.append(frame(*arguments))
        return computed[-1]

    monkeypatch.setattr(Curve, "frame", counted)
    return computed


def nearly_parallelograms(change):
    """Equal cranks and rods, and a platform that is the base but for one place [m]."""
    base = np.array([[0.0, 0.0], [2.0, 0.5], [0.7, 1.8]])
    platform = [*base[:2], base[2] + [change, 0.5 * change]]
    return FMechanism(base, [0.5] * 3, [1.3] * 3, platform)


@pytest.mark.parametrize("change", [1e-9, 1e-6])
def test_overview_is_bounded_beside_a_self_motion(change, frames):
    # Two branches are like any other. The four others are one but for the change: to follow them
    # would take a million arcs.
    overview = nearly_parallelograms(change).overview(24)
    assert overview.counts.tolist() == [6] * 24
    assert overview.fully_turning == (0, 1)
    assert len(overview.branches) == 2
    assert len(overview.singular_poses) == 4 * 24
    assert max(abs(pose.singularity) for pose in overview.singular_poses) < 1e-4
    assert len(frames) < 12_000


def test_branches_farther_from_a_self_motion_are_followed():
    overview = nearly_parallelograms(1e-3).overview(24)
    assert len(overview.branches) == 6
    assert all(branch.closed for branch in overview.branches)
    assert overview.singular_poses == ()


def test_overview_is_bounded_where_a_branch_passes_a_self_motion(frames):
    # At crank angle zero the pins are congruent to the platform, but for 1e-9.
    base, cranks = np.array([[0.0, 0.0], [2.0, 0.5], [0.7, 1.8]]), np.array([0.3, 0.5, 0.4])
    platform = base + np.stack([cranks, [1e-9, 0.0, 0.0]], axis=1)
    mechanism = FMechanism(base, cranks, [1.3] * 3, platform)
    overview = mechanism.overview(24)
    ends = {branch.events[-1].kind for branch in overview.branches if not branch.closed}
    assert ends == {EventKind.SINGULAR}
    assert all(abs(pose.crank_angle) < 1e-9 for pose in overview.singular_poses)
    assert len(frames) < 15_000


def test_overview_of_redundant_rods():
    # A and C are one crank with one rod, so that the condition vanishes, and so does its slope.
    base, platform = [[0.0, 0.0], [2.0, 0.5], [0.0, 0.0]], [[0.0, 0.0], [0.6, 0.2], [0.0, 0.0]]
    overview = FMechanism(base, (0.3, 0.4, 0.3), (1.2, 1.3, 1.2), platform).overview(24)
    assert np.all(overview.self_motion)


def test_mechanism_that_never_closes():
    mechanism = FMechanism(
        [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]],
        (1.0, 1.0, 1.0),
        (1.0, 1.0, 1.0),
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    )
    overview = mechanism.overview(36)
    assert np.all(overview.counts == 0)
    assert overview.branches == ()
    assert overview.fully_turning == ()


def test_too_few_samples():
    with pytest.raises(OutOfBoundsError, match="samples"):
        example_2().overview(7)


def test_mirror_images_are_not_exchanged_by_rounding():
    # What a symmetric mechanism can do at a crank angle, it can do mirrored at the opposite one.
    rng = np.random.default_rng(5)
    starts = set()
    for _ in range(12):
        x, y, crank, rod, phase, platform_x, platform_y = nudged(
            rng, (0.05, 0.06, 0.015, 0.045, 0.7, 0.02, 0.03)
        )
        mechanism = FMechanism(
            [[0.0, 0.0], [x, y], [x, -y]],
            (0.02, crank, crank),
            (0.05, rod, rod),
            [[-0.02, 0.0], [platform_x, platform_y], [platform_x, -platform_y]],
            phase,
            -phase,
        )
        branches = mechanism.overview(72).branches
        starts.add(tuple((round(b.crank_angle[0], 6), round(b.angle[0], 6)) for b in branches))
    assert len(starts) == 1
