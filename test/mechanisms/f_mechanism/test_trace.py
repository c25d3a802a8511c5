"""Following branches of the F-mechanism: never a jump, every turning point, always back."""

import math

import numpy as np
import pytest
from f_mechanism_samples import (
    bifurcating_mechanism,
    closure_value,
    concurrent_pins,
    example_2,
    mechanism_through,
    random_mechanism,
    random_points,
)
from soak import many
from strategies import nudged

from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.mechanisms.f_mechanism import EventKind, FMechanism, NotAPoseError

START = math.radians(146.0)


def turn_difference(p, q):
    return np.abs(np.remainder(np.asarray(p) - q + math.pi, 2.0 * math.pi) - math.pi)


def kinds(trace):
    return [event.kind for event in trace.events]


def assert_same_pose(found, expected, size, tolerance=1e-9):
    assert turn_difference(found.angle, expected.angle) < tolerance
    assert math.dist(found.position, expected.position) < tolerance * size


def assert_samples_are_positions(mechanism, trace):
    """Each sample is one of all positions there, and its rates are right."""
    batch = mechanism.poses_batch(trace.crank_angle)
    turn = turn_difference(batch.angle, trace.angle[:, np.newaxis])
    shift = np.max(np.abs(batch.position - trace.position[:, np.newaxis]), axis=-1)
    gap = np.where(np.isnan(turn), np.inf, turn + shift / mechanism.size)
    slot = np.argmin(gap, axis=1)
    regular = np.abs(trace.singularity) > 1e-3
    assert np.max(gap.min(axis=1)[regular], initial=0.0) < 1e-9
    assert np.max(gap.min(axis=1)) < 1e-5
    row = np.flatnonzero(regular)
    rate = batch.angular_velocity[row, slot[row]]
    assert np.allclose(trace.angular_velocity[row], rate, rtol=1e-5, atol=1e-7)
    assert np.max(trace.residual) < 1e-9 * mechanism.size


def test_example_2_has_one_branch_that_turns_fully():
    mechanism = example_2()
    *_, pose = mechanism.poses(START)
    trace = mechanism.trace(START, pose)
    assert len(trace.angle) == 361
    assert trace.crank_angle == pytest.approx(START + np.radians(np.arange(361.0)), abs=1e-12)
    assert kinds(trace) == [EventKind.CLOSED]
    assert trace.closed
    assert trace.turns_fully
    assert trace.turns == pytest.approx(1.0)
    assert_same_pose(trace.pose(-1), pose, mechanism.size)
    assert_samples_are_positions(mechanism, trace)
    # Source 001, figure 6: the platform hardly turns on this branch.
    assert np.ptp(trace.angle) < math.radians(90.0)


def test_example_2_stops_where_the_crank_must_reverse():
    mechanism = example_2()
    expected = (294.188939730997, 169.594134356109, 169.594134356109)
    for pose, degrees in zip(mechanism.poses(START), expected):
        trace = mechanism.trace(START, pose)
        assert kinds(trace) == [EventKind.TURNING_POINT]
        assert not trace.closed
        assert not trace.turns_fully
        event = trace.events[0]
        assert math.degrees(event.crank_angle) == pytest.approx(degrees, abs=1e-10)
        assert event.index == len(trace.angle)
        assert trace.crank_angle[-1] <= event.crank_angle < trace.crank_angle[-1] + 0.0175
        assert len(mechanism.poses(event.crank_angle + 1e-6)) == 2
        assert len(mechanism.poses(event.crank_angle - 1e-6)) == 4


@pytest.mark.slow
def test_turning_points_are_exact():
    rng = np.random.default_rng(31)
    circle = np.linspace(-math.pi, math.pi, 400)
    checked = 0
    for _ in range(many(8)):
        mechanism = random_mechanism(rng)
        for pose in mechanism.poses(0.5):
            trace = mechanism.trace(0.5, pose, through=True, steps=4)
            for event in trace.turning_points[:3]:
                value = closure_value(mechanism, event.crank_angle, circle)
                scale = np.max(np.abs(value))
                # Value and slope of F, the slope by a difference of fourth order.
                around = event.pose.angle + 1e-3 * np.arange(-2.0, 3.0)
                f = closure_value(mechanism, event.crank_angle, around)
                value, slope = f[2], (f[0] - 8.0 * f[1] + 8.0 * f[3] - f[4]) / 12e-3
                assert abs(value) < 1e-9 * scale
                assert abs(slope) < 1e-9 * scale
                assert abs(event.pose.singularity) < 1e-9
                assert event.pose.residual < 1e-9 * mechanism.size
                checked += 1
    assert checked > 12


