"""Jogs in motion and moving targets: steps without a plan; with a shaper proved, its delay led."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress

import numpy as np
import pytest
from motion_machine import (
    DT,
    FINE,
    KINDS,
    LIMITS,
    MACHINE,
    OTHER,
    SHAPER,
    TARGET,
    WORKSPACE,
    RecordedEngine,
    assert_rests_at,
    each_mode,
    engine,
    place,
    platform_velocity,
    run,
    run_to_rest,
)
from soak import combined, corners, some

from benchmarks import followed as bench
from benchmarks.judge import LIMITS as SOAKED_LIMITS
from benchmarks.judge import WIDE
from benchmarks.soak import engine_at
from benchmarks.soak_follow import Case, driven
from testing.plain_follower import dead, forth_and_back, gentle
from testing.swing_behind import swing
from tri_glide_kinematics.dynamics import Arm, Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionPhase
from tri_glide_kinematics.motion.limits import (
    AT_REST,
    ForceLimits,
    PlatformSpeedLimit,
    SliderLimits,
)
from tri_glide_kinematics.motion.shaped import LimitBounds
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.motion.tracking import FOLLOW_HORIZON, LONGEST_HORIZON, Follower
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import OutsideWorkspaceError, Workspace

MODE = Mode(15.0, 0.03)
TWO_MODES = Shaper.of(ShaperKind.EI, MODE, Mode(25.5, 0.03))
CENTRE = (0.0, 0.0, 0.3)
# From one report of a target to the next [s].
TOLD = 0.02

# Where a target is at a time [s], and how fast it moves: [m], [m/s].
Target = Callable[[float], tuple[tuple, tuple]]

each_shaper_and_mode = corners("shaper, in_pieces", (None, SHAPER), (False, True))


def resting(in_pieces: bool = True, shaper: Shaper | None = None, **options) -> RecordedEngine:
    """Return an engine that rests in the middle, with a shaper in force."""
    start = MACHINE.inverse(CENTRE)
    return engine(heights=start, in_pieces=in_pieces, **options, shaper=shaper)


def jogging(in_pieces: bool = True, shaper: Shaper | None = None, **options) -> RecordedEngine:
    """Return an engine that jogs, with no plan as its direction has changed."""
    moving = resting(in_pieces, shaper, **options)
    moving.jog((0.05, 0.0, 0.0))
    run(moving, 0.2)
    moving.jog((0.0, 0.05, 0.0))
    run(moving, 0.2)
    assert moving.tracks
    assert moving.phase is MotionPhase.JOGGING
    return moving


def conveyed(in_pieces: bool = True, shaper: Shaper | None = SHAPER, **options) -> RecordedEngine:
    """Return an engine that follows a target on a line."""
    moving = resting(in_pieces, shaper, **options)
    followed(moving, conveyor, 0.5)
    return moving


def followed(
    moving: RecordedEngine, target: Target, seconds: float, begin: float = 0.0
) -> FloatArray:
    """Follow a ``target`` that is reported 50 times a second; return the heights."""
    first = len(moving.states) - 1
    for report in range(round(seconds / TOLD)):
        moving.track(*target(begin + report * TOLD))
        run(moving, TOLD)
        assert moving.phase is MotionPhase.TRACKING
    return moving.heights_since(first)


def errors(heights: FloatArray, target: Target, period: float = DT) -> FloatArray:
    """Return how far the platform is from a ``target`` in each step. Shape (n,) [m]."""
    wanted = [target(step * period)[0] for step in range(len(heights))]
    return np.linalg.norm(MACHINE.forward_batch(heights) - wanted, axis=1)


def conveyor(time: float) -> tuple[tuple, tuple]:
    return (-0.08 + 0.1 * time, 0.02, 0.28), (0.1, 0.0, 0.0)


def circle(time: float, radius: float = 0.02, turns: float = 1.0) -> tuple[tuple, tuple]:
    """Return place and velocity of a target on a circle, with so many turns a second."""
    rate = math.tau * turns
    x, y = radius * math.cos(rate * time), radius * math.sin(rate * time)
    return (x, y, CENTRE[2]), (-rate * y, rate * x, 0.0)


def slow_circle(time: float) -> tuple[tuple, tuple]:
    """Return a target on a circle with a radius of 30 mm, once in two seconds."""
    return circle(time, 0.03, 0.5)


@each_shaper_and_mode
def test_a_jog_that_turns_needs_no_plan_becomes_straight_and_rests_at_the_edge(shaper, in_pieces):
    moving = jogging(in_pieces, shaper)
    number = moving.plan_number
    for turn in range(20):
        moving.jog((0.05 * math.cos(turn), 0.05 * math.sin(turn), 0.01))
        assert moving.phase is MotionPhase.JOGGING
        assert not moving.preparing
        run(moving, 0.01)
    assert moving.plan_number == number
    run(moving, 0.4)
    wanted = np.array((0.05 * math.cos(19), 0.05 * math.sin(19), 0.01))
    assert platform_velocity(moving) == pytest.approx(wanted, abs=1e-6)
    begin = place(moving)
    run(moving, 0.3)
    way = place(moving) - begin
    assert np.linalg.norm(way) == pytest.approx(0.3 * np.linalg.norm(wanted), rel=1e-4)
    assert np.linalg.norm(np.cross(way, wanted)) / np.linalg.norm(wanted) < 1e-6
    moving.jog((0.2, 0.0, 0.05))
    run(moving, 4.0)
    assert not moving.tracks
    assert place(moving)[0] > 0.1
    WORKSPACE.check_heights(moving.state.heights)
    assert_rests_at(moving, place(moving))


@each_mode
def test_a_stop_brakes_at_once(in_pieces):
    moving = jogging(in_pieces)
    moving.stop()
    assert moving.phase is MotionPhase.STOPPING
    before = np.linalg.norm(platform_velocity(moving))
    run(moving, 0.02)
    assert np.linalg.norm(platform_velocity(moving)) < 0.7 * before
    run(moving, 0.5)
    assert_rests_at(moving, place(moving))


@each_mode
def test_a_stop_is_idle_when_the_shaper_is_empty(in_pieces):
    moving = conveyed(in_pieces)
    moving.stop()
    assert moving.phase is MotionPhase.STOPPING
    assert math.isnan(moving.tracking_distance)
    steps = len(run_to_rest(moving)) - 1
    assert SHAPER.duration < steps * DT < SHAPER.duration + 0.08
    still = moving.state.heights
    run(moving, 0.1)
    assert moving.state.heights == still
    assert moving.kept_limits


@pytest.mark.slow
@pytest.mark.parametrize(
    ("begin", "kind", "in_pieces"), combined((jogging, conveyed), KINDS, (False, True))
)
def test_a_pose_ends_a_jog_and_a_following(begin, kind, in_pieces):
    moving = begin(in_pieces, kind=kind)
    moving.move_to(TARGET)
    run_to_rest(moving)
    assert_rests_at(moving, TARGET)


def test_a_pose_that_is_given_up_lets_a_jog_go_on():
    moving = jogging()
    moving.move_to(TARGET)
    assert moving.preparing
    moving.keep_goal()
    run(moving, 0.2)
    assert moving.phase is MotionPhase.JOGGING
    assert platform_velocity(moving) == pytest.approx((0.0, 0.05, 0.0), abs=1e-6)


@each_mode
def test_limits_come_in_force_while_a_jog_goes_on(in_pieces):
    moving = jogging(in_pieces)
    lower = SliderLimits.uniform(0.5, 5.0, 100.0)
    moving.set_limits(lower)
    run(moving, 0.1)
    assert moving.limits == lower
    assert moving.phase is MotionPhase.JOGGING
    moving.set_speed_scale(0.5)
    run(moving, 0.3)
    assert platform_velocity(moving) == pytest.approx((0.0, 0.025, 0.0), abs=1e-6)
    # So low that the machine has to slow down first.
    moving.set_limits(SliderLimits.uniform(0.01, 5.0, 100.0))
    run(moving, 0.5)
    assert not moving.limits_pending
    assert np.abs(moving.state.velocities).max() <= 0.01
    assert moving.kept_limits


def test_lower_limits_come_in_force_while_a_target_is_followed():
    moving = resting(shaper=SHAPER)
    followed(moving, conveyor, 0.5)
    # So low that the machine has to slow down first: the platform moves faster than that.
    lower = SliderLimits.uniform(0.02, 5.0, 100.0)
    moving.set_limits(lower)
    followed(moving, conveyor, 0.3, 0.5)
    assert moving.limits == lower
    slow = len(moving.states)
    followed(moving, conveyor, 0.2, 0.8)
    assert moving.limit_use(lower, slow).is_within
    moving.set_limits(LIMITS)
    followed(moving, lambda _: (OTHER, AT_REST), 0.9)
    assert moving.limits == LIMITS
    assert place(moving) == pytest.approx(OTHER, abs=1e-9)
    assert moving.kept_limits


def test_with_a_bound_that_waits_no_step_is_proved_in_a_cycle(monkeypatch):
    """Each cycle of 2 ms took up to 10 ms of processor time until the bound was in force."""
    moving = resting()
    followed(moving, conveyor, 0.5)
    slow = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.05))
    moving.set_limits(slow)
    assert moving.limits_pending
    monkeypatch.delattr(Follower, "step")
    followed(moving, conveyor, 0.3, 0.5)
    assert moving.limits == slow
    assert moving.kept_limits


@corners("kind, shaper, in_pieces", KINDS, (None, SHAPER, TWO_MODES), (False, True))
def test_a_target_on_a_line_is_caught_up_with_and_followed_without_a_lag(kind, shaper, in_pieces):
    moving = resting(in_pieces, shaper, kind=kind)
    away = errors(followed(moving, conveyor, 1.0), conveyor)
    assert away[round(0.8 / DT) :].max() < 1e-9
    assert moving.tracking_distance == pytest.approx(away[-1], abs=1e-12)
    assert moving.kept_limits


def test_on_a_circle_the_delay_is_led_and_the_error_told():
    moving = resting(shaper=SHAPER)
    away = errors(followed(moving, slow_circle, 1.5), slow_circle)
    # The delay is 3 mm of the way; led with a steady velocity, 0.5 mm would be left.
    assert math.hypot(*slow_circle(0.0)[1]) * SHAPER.delay > 2.9e-3
    assert away[round(0.8 / DT) :].max() < 1.5e-4
    # Where the target is now is known from the newest report only.
    assert moving.tracking_distance == pytest.approx(away[-1], abs=5e-6)
    assert moving.kept_limits


@each_shaper_and_mode
def test_a_target_that_leaves_the_workspace_is_waited_for(shaper, in_pieces):
    moving = resting(in_pieces, shaper)
    half, farthest = 1.4, 0.3

    def out_and_back(time: float) -> tuple[tuple, tuple]:
        rate = 0.5 * math.pi / half
        speed = farthest * rate * math.cos(rate * time)
        return (farthest * math.sin(rate * time), 0.0, 0.3), (speed, 0.0, 0.0)

    followed(moving, out_and_back, half)
    assert moving.tracking_distance > 0.05
    assert np.abs(moving.state.velocities).max() < 1e-9
    assert place(moving)[0] > 0.1
    followed(moving, out_and_back, half, half)
    # Its velocity still changes: the mildest way is micrometres off.
    assert moving.tracking_distance < (5e-6 if shaper is None else 1e-4)
    assert moving.kept_limits
    for state in moving.states[::10]:
        WORKSPACE.check_heights(state.heights)


@each_mode
def test_a_target_that_jumps_is_caught_up_with(in_pieces):
    moving = resting(in_pieces)
    rng = np.random.default_rng(2)
    for _ in range(4):
        target = tuple(rng.uniform((-0.08, -0.08, 0.2), (0.08, 0.08, 0.4)).tolist())
        followed(moving, lambda _, target=target: (target, AT_REST), 0.5)
        assert place(moving) == pytest.approx(target, abs=1e-9)
        assert moving.state.velocities == AT_REST
    assert moving.kept_limits


@each_mode
def test_on_a_target_that_stands_still_the_platform_rests(in_pieces):
    moving = resting(in_pieces, SHAPER)
    followed(moving, lambda _: (TARGET, AT_REST), 1.0)
    assert place(moving) == pytest.approx(TARGET, abs=1e-9)
    assert np.abs(moving.state.velocities).max() < 1e-12
    assert moving.remaining == math.inf
    moving.stop()
    run(moving, SHAPER.duration + 0.05)
    assert moving.phase is MotionPhase.IDLE


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shaper", "kind", "in_pieces"), combined((None, SHAPER), KINDS, (False, True))
)
def test_in_mid_motion_a_target_takes_over(shaper, kind, in_pieces):
    moving = resting(in_pieces, shaper, kind=kind)
    moving.move_to(TARGET)
    run(moving, 0.12)
    moving.track(OTHER, AT_REST)
    assert moving.phase is MotionPhase.TRACKING
    assert moving.target is None
    run(moving, 1.2)
    assert place(moving) == pytest.approx(OTHER, abs=1e-9)
    moving.stop()
    assert math.isnan(moving.tracking_distance)
    run_to_rest(moving, longest=0.2)
    assert_rests_at(moving, OTHER)


def test_a_target_is_only_begun_with_where_it_can_be():
    moving = engine()
    for position, velocity, age in (
        ((0.5, 0.0, 0.3), AT_REST, 0.0),
        ((0.0, math.nan, 0.3), AT_REST, 0.0),
        ((0.0, 0.0, 0.3), (math.inf, 0.0, 0.0), 0.0),
        ((0.0, 0.0, 0.3), AT_REST, math.nan),
        ((0.0, 0.3), AT_REST, 0.0),
    ):
        with pytest.raises(KinematicsError):
            moving.track(position, velocity, age)
        assert moving.phase is MotionPhase.IDLE
    outside = MotionEngine(WORKSPACE, LIMITS)
    outside.start((0.905, 0.905, 0.905))
    with pytest.raises(OutsideWorkspaceError):
        outside.track(CENTRE, AT_REST)


# What a message can hold: numbers whose squares vanish or overflow, and all between.
SIZES = (5e-324, 1e-308, 1e-160, 1e-9, 1e3, 1e9, 1e24, 1e77, 1e160, 1e308)
ASIDE = (-0.6, 0.7, -0.4)


@pytest.mark.parametrize(
    ("shaper", "direction"),
    [*((None, each) for each in ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), ASIDE)), (SHAPER, ASIDE)],
)
@pytest.mark.parametrize("size", SIZES)
def test_however_large_or_small_numbers_are_the_motion_goes_on_within_limits(
    size, shaper, direction
):
    moving = resting(shaper=shaper)
    velocity = tuple(size * part for part in direction)
    for command in (lambda: moving.track(CENTRE, velocity), lambda: moving.jog(velocity)):
        followed(moving, lambda _: (CENTRE, (0.0, 0.0, 0.1)), 0.05)
        with suppress(KinematicsError):
            command()
        assert np.isfinite(run(moving, 0.05)).all()
    moving.stop()
    run_to_rest(moving, longest=1.0)
    assert_rests_at(moving, place(moving))


@pytest.mark.parametrize(
    ("motion", "way", "duration", "told"),
    [
        (gentle, (0.0, 0.0, -0.03), 0.1, 0.01),
        (gentle, (0.0, 0.0, -0.03), 0.15, 0.01),
        (gentle, (0.0, 0.0, -0.03), 0.15, 0.034),
        (gentle, (0.0, 0.0, -0.03), 0.15, 0.001),
        (gentle, (0.1, 0.0, 0.0), 0.2, 0.01),
        (gentle, (0.0, -0.1, 0.0), 0.15, 0.034),
        (dead, (0.0, 0.0, -0.1), 1.0, 0.01),
        (dead, (0.0, 0.0, -0.1), 1.0 / 3.0, 0.01),
        (dead, (0.0, 0.0, -0.2), 0.4, 0.01),
        (dead, (0.2, 0.0, 0.0), 0.4, 0.034),
        (forth_and_back, (0.0, 0.06, 0.0), 0.2, 0.01),
    ],
)
def test_a_target_that_ends_is_overshot_hardly_more_than_by_a_plain_follower(
    motion, way, duration, told
):
    """It does what the sliders cannot do, and rests: the platform is late, and does not dive."""
    way = np.array(way)
    start = np.array((0.0, 0.0, 0.3)) - 0.5 * way
    case = Case(motion, start, way, duration, told, 0.002, WORKSPACE, LIMITS)
    assert driven(case).ratio < 1.0


CARRIAGES = (1.0, 1.0, 1.0)
HEAVY = Masses(CARRIAGES, (Arm(0.21263480314518757),) * 3, 1.0, 0.5)
WEAK = ForceLimits(SliderForces(MACHINE, HEAVY), (41.117741732,) * 3, (56.972695642,) * 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("motion", "start", "way", "times", "added"),
    [
        # It went 10.6, 1.2, 2.2 and 1.4 mm past the end; 8.2, 0.3, 1.1 and 1.2 are allowed.
        (
            dead,
            (0.01470934, -0.01833435, 0.44257395),
            (-0.09733339, -0.04484494, -0.07448385),
            (0.435031307, 0.022139548, 0.004),
            None,
        ),
        (
            gentle,
            (-0.17538070, 0.07272023, 0.41831877),
            (-0.00939453, -0.00588809, 0.00222931),
            (0.057582006, 0.016054640, 0.0005),
            None,
        ),
        (
            dead,
            (-0.17101395, -0.14674861, 0.40878774),
            (0.00621314, 0.04970486, 0.00043718),
            (0.166978608, 0.019943212, 0.001),
            WEAK,
        ),
        (
            forth_and_back,
            (-0.14283205, 0.03754317, 0.21773295),
            (-0.00721296, -0.01278136, -0.00172903),
            (0.210484931, 0.005367129, 0.004),
            PlatformSpeedLimit(MACHINE, 0.69),
        ),
    ],
)
def test_far_from_the_middle_the_platform_is_not_led_aside_and_past_the_end(
    motion, start, way, times, added
):
    """Each slider for itself arrived at its own time, and where forces left less to brake with."""
    limits = SOAKED_LIMITS if added is None else SOAKED_LIMITS.with_added(added)
    case = Case(motion, np.array(start), np.array(way), *times, Workspace(MACHINE, WIDE), limits)
    for horizon in some((FOLLOW_HORIZON, 0.0, LONGEST_HORIZON), 1):
        assert driven(case, horizon).ratio < 1.0


def test_a_target_that_hardly_moves_is_no_noise():
    """The square of its velocity is zero in double precision."""
    moving = engine(heights=MACHINE.inverse((0.0, 0.0, 0.25)))
    for number in range(20):
        moving.track((0.0, 0.0, 0.25), (1e-170 * (-1) ** number, 0.0, 0.0))
        for _ in range(10):
            moving.step(DT)
    assert place(moving) == pytest.approx((0.0, 0.0, 0.25), abs=1e-9)


def test_a_target_on_a_circle_is_caught_up_with_from_rest():
    """The bound on what is gone past an end allows no much sooner one: see docs/motion.md."""
    period, told = 0.001, 0.034
    moving = engine(heights=MACHINE.inverse(circle(0.0, 0.05)[0]), in_pieces=True)
    reported, errors = -1, []
    for cycle in range(800):
        now = cycle * period
        if math.floor(now / told + 1e-9) > reported:
            reported += 1
            moving.track(*circle(reported * told, 0.05, 0.5), now - reported * told)
        moving.step(period)
        errors.append(math.dist(place(moving), circle(now + period, 0.05, 0.5)[0]))
    assert max(errors[540:]) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "turns", "told", "noise", "jerk", "fast", "error"),
    [
        *some(
            [
                (0.02, 1.0, 0.01, (0.0, 0.0), 1.4, 3e-3, 2.5e-5),
                (0.02, 1.0, 1.0 / 30.0, (0.0, 0.0), 1.1, 1e-3, 1e-5),
                (0.03, 0.5, 0.01, (0.0, 0.0), 1.6, 3e-3, 2.5e-5),
                (0.02, 1.0, 0.01, (1e-5, 0.0), 1.5, 5e-3, 2.5e-5),
            ],
            2,
        ),
        (0.02, 1.0, 0.01, (1e-4, 0.0), 4.0, 3e-2, 2e-4),
        # Positions tell how fast it is where velocities are noise.
        (0.02, 1.0, 0.01, (0.0, 2e-3), 1.4, 3e-3, 2.5e-5),
        (0.02, 1.0, 0.01, (0.0, 3e-2), 1.4, 3e-3, 2.5e-5),
        (0.02, 1.0, 1.0 / 30.0, (0.0, 8e-3), 3.0, 5e-3, 2.5e-4),
    ],
)
def test_a_target_on_a_circle_is_followed_calmly(radius, turns, told, noise, jerk, fast, error):
    found = bench.followed(bench.on_circle(radius, turns), 1.0, told, *noise)
    assert found.jerk < jerk
    assert found.fast < fast
    assert found.behind < error


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "turns", "told", "noise", "jerk", "fast", "error"),
    [
        (0.02, 1.0, 0.01, 0.0, 1.4, 3e-3, 2.5e-5),
        (0.03, 0.5, 1.0 / 30.0, 0.0, 1.2, 1e-3, 1e-5),
        # What is led of velocities that are made of noise is as wrong as they are: it was 14 mm.
        (0.03, 0.5, 1.0 / 30.0, 1e-4, 80.0, 3e-2, 3e-3),
        (0.02, 1.0, 0.01, 1e-4, 20.0, 3e-2, 5e-3),
    ],
)
def test_poses_on_a_circle_are_followed_calmly(radius, turns, told, noise, jerk, fast, error):
    motion = bench.on_circle(radius, turns)
    found = bench.followed(motion, 1.0 / turns, told, noise, as_poses=True)
    assert found.jerk < jerk
    assert found.fast < fast
    assert found.behind < error


@pytest.mark.parametrize(("told", "as_poses"), [(0.01, False), (1.0 / 30.0, True)])
def test_where_reports_are_lost_a_target_is_followed_as_calmly(told, as_poses):
    """It took 9 and 26 times the jerk of its circle: what was foreseen ended, or was new."""
    motion = bench.on_circle(0.03, 0.5)
    found = bench.followed(motion, 2.0, told, as_poses=as_poses, lost=0.05)
    assert found.jerk < 1.4
    assert found.behind < 2.5e-5


@pytest.mark.parametrize(("part", "angle"), [(0.9, 0.0), (1.5, 0.0), (1.0, 0.1), (0.8, -0.5)])
def test_velocities_that_are_told_wrong_again_and_again_are_corrected(part, angle):
    """It was run after with up to 80 times the jerk of its circle."""
    circle, turn = bench.on_circle(0.02, 1.0), part * np.exp(1j * angle)

    def motion(time: float) -> tuple:
        place, (x, y, z) = circle(time)
        wrong = turn * complex(x, y)
        return place, (wrong.real, wrong.imag, part * z)

    found = bench.followed(motion, 1.0, 0.01)
    assert found.jerk < 1.1
    assert found.behind < 5e-6


def test_a_turn_that_ends_unnoticed_is_overshot_by_what_the_messages_in_between_take():
    engine, angles = engine_at((0.0, 0.0, 0.3)), []
    for cycle in range(800):
        if cycle % 20 == 0:
            angle = math.tau * min(0.001 * cycle, 0.5)
            engine.jog((0.1 * math.cos(angle), 0.1 * math.sin(angle), 0.0))
        state = engine.step(0.001)
        x, y, _ = MACHINE.forward_velocity(state.heights, state.velocities)[1]
        angles.append(math.atan2(y, -x))
    beyond = np.array(angles[480:])
    # For 20 ms, and what it takes to turn no more.
    assert math.tau * 0.02 < -beyond.min() < math.tau * 0.03
    assert np.abs(beyond[110:]).max() < math.tau * 0.002


def test_much_noise_keeps_no_target_from_being_caught(monkeypatch):
    """It was run after for 1.5 s, with 60 times the jerk of its circle."""
    monkeypatch.setattr(bench, "SEED", 2)
    assert bench.followed(bench.on_circle(0.02, 1.0), 1.0, 0.004, 3e-4).jerk < 5.0


def test_a_target_that_has_rested_is_foreseen_as_before():
    """What was foreseen before it rested says nothing about what it does then."""

    def motion(time: float) -> tuple:
        # A turn in 1.2 s that begins and ends gently, then a second of rest.
        part = min(time % 2.2, 1.2) / 1.2
        angle = math.tau * (10.0 * part**3 - 15.0 * part**4 + 6.0 * part**5)
        rate = math.tau / 1.2 * 30.0 * part**2 * (1.0 - part) ** 2
        x, y = 0.02 * math.cos(angle), 0.02 * math.sin(angle)
        return (x, y, 0.3), (-rate * y, rate * x, 0.0)

    assert bench.followed(motion, 3.0, 0.01).behind < 6e-5


@pytest.mark.slow
@pytest.mark.parametrize("turns", [0.5, 1.0])
def test_a_twist_that_turns_is_followed_calmly_and_without_a_lag(turns):
    found = bench.jogged(turns)
    assert found.jerk < 1.4
    assert found.fast < 3e-3
    assert found.turns < 20.0
    assert abs(found.behind) < 0.002


def test_a_horizon_makes_no_error_on_a_line_and_catching_up_no_longer():
    assert bench.straight_error() < 1e-6
    for speed in (0.0, 0.1):
        assert bench.time_to_catch(speed) <= 1.05 * bench.time_to_catch(speed, 0.0)


@pytest.mark.parametrize("horizon", [0.02, 0.1])
def test_with_any_horizon_a_target_that_rests_is_reached_exactly(horizon):
    moving = engine()
    moving.set_follow_horizon(horizon)
    moving.track((0.0, 0.05, 0.35), AT_REST)
    run(moving, 1.5)
    assert moving.kept_limits
    assert moving.state.velocities == moving.state.accelerations == AT_REST
    assert place(moving) == pytest.approx((0.0, 0.05, 0.35), abs=1e-9)


def test_the_horizon_can_be_changed_while_a_target_is_followed():
    moving, jerks = engine(), []
    rng = np.random.default_rng(5)
    for horizon in (0.0, 0.045, 0.0, 0.1):
        moving.set_follow_horizon(horizon)
        for report in range(50):
            position, velocity = circle(0.01 * report)
            moving.track(np.add(position, 1e-5 * rng.normal(size=3)).tolist(), velocity)
            run(moving, 0.01)
        last = np.diff([state.accelerations for state in moving.states[-100:]], axis=0)
        jerks.append(float(np.sqrt(np.square(last).mean())) / DT)
    assert moving.kept_limits
    assert jerks[0] > 20.0 * jerks[1] and jerks[2] > 20.0 * jerks[3]


@pytest.mark.parametrize("horizon", [-0.001, 0.101, math.nan, math.inf])
def test_a_horizon_out_of_bounds_is_refused(horizon):
    with pytest.raises(KinematicsError, match="follow_horizon"):
        engine().set_follow_horizon(horizon)


def zigzag(time: float) -> tuple[tuple, tuple]:
    """Return a target whose velocity changes twice a second."""
    turn, past = divmod(time, 0.5)
    side = 1.0 if turn % 2 == 0 else -1.0
    return (side * (0.12 * past - 0.03), 0.0, 0.3), (side * 0.12, 0.0, 0.0)


def test_a_target_that_jumps_far_would_exceed_limits_without_the_proof(monkeypatch):
    largest = []
    for _ in range(2):
        moving = resting(in_pieces=False, shaper=SHAPER)
        for side in (0.1, -0.1, 0.1, -0.1):
            followed(moving, lambda _, side=side: ((side, 0.0, 0.3), AT_REST), 0.16)
        largest.append(moving.limit_use(LIMITS).largest.max())
        monkeypatch.setattr(LimitBounds, "keeps_limits", True)
    assert largest[0] <= 1.0 + 1e-6 and largest[1] > 1.05


@pytest.mark.parametrize(
    ("shaper", "added"),
    [(SHAPER, ()), (None, (PlatformSpeedLimit(MACHINE, 0.4),))],
    ids=["shaper", "speed limit"],
)
def test_what_is_followed_in_long_steps_is_as_calm_as_it_is_itself(shaper, added):
    """Each step was on the target at its end, with 15 to 76 times the jerk of the ideal motion."""
    moving = resting(shaper=shaper, period=FINE, limits=LIMITS.with_added(*added))
    heights = followed(moving, slow_circle, 2.0)
    ideal = np.array([MACHINE.inverse(slow_circle(step * FINE)[0]) for step in range(len(heights))])
    calm = bench.calm_of(heights[1000:], ideal[1000:], 0.02, 0.0)
    assert 0.9 < calm.jerk < 1.4
    assert calm.fast < 3e-3
    assert calm.turns <= 20.0
    assert errors(heights, slow_circle, FINE)[1000:].max() < 2.5e-5


def test_a_twist_that_turns_is_led_by_a_long_step_and_the_delay():
    """It lagged by 52 ms."""
    moving, lags = resting(shaper=SHAPER), []
    for step in range(1000):
        if step % round(TOLD / DT) == 0:
            moving.jog(slow_circle(step * DT)[1])
        run(moving, DT)
        (vx, vy, _), (wx, wy, _) = platform_velocity(moving), slow_circle((step + 1) * DT)[1]
        lags.append(math.atan2(vx * wy - vy * wx, vx * wx + vy * wy) / math.pi)
    assert abs(np.mean(lags[500:])) < 5e-3


def test_a_shaper_takes_most_of_the_swing_out_of_following():
    left = []
    for shaper in (None, SHAPER):
        heights = followed(resting(shaper=shaper), zigzag, 2.0)
        offsets = swing(MACHINE.forward_batch(heights), DT, MODE)
        # From 0.3 s after each turn on the target moves straight, so the platform should, too.
        calm = DT * np.arange(len(offsets)) % 0.5 >= 0.3
        left.append(math.sqrt(float(np.square(offsets[calm]).sum(axis=1).mean())))
    assert left[0] > 1.5e-4
    assert left[1] < 0.1 * left[0]


@pytest.mark.parametrize(
    ("step", "seconds", "in_pieces"),
    # In pieces some of the steps are waited in.
    [
        (0.0005, 1.3, True),
        (0.03, 2.5, False),
        (0.1, 4.0, False),
        (0.03, 6.0, True),
        (0.1, 12.0, True),
    ],
)
def test_it_ends_on_the_target_whatever_the_steps_of_the_engine_are(step, seconds, in_pieces):
    moving = resting(in_pieces, SHAPER)
    for number in range(round(seconds / step)):
        # For half a second it is outside the workspace.
        x = 0.5 if 0.5 < number * step < 1.0 else 0.05
        moving.track((x, 0.0, 0.3), AT_REST)
        moving.step(step)
        moving.work(lambda: True)
    assert place(moving) == pytest.approx((0.05, 0.0, 0.3), abs=1e-9)


def test_a_shaper_that_is_set_while_a_target_is_followed_waits_for_rest():
    moving = resting()
    followed(moving, conveyor, 0.5)
    moving.set_shaper(SHAPER)
    followed(moving, lambda _: (CENTRE, AT_REST), 0.5)
    assert moving.shaper_pending
    moving.stop()
    run(moving, 0.1)
    followed(moving, lambda _: (CENTRE, AT_REST), 0.1)
    assert moving.shaper is SHAPER


def test_a_noisy_target_that_is_told_often_does_not_take_the_whole_jerk():
    period, motion, rng = 0.002, bench.on_circle(0.02, 1.0), np.random.default_rng(1)
    following, heights, ideal = engine(heights=MACHINE.inverse((0.0, -0.05, 0.3))), [], []
    for cycle in range(1000):
        position, velocity = motion(cycle * period)
        if cycle % 2 == 0:
            following.track((position + 1e-4 * rng.normal(size=3)).tolist(), velocity)
        heights.append(following.step(period).heights)
        ideal.append(MACHINE.inverse(motion((cycle + 1) * period)[0]))
    jerk, wanted = (np.linalg.norm(np.diff(each[500:], 3, axis=0)) for each in (heights, ideal))
    assert jerk < 5.0 * wanted
