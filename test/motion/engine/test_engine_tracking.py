"""Jogs in motion and moving targets: steps without a plan, and what may come in between."""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np
import pytest
from motion_machine import (
    DT,
    HOME,
    LIMITS,
    MACHINE,
    TARGET,
    WORKSPACE,
    each_kind,
    engine,
    place,
    platform_velocity,
    within,
)

from benchmarks import followed
from benchmarks.judge import LIMITS as SOAKED_LIMITS
from benchmarks.judge import WIDE
from benchmarks.soak_follow import Case, driven
from testing.plain_follower import (
    dead,
    forth_and_back,
    gentle,
    most_beyond,
    places_of_plain_follower,
)
from tri_glide_kinematics.dynamics import Arm, Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionPhase
from tri_glide_kinematics.motion.limits import ForceLimits, PlatformSpeedLimit, SliderLimits
from tri_glide_kinematics.motion.tracking import FOLLOW_HORIZON, LONGEST_HORIZON
from tri_glide_kinematics.workspace import OutsideWorkspaceError, Workspace

CENTRE = (0.0, 0.0, 0.3)
AT_REST = (0.0, 0.0, 0.0)

# With plans within commands, and in pieces.
each_mode = pytest.mark.parametrize("in_pieces", [False, True])


def go(moving: MotionEngine, seconds: float) -> list:
    """Step an engine; return the setpoints."""
    states = []
    for _ in range(round(seconds / DT)):
        states.append(moving.step(DT))
        moving.work(lambda: False)
    return states


def heights_of(states) -> np.ndarray:
    return np.array([HOME, *(state.heights for state in states)])


def jogging(in_pieces: bool = True) -> tuple[MotionEngine, list]:
    """Return an engine that jogs, with no plan as its direction has changed, and its setpoints."""
    moving = engine(in_pieces=in_pieces)
    moving.jog((0.05, 0.0, 0.0))
    states = go(moving, 0.15)
    moving.jog((0.0, 0.05, 0.0))
    states += go(moving, 0.2)
    assert moving.tracks
    assert moving.phase is MotionPhase.JOGGING
    return moving, states


def circle(time: float, radius: float = 0.02) -> tuple[tuple, tuple]:
    """Return place and velocity of a target on a circle, once a second."""
    angle = 2.0 * math.pi * time
    x, y = radius * math.cos(angle), radius * math.sin(angle)
    return (x, y, CENTRE[2]), (-2.0 * math.pi * y, 2.0 * math.pi * x, 0.0)


@each_mode
def test_a_jog_that_turns_needs_no_plan_and_becomes_straight(in_pieces):
    moving, states = jogging(in_pieces)
    number = moving.plan_number
    for turn in range(20):
        moving.jog((0.05 * math.cos(turn), 0.05 * math.sin(turn), 0.01))
        assert not moving.preparing
        states += go(moving, 0.01)
    assert moving.plan_number == number
    states += go(moving, 0.3)
    wanted = np.array((0.05 * math.cos(19), 0.05 * math.sin(19), 0.01))
    assert platform_velocity(moving) == pytest.approx(wanted, abs=1e-6)
    begin = place(moving)
    states += go(moving, 0.3)
    way = place(moving) - begin
    aside = np.linalg.norm(np.cross(way, wanted)) / np.linalg.norm(wanted)
    assert np.linalg.norm(way) == pytest.approx(0.3 * np.linalg.norm(wanted), rel=1e-4)
    assert aside < 1e-6
    assert within(heights_of(states))


def test_a_jog_in_motion_comes_to_rest_at_the_edge():
    moving, states = jogging()
    moving.jog((0.2, 0.0, 0.05))
    states += go(moving, 6.0)
    assert moving.phase is MotionPhase.IDLE
    assert not moving.tracks
    WORKSPACE.check_heights(moving.state.heights)
    assert place(moving)[0] > 0.1
    assert within(heights_of(states))


@each_mode
def test_a_stop_brakes_at_once(in_pieces):
    moving, states = jogging(in_pieces)
    moving.stop()
    assert moving.phase is MotionPhase.STOPPING
    before = np.linalg.norm(platform_velocity(moving))
    states += go(moving, 0.02)
    assert np.linalg.norm(platform_velocity(moving)) < 0.7 * before
    states += go(moving, 0.5)
    assert moving.phase is MotionPhase.IDLE
    assert within(heights_of(states))