@pytest.mark.slow
def test_every_branch_of_some_mechanisms():
    rng = np.random.default_rng(200)
    branches = turning_points = fully = 0
    for _ in range(many(8)):
        mechanism = random_mechanism(rng)
        overview = mechanism.overview(120)
        spacing = 2.0 * math.pi / 120
        visits = np.zeros(120, dtype=int)
        change = np.zeros(120, dtype=int)
        for branch in overview.branches:
            assert branch.closed
            branches += 1
            fully += branch.turns_fully
            assert_samples_are_positions(mechanism, branch)
            # Every position of the survey lies on exactly one branch, passed exactly once.
            row = np.rint(branch.crank_angle / spacing).astype(int)
            on_grid = np.abs(branch.crank_angle - row * spacing) < 1e-9
            on_grid[0] &= len(row) == 1
            np.add.at(visits, row[on_grid] % 120, 1)
            for event in branch.turning_points:
                turning_points += 1
                cell = int(event.crank_angle % (2.0 * math.pi) / spacing)
                change[cell] += 2 * side_of_fold(mechanism, event)
        assert visits.tolist() == overview.counts.tolist()
        # Positions appear and vanish in pairs, at turning points only.
        assert change.tolist() == (np.roll(overview.counts, -1) - overview.counts).tolist()
    assert branches > 8
    assert turning_points > 16
    assert fully > 0


def side_of_fold(mechanism, event):
    """+1 if the two positions of a fold lie at larger crank angles, else -1."""
    step = 1e-4
    angle, crank_angle = event.pose.angle, event.crank_angle
    f = closure_value(mechanism, crank_angle, angle + step * np.array([-1.0, 0.0, 1.0]))
    ahead, behind = (closure_value(mechanism, crank_angle + s * 1e-6, angle) for s in (1.0, -1.0))
    return 1 if (f[0] - 2.0 * f[1] + f[2]) * (ahead - behind) < 0.0 else -1


@pytest.mark.slow
def test_step_widths_change_nothing():
    rng = np.random.default_rng(33)
    for _ in range(many(3)):
        mechanism = random_mechanism(rng)
        for pose in mechanism.poses(1.0):
            fine = mechanism.trace(1.0, pose, steps=96, through=True)
            for steps in (48, 3):
                coarse = mechanism.trace(1.0, pose, steps=steps, through=True)
                assert kinds(coarse) == kinds(fine)
                assert_common_samples(coarse, fine, mechanism.size)
            small = mechanism.trace(1.0, pose, steps=96, through=True, largest_step=0.02)
            assert small.arcs > fine.arcs
            assert kinds(small) == kinds(fine)
            assert len(small.angle) == len(fine.angle)
            assert_common_samples(small, fine, mechanism.size)
            for event, other in zip(small.events, fine.events):
                assert event.crank_angle == pytest.approx(other.crank_angle, abs=1e-9)


def assert_common_samples(few, many, size):
    """The samples of one trace appear in the other one, in the same order."""
    index = 0
    for crank_angle, angle, position in zip(few.crank_angle, few.angle, few.position):
        while not (
            abs(many.crank_angle[index] - crank_angle) < 1e-9
            and abs(many.angle[index] - angle) < 1e-7
            and np.max(np.abs(many.position[index] - position)) < 1e-7 * size
        ):
            index += 1
            assert index < len(many.angle)


def test_given_crank_angles():
    mechanism = example_2()
    *_, pose = mechanism.poses(1.0)
    places = np.array([0.2, 0.9, 1.3, 2.0, 2.05])
    forwards = mechanism.trace(1.0, pose, crank_angles=places)
    assert forwards.crank_angle.tolist() == pytest.approx([1.0, 1.3, 2.0, 2.05])
    backwards = mechanism.trace(1.0, pose, crank_angles=places[::-1])
    assert backwards.crank_angle.tolist() == pytest.approx([1.0, 0.9, 0.2])
    assert kinds(forwards) == kinds(backwards) == [EventKind.END]
    assert_samples_are_positions(mechanism, forwards)
    assert_samples_are_positions(mechanism, backwards)


