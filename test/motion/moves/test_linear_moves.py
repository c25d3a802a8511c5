"""Linear plans: from rest against a lower bound, and in mid-motion without a step."""

import contextlib
import math

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE
from soak import many

from benchmarks.bench_moves import bent, planned, random_turns
from benchmarks.linear_moves import (
    LARGEST_DEVIATION,
    LARGEST_MEDIAN,
    LARGEST_RATIO,
    lower_bound,
    measure,
    speed_after,
    time_between_rests,
    time_to_turn,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.errors import NoRoomError, PlanningError
from tri_glide_kinematics.motion.limit_use import are_within
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import LinearMotion, LineJoining, LineToPosition
from tri_glide_kinematics.motion.moves.line_entry import LineToEdge
from tri_glide_kinematics.motion.trajectory import StraightLine, derivative_bounds
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

UNEQUAL_LIMITS = SliderLimits((1.0, 0.5, 0.8), (10.0, 12.0, 6.0), (200.0, 90.0, 300.0))
JOINING = LineJoining(MACHINE)
MOVES = many(250)


def line_between(start, end) -> StraightLine:
    return StraightLine.between(DEFAULT_GEOMETRY, start, end)


@pytest.mark.slow
def test_moves_take_little_more_than_their_lower_bound_on_their_line_and_within_limits():
    measured = measure(MOVES, seed=11)
    assert measured.ratios.min() >= 1.0 - 1e-6
    assert measured.ratios.max() <= LARGEST_RATIO
    assert np.median(measured.ratios) < LARGEST_MEDIAN
    assert measured.deviation < LARGEST_DEVIATION
    assert are_within(measured.peaks)


@pytest.mark.parametrize("limits", [LIMITS, UNEQUAL_LIMITS])
@pytest.mark.parametrize("end", [(0.1, 0.05, 0.35), (-0.05, 0.08, 0.2), (0.02, 0.01, 0.31)])
def test_one_limit_is_used_in_full_from_rest(limits, end):
    plan = LinearMotion(MACHINE).from_rest(line_between((0.02, 0.01, 0.3), end), limits)
    factors = derivative_bounds(plan.line, plan.scaling).slowdown(limits)
    assert factors.max() == pytest.approx(1.0, rel=1e-9)


def test_lower_bound_is_met_where_the_optimum_is_known():
    """Along an upright line all sliders go the same way."""
    for way in (1e-4, 0.01, 0.05, 0.3):
        line = line_between((0.02, 0.01, 0.1), (0.02, 0.01, 0.1 + way))
        optimum = time_between_rests(way, 1.0, 10.0, 200.0)
        assert lower_bound(line, LIMITS) == pytest.approx(optimum, rel=1e-6)
        assert LinearMotion(MACHINE).from_rest(line, LIMITS).duration < 1.06 * optimum


def test_parts_of_the_lower_bound_against_integration():
    times = np.linspace(0.0, 0.4, 400_001)
    speeds = speed_after(times, 1.0, 10.0, 200.0)
    accelerations = np.gradient(speeds, times)
    assert np.abs(accelerations).max() <= 10.0 + 1e-9
    assert np.abs(np.diff(accelerations) / times[1]).max() <= 200.0 * (1.0 + 1e-3)
    assert speeds[-1] == pytest.approx(1.0)
    ways = np.concatenate(([0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * times[1])))
    # A long way between rests is twice the rise, and steady motion in between.
    rise = float(np.interp(1.0 - 1e-12, speeds, times))
    steady = 0.3 - 2.0 * float(np.interp(rise, times, ways))
    assert time_between_rests(0.3, 1.0, 10.0, 200.0) == pytest.approx(2.0 * rise + steady, abs=1e-5)
    # To a turn it takes less, but no less than from rest to where the speed is largest.
    for way in (1e-3, 0.02, 0.1, 0.5):
        turn = time_to_turn(way, 1.0, 10.0, 200.0)
        assert turn < time_between_rests(way, 1.0, 10.0, 200.0)
        assert np.interp(turn, times, ways) > way or turn > times[-1]


@pytest.mark.parametrize("length", [1e-8, 1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("limits", [LIMITS, UNEQUAL_LIMITS, SliderLimits.uniform(1e-3, 0.01, 0.1)])
def test_short_and_slow_lines_are_planned_too(length, limits):
    line = line_between((0.05, 0.02, 0.3), (0.05 + length, 0.02 + 0.3 * length, 0.3))
    plan = LinearMotion(MACHINE).from_rest(line, limits)
    plan.check_limits(limits)
    assert np.allclose(MACHINE.forward(plan.at(9e9).heights), line.point(line.length), atol=1e-14)
    assert plan.duration < 1.5 * max(lower_bound(line, limits), 1e-9)


def lines_to_the_edge(count, margin, condition):
    """Return lines that end at the edge of a workspace that ends near the reach."""
    limits = WorkspaceLimits((0.0,) * 3, (1.5,) * 3, margin, condition)
    workspace = Workspace(MACHINE, limits)
    rng = np.random.default_rng(1)
    found = []
    while len(found) < count:
        start = rng.uniform((-0.1, -0.1, 0.4), (0.1, 0.1, 0.6))
        direction = rng.normal(size=3) * (1.0, 1.0, 0.3)
        way = workspace.exit_distance(start, direction, 2.0) * (1.0 - 1e-9)
        if way > 0.01:
            direction /= np.linalg.norm(direction)
            found.append(line_between(start.tolist(), (start + way * direction).tolist()))
    return found


@pytest.mark.parametrize(
    ("margin", "condition", "longest"), [(5e-4, 100.0, 4.0), (1e-3, 50.0, 2.0)]
)
def test_lines_to_where_arms_lie_flat_take_no_ages(margin, condition, longest):
    for line in lines_to_the_edge(50, margin, condition):
        plan = LinearMotion(MACHINE).from_rest(line, LIMITS)
        plan.check_limits(LIMITS)
        assert plan.duration < longest


def test_lines_that_cannot_be_followed_are_refused_and_never_planned_wrong():
    refused = 0
    for line in lines_to_the_edge(20, 1e-6, 1e6):
        try:
            plan = LinearMotion(MACHINE).from_rest(line, LIMITS)
        except PlanningError as error:
            assert "lies flat" in str(error)
            refused += 1
        else:
            plan.check_limits(LIMITS)
            assert np.isfinite(plan.sample(np.linspace(0.0, plan.duration, 100)).heights).all()
    assert refused


@pytest.mark.parametrize("scale", [1.0, 0.03, 0.01])
def test_a_jerk_that_is_no_limit_makes_no_move_long(scale):
    limits = SliderLimits.uniform(1.0, 1.0, 1e5).with_velocity_scaled(scale)
    line = line_between((-0.06, -0.05, 0.22), (0.06, 0.05, 0.28))
    plan = LinearMotion(MACHINE).from_rest(line, limits)
    plan.check_limits(limits)
    assert plan.duration < 1.5 * lower_bound(line, limits)


def test_jog_keeps_the_speed_of_the_platform():
    state = SliderState(MACHINE.inverse((-0.1, 0.0, 0.3)), AT_REST, AT_REST)
    direction = (0.2 / math.sqrt(0.05), 0.1 / math.sqrt(0.05), 0.0)
    builder = LineToEdge(WORKSPACE, direction, 0.05)
    plan = at_once(LinearMotion(MACHINE).jog(state, builder, LIMITS, 0.1, 0.05))
    line = plan.line
    sampled = plan.sample(np.linspace(0.0, plan.duration, 500))
    speeds = np.gradient(
        MACHINE.forward_batch(sampled.heights) @ np.array(line.direction), sampled.times
    )
    assert speeds.max() == pytest.approx(0.05, rel=1e-3)
    assert np.median(speeds) == pytest.approx(0.05, rel=1e-3)


def moving_state(seed: int) -> tuple[SliderState, np.random.Generator]:
    rng = np.random.default_rng(seed)
    motion = LinearMotion(MACHINE)
    while True:
        start, end = rng.uniform((-0.15, -0.15, 0.0), (0.15, 0.15, 0.5), (2, 3)).tolist()
        try:
            WORKSPACE.check_segment(start, end)
        except KinematicsError:
            continue
        plan = motion.from_rest(line_between(start, end), LIMITS)
        return plan.at(rng.uniform(0.1, 0.9) * plan.duration), rng


def assert_continues(plan, state: SliderState, jerk: float = 200.0) -> None:
    first = plan.at(0.0)
    for values, expected, tolerance in zip(first, state, (1e-13, 1e-10, 1e-8)):
        assert np.allclose(values, expected, rtol=0.0, atol=tolerance)
    step = 1e-5
    second = plan.at(step)
    change = np.abs(np.subtract(second.accelerations, first.accelerations))
    assert (change <= jerk * step * 1.001).all()


def test_new_target_in_mid_motion_blends_without_a_step():
    blended = 0
    for seed in range(15):
        state, rng = moving_state(seed)
        target = tuple(rng.uniform((-0.08, -0.08, 0.1), (0.08, 0.08, 0.42)).tolist())
        builder = LineToPosition(WORKSPACE, target)
        for way in at_once(JOINING.ways(state, builder, LIMITS)):
            try:
                plan = at_once(way.plan())
            except KinematicsError:
                continue
            blended += 1
            plan.check_limits(LIMITS)
            assert_continues(plan, state)
            end = MACHINE.forward(plan.at(plan.duration).heights)
            assert np.allclose(end, target, rtol=0.0, atol=1e-7)
            # Once the blend is over the platform is on a straight line to the target.
            times = np.linspace(min(plan.blend.duration, plan.duration), plan.duration, 50)
            offsets = MACHINE.forward_batch(plan.sample(times).heights) - np.array(target)
            beside = np.cross(offsets, np.array(plan.line.direction))
            assert np.abs(beside).max() < 1e-7
    assert blended


def test_of_the_ways_onto_a_line_the_soonest_is_taken_first():
    taken = 0
    for seed in range(8):
        state, rng = moving_state(seed)
        target = tuple(rng.uniform((-0.08, -0.08, 0.1), (0.08, 0.08, 0.42)).tolist())
        ways = at_once(JOINING.ways(state, LineToPosition(WORKSPACE, target), LIMITS))
        assert [way.expected for way in ways] == sorted(way.expected for way in ways)
        durations = {}
        for way in ways:
            with contextlib.suppress(KinematicsError):
                durations[way.plan] = at_once(way.plan()).duration
        left = list(ways)
        while any(way.plan in durations for way in left):
            plan = at_once(JOINING.soonest(left))
            plan.check_limits(LIMITS)
            taken += 1
            # None is left for later that was expected to be over before, and is.
            for way in left:
                if way.expected < plan.duration:
                    assert durations.get(way.plan, math.inf) >= plan.duration
        with pytest.raises(KinematicsError):
            at_once(JOINING.soonest(left))
        assert left == []
    assert taken


def test_no_turn_takes_much_longer_than_a_way_that_may_bend():
    """Where no quick way onto the line keeps the limits, a gentle one takes less than a stop."""
    for turn in random_turns(8, seed=1):
        assert planned(turn) < 1.6 * bent(turn)


def test_same_target_in_mid_motion_stays_on_the_line():
    motion = LinearMotion(MACHINE)
    line = line_between((-0.1, 0.02, 0.2), (0.12, -0.05, 0.4))
    plan = motion.from_rest(line, LIMITS)
    builder = LineToPosition(WORKSPACE, line.point(line.length))
    for part in np.linspace(0.05, 0.9, 18):
        time = float(part) * plan.duration
        looser = SliderLimits.uniform(1.2, 12.0, 250.0)
        again = at_once(at_once(JOINING.blending(plan.at(time), builder, looser, 0.1)).plan())
        assert again.blend is None
        assert_continues(again, plan.at(time), 250.0)
        assert np.allclose(again.line.direction, line.direction, rtol=0.0, atol=1e-9)


def test_brake_stays_on_the_line_and_is_soon_over():
    motion = LinearMotion(MACHINE)
    line = line_between((-0.1, 0.02, 0.2), (0.12, -0.05, 0.4))
    plan = motion.from_rest(line, LIMITS)
    braked = 0
    for part in np.linspace(0.1, 0.9, 17):
        state = plan.at(float(part) * plan.duration)
        for strength in (0.75, 0.5):
            try:
                brake = at_once(motion.brake(state, LIMITS, strength, 0.1))
            except KinematicsError:
                continue
            braked += 1
            assert_continues(brake, state)
            brake.check_limits(LIMITS)
            sampled = brake.sample(np.linspace(0.0, brake.duration, 50))
            offsets = MACHINE.forward_batch(sampled.heights) - np.array(line.start)
            assert np.abs(np.cross(offsets, np.array(line.direction))).max() < 1e-9
    assert braked


def test_nothing_brakes_at_rest():
    state = SliderState((0.6, 0.6, 0.6), AT_REST, AT_REST)
    with pytest.raises(PlanningError, match="no direction"):
        at_once(LinearMotion(MACHINE).brake(state, LIMITS, 0.9, 0.1))


def test_target_too_near_to_stop_at_is_refused():
    motion = LinearMotion(MACHINE)
    line = line_between((-0.1, 0.02, 0.2), (0.12, -0.05, 0.4))
    state = motion.from_rest(line, LIMITS).at(0.2)
    x, y, z = MACHINE.forward(state.heights)
    u, v, w = line.direction
    builder = LineToPosition(WORKSPACE, (x + 0.003 * u, y + 0.003 * v, z + 0.003 * w))
    with pytest.raises(PlanningError, match="cannot stop"):
        at_once(at_once(JOINING.blending(state, builder, LIMITS, 0.3)).plan())


def test_line_to_the_edge_ends_short_of_the_edge_and_needs_room():
    builder = LineToEdge(WORKSPACE, (1.0, 0.0, 0.0), 0.1)
    line = at_once(builder.limited(builder.line((0.0, 0.0, 0.3))))
    WORKSPACE.check_position(line.point(line.length))
    with pytest.raises(KinematicsError):
        WORKSPACE.check_position(line.point(line.length + 1e-3))
    with pytest.raises(NoRoomError) as caught:
        at_once(builder.limited(builder.line(line.point(line.length))))
    assert caught.value.direction == (1.0, 0.0, 0.0)
    assert "reach" in str(caught.value)