@each_mode
@each_kind
def test_a_pose_ends_a_jog(kind, in_pieces):
    moving = engine(kind, in_pieces=in_pieces)
    moving.jog((0.05, 0.0, 0.0))
    states = go(moving, 0.15)
    moving.jog((0.0, 0.05, 0.0))
    states += go(moving, 0.2)
    moving.move_to(TARGET)
    states += go(moving, 3.0)
    assert moving.phase is MotionPhase.IDLE
    assert np.abs(place(moving) - TARGET).max() < 1e-9
    assert within(heights_of(states))


def test_a_pose_that_is_given_up_lets_a_jog_go_on():
    moving, _ = jogging()
    moving.move_to(TARGET)
    assert moving.preparing
    moving.keep_goal()
    go(moving, 0.2)
    assert moving.phase is MotionPhase.JOGGING
    assert platform_velocity(moving) == pytest.approx((0.0, 0.05, 0.0), abs=1e-6)


@each_mode
def test_limits_come_in_force_while_a_jog_goes_on(in_pieces):
    moving, states = jogging(in_pieces)
    lower = SliderLimits.uniform(0.5, 5.0, 100.0)
    moving.set_limits(lower)
    states += go(moving, 0.1)
    assert moving.limits == lower
    assert moving.phase is MotionPhase.JOGGING
    moving.set_speed_scale(0.5)
    states += go(moving, 0.3)
    assert platform_velocity(moving) == pytest.approx((0.0, 0.025, 0.0), abs=1e-6)
    # So low that the machine has to slow down first.
    moving.set_limits(SliderLimits.uniform(0.01, 5.0, 100.0))
    states += go(moving, 0.5)
    assert not moving.limits_pending
    assert np.abs(moving.state.velocities).max() <= 0.01
    assert within(heights_of(states))


@each_mode
@each_kind
def test_a_target_on_a_straight_line_is_caught_up_with_and_followed(kind, in_pieces):
    moving = engine(kind, in_pieces=in_pieces)
    start, velocity = np.array((-0.1, 0.02, 0.28)), np.array((0.1, 0.0, 0.02))
    states, errors = [], []
    for step in range(1800):
        if step % 10 == 0:
            moving.track((start + step * DT * velocity).tolist(), velocity.tolist())
        states += go(moving, DT)
        errors.append(np.linalg.norm(place(moving) - start - (step + 1) * DT * velocity))
        assert moving.phase is MotionPhase.TRACKING
    assert max(errors[600:]) < 1e-8
    assert moving.tracking_distance == pytest.approx(errors[-1], abs=1e-12)
    assert within(heights_of(states))


def test_a_target_on_a_circle_is_followed_by_rare_and_late_reports():
    moving = engine(in_pieces=True)
    rng = np.random.default_rng(8)
    states, errors = [], []
    due = 0.0
    for step in range(2500):
        now = step * DT
        if now >= due:
            seen = due
            due += 1.0 / 30.0
            late = float(rng.uniform(0.0, 0.005))
            (x, y, z), velocity = circle(seen - late)
            moving.track((x, y, z), velocity, age=now - seen + late)
        states += go(moving, DT)
        errors.append(math.dist(place(moving), circle(now + DT)[0]))
    assert max(errors[1000:]) < 1e-3
    assert within(heights_of(states))


@each_mode
def test_a_target_that_leaves_the_workspace_is_waited_for(in_pieces):
    moving = engine(in_pieces=in_pieces)
    states = []
    for step in range(2000):
        # Out to the side, far beyond the reach, and back.
        angle = math.pi * step / 2000.0
        moving.track((0.3 * math.sin(angle), 0, 0.3), (0.15 * math.pi * math.cos(angle), 0, 0))
        states += go(moving, DT)
        WORKSPACE.check_heights(moving.state.heights)
        if step == 1000:
            assert moving.tracking_distance > 0.05
            assert moving.state.velocities == pytest.approx(AT_REST, abs=1e-9)
    # Its velocity still changes: the mildest way is micrometres off.
    assert moving.tracking_distance < 5e-6
    assert within(heights_of(states))


@each_mode
def test_a_target_that_jumps_is_caught_up_with(in_pieces):
    moving = engine(in_pieces=in_pieces)
    rng, states = np.random.default_rng(2), []
    for _ in range(6):
        x, y, z = rng.uniform((-0.08, -0.08, 0.2), (0.08, 0.08, 0.4)).tolist()
        for _ in range(60):
            moving.track((x, y, z), AT_REST)
            states += go(moving, 0.01)
        assert place(moving) == pytest.approx((x, y, z), abs=1e-9)
        assert moving.state.velocities == AT_REST
    assert within(heights_of(states))