@pytest.mark.parametrize("through", [False, True])
@pytest.mark.parametrize("places", [[START - 0.2, START - 0.1, START], [START + 0.1, START]])
def test_given_crank_angles_that_end_at_the_start(places, through):
    mechanism = example_2()
    *_, pose = mechanism.poses(START)
    trace = mechanism.trace(START, pose, crank_angles=places, through=through)
    assert kinds(trace) == [EventKind.END]
    assert trace.crank_angle.tolist() == [START]
    assert_same_pose(trace.events[0].pose, pose, mechanism.size)


def test_the_start_may_miss_the_given_crank_angles_by_rounding():
    rng = np.random.default_rng(43)
    mechanism = example_2()
    for start in nudged(rng, [START] * 20).tolist():
        *_, pose = mechanism.poses(start)
        trace = mechanism.trace(start, pose, crank_angles=[START, START + 0.1, START + 0.2])
        assert trace.crank_angle == pytest.approx([START, START + 0.1, START + 0.2])


def test_phases_that_change_by_rounding_only_do_not_change():
    rng = np.random.default_rng(44)
    mechanism = example_2()
    *_, pose = mechanism.poses(START)
    for _ in range(20):
        phases = nudged(rng, (mechanism.phase_b, mechanism.phase_c)).tolist()
        assert mechanism.trace(START, pose, steps=4, phases=tuple(phases)).closed


def test_phases_change_at_rest_and_in_motion():
    mechanism = example_2()
    end_phases = (mechanism.phase_b - 0.3, mechanism.phase_c + 0.15)
    *_, pose = mechanism.poses(START)
    for end in (START, START + 3.0, START - 1.0):
        trace = mechanism.trace(START, pose, end, steps=50, phases=end_phases)
        assert kinds(trace) == [EventKind.END]
        assert len(trace.angle) == 51
        part = np.linspace(0.0, 1.0, 51)
        assert trace.crank_angle == pytest.approx(START + part * (end - START), abs=1e-12)
        assert trace.phase_b == pytest.approx(mechanism.phase_b - 0.3 * part, abs=1e-12)
        assert trace.phase_c == pytest.approx(mechanism.phase_c + 0.15 * part, abs=1e-12)
        for index in range(0, 51, 5):
            there = mechanism.with_phases(trace.phase_b[index], trace.phase_c[index])
            poses = there.poses(trace.crank_angle[index])
            sample = trace.pose(index)
            closest = min(poses, key=lambda p: abs(p.angle - sample.angle))
            assert_same_pose(sample, closest, mechanism.size)
            assert sample.velocity == pytest.approx(closest.velocity, rel=1e-6, abs=1e-6)
        changed = mechanism.with_phases(*end_phases)
        back = changed.trace(
            end, trace.pose(-1), START, steps=9, phases=(mechanism.phase_b, mechanism.phase_c)
        )
        assert_same_pose(back.pose(-1), pose, mechanism.size)


def test_a_phase_change_has_turning_points_too():
    mechanism = example_2()
    first, *_ = mechanism.poses(START)
    full_turn = (mechanism.phase_b + 2.0 * math.pi, mechanism.phase_c)
    trace = mechanism.trace(START, first, START, phases=full_turn)
    assert kinds(trace) == [EventKind.TURNING_POINT]
    event = trace.events[0]
    below, above = (
        len(mechanism.with_phases(event.phase_b + step, event.phase_c).poses(START))
        for step in (-1e-6, 1e-6)
    )
    assert below == above + 2
    on = mechanism.trace(START, first, START, phases=full_turn, through=True)
    assert on.turning_points[0].phase_b == pytest.approx(event.phase_b, abs=1e-9)
    assert kinds(on)[-1] is EventKind.END
    assert min(on.phase_b) >= mechanism.phase_b - 1e-12


def test_start_at_a_turning_point():
    mechanism = example_2()
    pose = mechanism.poses(START)[1]
    event = mechanism.trace(START, pose).events[0]
    stopped = mechanism.trace(event.crank_angle, event.pose)
    assert kinds(stopped) == [EventKind.TURNING_POINT]
    assert len(stopped.angle) == 1
    back = mechanism.trace(event.crank_angle, event.pose, event.crank_angle - 0.2, steps=4)
    assert kinds(back) == [EventKind.END]
    assert len(back.angle) == 5
    end = event.crank_angle + 4.0 * math.pi
    around = mechanism.trace(event.crank_angle, event.pose, end, through=True)
    assert kinds(around) == [EventKind.TURNING_POINT] * 4 + [EventKind.CLOSED]
    assert_same_pose(around.events[-1].pose, event.pose, mechanism.size, 1e-6)


def test_from_a_turning_point_one_and_the_same_side_is_followed():
    rng = np.random.default_rng(40)
    mechanism = example_2()
    for event in mechanism.overview(36).branches[0].turning_points:
        seen = set()
        for crank_angle in nudged(rng, [event.crank_angle] * many(3)).tolist():
            poses = mechanism.poses(crank_angle)
            pose = min(poses, key=lambda p: turn_difference(p.angle, event.pose.angle))
            for through in (False, True):
                trace = mechanism.trace(crank_angle, pose, steps=36, through=through)
                way = np.sign(np.round(np.diff(trace.angle[:2]), 6)).tolist()
                seen.add((through, len(trace.angle), *way, *kinds(trace)))
        assert len(seen) == 2


@pytest.mark.slow
def test_a_branch_closes_after_one_turn_wherever_it_starts():
    mechanism = example_2()
    traces = [
        mechanism.trace(start, pose, steps=4)
        for start in np.random.default_rng(41).uniform(0.0, 3.0, many(10)).tolist()
        for pose in mechanism.poses(start)
    ]
    whole = [trace for trace in traces if len(trace.angle) == 5]
    assert len(whole) == many(10)
    assert all(trace.closed and trace.turns_fully for trace in whole)


def test_a_turning_point_at_the_end_of_the_range_is_taken():
    rng = np.random.default_rng(42)
    mechanism = example_2()
    pose = mechanism.poses(START)[1]
    event = mechanism.trace(START, pose).events[0]
    for end in nudged(rng, [event.crank_angle] * 20).tolist():
        assert kinds(mechanism.trace(START, pose, end)) == [EventKind.TURNING_POINT]


def test_bifurcations_are_reported_and_passed():
    rng = np.random.default_rng(34)
    passed = 0
    reach = 3e-4
    for _ in range(many(30)):
        mechanism, crank_angle, place = bifurcating_mechanism(rng)
        near = [
            pose
            for pose in mechanism.poses(crank_angle - reach)
            if turn_difference(pose.angle, place[0]) < 0.02
            and abs(complex(*pose.position) - place[1]) < 0.02
        ]
        if len(near) != 2:
            continue
        slopes = []
        for pose in near:
            start = crank_angle - reach
            stopped = mechanism.trace(start, pose, crank_angle + reach, steps=3)
            if kinds(stopped)[-1] is EventKind.END:
                # A third branch nearby.
                assert np.min(np.abs(stopped.singularity)) > 1e-6
                continue
            assert kinds(stopped) == [EventKind.BIFURCATION]
            event = stopped.events[0]
            assert event.crank_angle == pytest.approx(crank_angle, abs=1e-9)
            assert turn_difference(event.pose.angle, place[0]) < 1e-9
            assert abs(event.pose.singularity) < 1e-9
            through = mechanism.trace(start, pose, crank_angle + reach, steps=3, through=True)
            assert kinds(through)[0] is EventKind.BIFURCATION
            after = through.events[0].index
            slope = (through.angle[after - 1] - event_angle(through)) / (
                through.crank_angle[after - 1] - crank_angle
            )
            beyond = (through.angle[after] - event_angle(through)) / (
                through.crank_angle[after] - crank_angle
            )
            slopes.append((slope, beyond))
        if len(slopes) == 2:
            passed += 1
            (a, a_on), (b, b_on) = slopes
            # Each branch goes on in its own direction, not in that of the other one.
            assert abs(a_on - a) + abs(b_on - b) < abs(a_on - b) + abs(b_on - a)
    assert passed > 7