@each_mode
@each_kind
def test_in_mid_motion_a_target_takes_over(kind, in_pieces):
    moving = engine(kind, in_pieces=in_pieces)
    moving.move_to(TARGET)
    states = go(moving, 0.12)
    moving.track((-0.05, 0.0, 0.3), AT_REST)
    assert moving.phase is MotionPhase.TRACKING
    assert moving.target is None
    states += go(moving, 2.0)
    assert place(moving) == pytest.approx((-0.05, 0.0, 0.3), abs=1e-9)
    moving.stop()
    assert moving.phase is MotionPhase.IDLE
    assert math.isnan(moving.tracking_distance)
    assert within(heights_of(states))


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


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (-0.6, 0.7, -0.4)])
def test_however_large_or_small_numbers_are_the_motion_goes_on_within_limits(size, direction):
    moving = engine(in_pieces=True)
    velocity = tuple(size * part for part in direction)
    for command in (lambda: moving.track(CENTRE, velocity), lambda: moving.jog(velocity)):
        for _ in range(20):
            moving.track(CENTRE, (0.0, 0.0, 0.1))
            moving.step(DT)
            moving.work(lambda: True)
        with suppress(KinematicsError):
            command()
        rows = []
        for _ in range(60):
            rows.append(moving.step(DT).heights)
            moving.work(lambda: True)
        assert np.isfinite(rows).all()
        assert np.abs(np.diff(rows, axis=0)).max() <= DT * max(LIMITS.velocity) * (1.0 + 1e-6)
    moving.stop()
    for _ in range(1000):
        moving.step(DT)
        moving.work(lambda: True)
    assert moving.phase is MotionPhase.IDLE


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
    period, rested, after = 0.002, 0.05, 0.8
    way = np.array(way)
    start = np.array((0.0, 0.0, 0.3)) - 0.5 * way
    reports = []
    for number in range(round((rested + 2.0 * duration + after) / told)):
        part, speed = motion((number * told - rested) / duration)
        reports.append((number * told, start + part * way, speed / duration * way))
    moving = engine(heights=MACHINE.inverse(start), in_pieces=True)
    waiting, places = list(reports), []
    for cycle in range(round((rested + 2.0 * duration + after) / period)):
        while waiting and waiting[0][0] <= cycle * period + 1e-9:
            time, position, velocity = waiting.pop(0)
            moving.track(position, velocity, cycle * period - time)
        moving.step(period)
        moving.work(lambda: True)
        places.append(place(moving))
    plain = places_of_plain_follower(reports, len(places) * period, period)
    stroke = float(np.linalg.norm(way))
    allowed = max(most_beyond(plain, start, way), 0.0) + 1e-4 + 0.02 * stroke
    assert most_beyond(np.array(places), start, way) < allowed
    end = start + motion(math.inf)[0] * way
    assert places[-1] == pytest.approx(end, abs=1e-9)


CARRIAGES = (1.0, 1.0, 1.0)
HEAVY = Masses(CARRIAGES, (Arm(0.21263480314518757),) * 3, 1.0, 0.5)
WEAK = ForceLimits(SliderForces(MACHINE, HEAVY), (41.117741732,) * 3, (56.972695642,) * 3)


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
    for horizon in (0.0, FOLLOW_HORIZON, LONGEST_HORIZON):
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
    start, _ = circle(0.0, 0.05)
    moving = engine(heights=MACHINE.inverse(start), in_pieces=True)
    reported, errors = -1, []
    for cycle in range(800):
        now = cycle * period
        if math.floor(now / told + 1e-9) > reported:
            reported += 1
            position, velocity = circle(0.5 * reported * told, 0.05)
            velocity = tuple(0.5 * part for part in velocity)
            moving.track(position, velocity, now - reported * told)
        moving.step(period)
        errors.append(math.dist(place(moving), circle(0.5 * (now + period), 0.05)[0]))
    assert max(errors[540:]) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "turns", "told", "noise", "jerk", "fast", "error"),
    [
        (0.02, 1.0, 0.01, (0.0, 0.0), 1.4, 3e-3, 2.5e-5),
        (0.03, 0.5, 0.01, (0.0, 0.0), 1.6, 3e-3, 2.5e-5),
        (0.02, 1.0, 1.0 / 30.0, (0.0, 0.0), 2.5, 5e-3, 5e-5),
        (0.02, 1.0, 0.01, (1e-5, 0.0), 1.5, 5e-3, 2.5e-5),
        (0.02, 1.0, 0.01, (1e-4, 0.0), 4.0, 3e-2, 2e-4),
        # Positions tell how fast it is where velocities are noise.
        (0.02, 1.0, 0.01, (0.0, 2e-3), 1.4, 3e-3, 2.5e-5),
        (0.02, 1.0, 0.01, (0.0, 3e-2), 1.4, 3e-3, 2.5e-5),
        (0.02, 1.0, 1.0 / 30.0, (0.0, 8e-3), 5.0, 5e-3, 2e-4),
    ],
)
def test_a_target_on_a_circle_is_followed_calmly(radius, turns, told, noise, jerk, fast, error):
    found = followed.followed(followed.on_circle(radius, turns), 1.0, told, *noise)
    assert found.jerk < jerk
    assert found.fast < fast
    assert found.behind < error


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "turns", "told", "noise", "jerk", "fast", "error"),
    [
        (0.02, 1.0, 0.01, 0.0, 1.4, 3e-3, 2.5e-5),
        (0.03, 0.5, 1.0 / 30.0, 0.0, 3.5, 3e-3, 5e-5),
        # What is led of velocities that are made of noise is as wrong as they are: it was 14 mm.
        (0.03, 0.5, 1.0 / 30.0, 1e-4, 80.0, 3e-2, 3e-3),
        (0.02, 1.0, 0.01, 1e-4, 20.0, 3e-2, 5e-3),
    ],
)
def test_poses_on_a_circle_are_followed_calmly(radius, turns, told, noise, jerk, fast, error):
    motion = followed.on_circle(radius, turns)
    found = followed.followed(motion, 1.0 / turns, told, noise, as_poses=True)
    assert found.jerk < jerk
    assert found.fast < fast
    assert found.behind < error