def event_angle(trace):
    """Platform angle at the first event, continued from the samples."""
    angle = trace.events[0].pose.angle
    nearest = trace.angle[trace.events[0].index - 1]
    return angle + 2.0 * math.pi * round((nearest - angle) / (2.0 * math.pi))


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        ({"end": math.nan}, NotFiniteError, "end"),
        ({"steps": 0}, OutOfBoundsError, "steps"),
        ({"largest_step": -1.0}, OutOfBoundsError, "largest_step"),
        ({"crank_angles": [[0.0]]}, WrongShapeError, "crank_angles"),
        ({"crank_angles": [START]}, WrongShapeError, "crank_angles"),
        ({"crank_angles": [START, math.inf]}, NotFiniteError, r"crank_angles\[1\]"),
        ({"crank_angles": [START, 3.0, 2.9]}, OutOfBoundsError, r"\[2\] = 2.9 rad .*\), 3 rad"),
        ({"crank_angles": [3.0, 4.0]}, OutOfBoundsError, "crank_angle"),
        ({"crank_angles": [2.0, START], "phases": (1.0, 1.0)}, OutOfBoundsError, "crank_angle"),
        ({"phases": (1.0,)}, WrongShapeError, "phases"),
        ({"phases": (1.0, math.nan)}, NotFiniteError, r"phases\[1\]"),
    ],
)
def test_bad_requests(arguments, error, text):
    mechanism = example_2()
    pose = mechanism.poses(START)[0]
    with pytest.raises(error, match=text):
        mechanism.trace(START, pose, **arguments)


def test_a_pose_of_another_place_is_refused():
    mechanism = example_2()
    pose = mechanism.poses(START)[0]
    with pytest.raises(NotAPoseError, match="rod length is wrong") as caught:
        mechanism.trace(START + 0.1, pose)
    assert caught.value.gap > 0.1
    with pytest.raises(NotFiniteError, match="crank_angle"):
        mechanism.trace(math.inf, pose)


def test_nothing_to_follow():
    mechanism = example_2()
    pose = mechanism.poses(START)[0]
    trace = mechanism.trace(START, pose, START)
    assert kinds(trace) == [EventKind.END]
    assert len(trace.angle) == 1
    assert_same_pose(trace.pose(0), pose, mechanism.size)


def parallel_cranks(rng, concurrent):
    """Equal parallel cranks: the pins translate, and so does the platform in each position."""
    joints, place = random_points(rng, 3), (0.4, 0.3 + 0.2j)
    pins = concurrent_pins(rng, joints, place) if concurrent else random_points(rng, 3)
    return mechanism_through(pins, joints, place, np.full(3, 0.5), np.full(3, 0.7))


def test_parallel_cranks_let_the_platform_translate():
    mechanism = parallel_cranks(np.random.default_rng(38), concurrent=False)
    for pose in mechanism.poses(0.7):
        trace = mechanism.trace(0.7, pose)
        assert trace.turns_fully
        assert np.max(np.abs(trace.angle - pose.angle)) < 1e-9
        assert np.max(np.abs(trace.angular_velocity)) < 1e-9


def test_a_branch_that_is_singular_everywhere_is_said():
    mechanism = parallel_cranks(np.random.default_rng(39), concurrent=True)
    (pose,) = (pose for pose in mechanism.poses(0.7) if pose.double)
    trace = mechanism.trace(0.7, pose)
    assert kinds(trace) == [EventKind.SINGULAR]
    assert len(trace.angle) == 1
    assert not trace.closed
    overview = mechanism.overview(24)
    assert len(overview.singular_poses) == 24
    assert all(branch.turns_fully for branch in overview.branches)


def test_a_branch_that_closes_after_two_turns():
    mechanism = FMechanism(
        [[3.0, 2.0], [3.0, -2.0], [-3.0, -1.0]],
        (1.0, 0.5, 0.5),
        (4.0, 4.0, 4.0),
        [[-3.0, -2.0], [-3.0, 2.0], [3.0, 1.0]],
        0.5 * math.pi,
        math.pi,
    )
    doubled = [b for b in mechanism.overview(36).branches if abs(round(b.turns)) == 2]
    assert doubled
    for branch in doubled:
        assert branch.turns_fully
        start = branch.pose(0)
        once = mechanism.trace(start.crank_angle, start)
        assert kinds(once) == [EventKind.END]
        assert not once.turns_fully
        assert turn_difference(once.angle[-1], once.angle[0]) > 1e-3
        twice = mechanism.trace(start.crank_angle, start, start.crank_angle + 4.0 * math.pi)
        assert kinds(twice) == [EventKind.CLOSED]
        assert twice.turns == pytest.approx(2.0)
        assert twice.turns_fully