def test_a_target_that_has_rested_is_foreseen_as_before():
    """What was foreseen before it rested says nothing about what it does then."""

    def motion(time: float) -> tuple:
        # A turn in 1.2 s that begins and ends gently, then a second of rest.
        part = min(time % 2.2, 1.2) / 1.2
        angle = math.tau * (10.0 * part**3 - 15.0 * part**4 + 6.0 * part**5)
        rate = math.tau / 1.2 * 30.0 * part**2 * (1.0 - part) ** 2
        x, y = 0.02 * math.cos(angle), 0.02 * math.sin(angle)
        return (x, y, 0.3), (-rate * y, rate * x, 0.0)

    assert followed.followed(motion, 3.0, 0.01).behind < 6e-5


@pytest.mark.slow
@pytest.mark.parametrize("turns", [0.5, 1.0])
def test_a_twist_that_turns_is_followed_calmly_and_without_a_lag(turns):
    found = followed.jogged(turns)
    assert found.jerk < 1.4
    assert found.fast < 3e-3
    assert found.turns < 20.0
    assert abs(found.behind) < 0.002


def test_a_horizon_makes_no_error_on_a_line_and_catching_up_no_longer():
    assert followed.straight_error() < 1e-6
    for speed in (0.0, 0.1):
        assert followed.time_to_catch(speed) <= 1.05 * followed.time_to_catch(speed, 0.0)


@pytest.mark.parametrize("horizon", [0.02, 0.1])
def test_with_any_horizon_a_target_that_rests_is_reached_exactly(horizon):
    moving = engine()
    moving.set_follow_horizon(horizon)
    moving.track((0.0, 0.05, 0.35), AT_REST)
    states = go(moving, 1.5)
    assert within(heights_of(states))
    assert states[-1].velocities == states[-1].accelerations == AT_REST
    assert math.dist(MACHINE.forward(states[-1].heights), (0.0, 0.05, 0.35)) < 1e-9


def test_the_horizon_can_be_changed_while_a_target_is_followed():
    moving, states, jerks = engine(), [], []
    rng = np.random.default_rng(5)
    for horizon in (0.0, 0.045, 0.0, 0.1):
        moving.set_follow_horizon(horizon)
        for report in range(50):
            position, velocity = circle(0.01 * report)
            moving.track(np.add(position, 1e-5 * rng.normal(size=3)).tolist(), velocity)
            states += go(moving, 0.01)
        last = np.diff([state.accelerations for state in states[-200:]], axis=0)
        jerks.append(float(np.sqrt(np.square(last).mean())) / DT)
    assert within(heights_of(states))
    assert jerks[0] > 20.0 * jerks[1] and jerks[2] > 20.0 * jerks[3]


@pytest.mark.parametrize("horizon", [-0.001, 0.101, math.nan, math.inf])
def test_a_horizon_out_of_bounds_is_refused(horizon):
    with pytest.raises(KinematicsError, match="follow_horizon"):
        engine().set_follow_horizon(horizon)
