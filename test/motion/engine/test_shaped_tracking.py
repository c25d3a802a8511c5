"""Moving targets, and jogs that turn, with a shaper: proved steps, the delay led, little swing."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from motion_machine import (
    DT,
    LIMITS,
    MACHINE,
    OTHER,
    TARGET,
    WORKSPACE,
    limit_use,
    place,
    platform_velocity,
    within,
)
from soak import many
from strategies import DEFAULT_LIMITS

from benchmarks.followed import calm_of
from testing.swing_behind import swing
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionPhase, PlatformSpeedLimit, SliderLimits
from tri_glide_kinematics.motion.shaped import LimitBounds
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace

MODE = Mode(15.0, 0.03)
SHAPER = Shaper.of(ShaperKind.EI, MODE)
TWO_MODES = Shaper.of(ShaperKind.EI, MODE, Mode(25.5, 0.03))
UNEQUAL = TriGlide(replace(DEFAULT_GEOMETRY, arm_lengths=(0.4, 0.43, 0.38)))
CENTRE = (0.0, 0.0, 0.3)
AT_REST = (0.0, 0.0, 0.0)

# Where a target is at a time [s], and how fast it moves: [m], [m/s].
Target = Callable[[float], tuple[tuple, tuple]]

each_mode = pytest.mark.parametrize("in_pieces", [False, True])


def shaped(
    in_pieces: bool = True, shaper: Shaper | None = SHAPER, machine: TriGlide = MACHINE
) -> MotionEngine:
    """Return an engine that rests in the middle, with a shaper in force."""
    moving = MotionEngine(Workspace(machine, DEFAULT_LIMITS), LIMITS, in_pieces=in_pieces)
    moving.start(machine.inverse(CENTRE))
    moving.set_shaper(shaper)
    return moving


def go(moving: MotionEngine, seconds: float) -> list:
    """Step an engine, with some pieces of work in each cycle; return the heights."""
    heights = []
    for _ in range(round(seconds / DT)):
        heights.append(moving.step(DT).heights)
        left = iter(range(3))
        moving.work(lambda left=left: next(left, None) is not None)
    return heights


def followed(moving: MotionEngine, target: Target, seconds: float) -> FloatArray:
    """Follow a ``target`` that is reported 50 times a second; return the heights."""
    heights = [moving.state.heights]
    for step in range(round(seconds / DT)):
        if step % 20 == 0:
            moving.track(*target(step * DT))
        heights += go(moving, DT)
        assert moving.phase is MotionPhase.TRACKING
    return np.array(heights)


def errors(heights: FloatArray, target: Target) -> FloatArray:
    """Return how far the platform is from a ``target`` in each step. Shape (n,) [m]."""
    wanted = [target(step * DT)[0] for step in range(len(heights))]
    return np.linalg.norm(MACHINE.forward_batch(heights) - wanted, axis=1)


def conveyor(time: float) -> tuple[tuple, tuple]:
    return (-0.08 + 0.1 * time, 0.02, 0.28), (0.1, 0.0, 0.0)


def circle(time: float) -> tuple[tuple, tuple]:
    """Return a target on a circle with a radius of 30 mm, once in two seconds."""
    x, y = 0.03 * math.cos(math.pi * time), 0.03 * math.sin(math.pi * time)
    return (x, y, CENTRE[2]), (-math.pi * y, math.pi * x, 0.0)


def zigzag(time: float) -> tuple[tuple, tuple]:
    """Return a target whose velocity changes twice a second."""
    turn, past = divmod(time, 0.5)
    side = 1.0 if turn % 2 == 0 else -1.0
    return (side * (0.12 * past - 0.03), 0.0, 0.3), (side * 0.12, 0.0, 0.0)


def random_run(
    machine: TriGlide, shaper: Shaper | None, seed: int, in_pieces: bool, steps: int
) -> FloatArray:
    """Follow a target that flies about and jumps, with anything else in between."""
    rng = random.Random(seed)
    moving = shaped(in_pieces, shaper, machine)
    heights = [moving.state.heights]
    where, velocity = np.array(CENTRE), np.zeros(3)
    for step in range(steps):
        if rng.random() < 0.004:
            velocity = np.array([rng.uniform(-0.5, 0.5) for _ in range(3)])
        if rng.random() < 0.002:
            where = np.array([rng.uniform(-0.08, 0.08), rng.uniform(-0.08, 0.08), 0.3])
        where += DT * velocity
        velocity = np.where(np.abs(where - CENTRE) > 0.09, -np.sign(where - CENTRE), 1.0) * abs(
            velocity
        )
        with suppress(KinematicsError):
            if step % 20 == 0:
                moving.track(where.tolist(), velocity.tolist())
            event = rng.random()
            if event < 0.002:
                moving.jog([rng.uniform(-0.4, 0.4) for _ in range(3)])
            elif event < 0.003:
                moving.stop()
            elif event < 0.004:
                moving.move_to([rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 0.28])
            elif event < 0.005:
                moving.set_speed_scale(rng.choice((0.4, 1.0)))
        heights += go(moving, DT)
    return np.array(heights)


@each_mode
@pytest.mark.parametrize("shaper", [SHAPER, TWO_MODES], ids=["one mode", "two modes"])
@pytest.mark.parametrize("machine", [MACHINE, UNEQUAL], ids=["equal", "unequal"])
def test_however_a_target_moves_the_limits_hold(machine, shaper, in_pieces):
    heights = random_run(machine, shaper, 5, in_pieces, many(800))
    assert within(heights)
    assert limit_use(heights).largest[1] > 0.7


def test_they_would_not_without_the_proof(monkeypatch):
    assert within(random_run(UNEQUAL, SHAPER, 13, False, 900))
    monkeypatch.setattr(LimitBounds, "keeps_limits", True)
    assert limit_use(random_run(UNEQUAL, SHAPER, 13, False, 900)).largest[2] > 1.01


@each_mode
@pytest.mark.parametrize("shaper", [SHAPER, TWO_MODES], ids=["one mode", "two modes"])
def test_a_target_on_a_line_is_followed_without_a_lag(shaper, in_pieces):
    moving = shaped(in_pieces, shaper)
    away = errors(followed(moving, conveyor, 1.1), conveyor)
    assert away[800:].max() < 1e-9
    assert moving.tracking_distance == pytest.approx(away[-1], abs=1e-12)


@each_mode
def test_on_a_circle_the_delay_is_led_and_the_error_told(in_pieces):
    moving = shaped(in_pieces)
    heights = followed(moving, circle, 2.0)
    away = errors(heights, circle)
    # The delay is 3 mm of the way; led with a steady velocity, 0.5 mm would be left.
    assert math.hypot(*circle(0.0)[1]) * SHAPER.delay > 2.9e-3
    assert away[800:].max() < 1.5e-4
    # Where the target is now is known from the newest report only.
    assert moving.tracking_distance == pytest.approx(away[-1], abs=5e-6)
    assert within(heights)


@pytest.mark.parametrize(
    ("shaper", "added"),
    [(SHAPER, ()), (None, (PlatformSpeedLimit(MACHINE, 0.4),))],
    ids=["shaper", "speed limit"],
)
def test_what_is_followed_in_long_steps_is_as_calm_as_it_is_itself(shaper, added):
    """Each step was on the target at its end, with 15 to 76 times the jerk of the ideal motion."""
    moving = MotionEngine(
        Workspace(MACHINE, DEFAULT_LIMITS), LIMITS.with_added(*added), in_pieces=True
    )
    moving.start(MACHINE.inverse(CENTRE))
    moving.set_shaper(shaper)
    heights = followed(moving, circle, 3.0)
    ideal = np.array([MACHINE.inverse(circle(step * DT)[0]) for step in range(len(heights))])
    calm = calm_of(heights[1000:], ideal[1000:], 0.02, 0.0)
    assert 0.9 < calm.jerk < 1.4
    assert calm.fast < 3e-3
    assert calm.turns <= 20.0
    assert errors(heights, circle)[1000:].max() < 2.5e-5


def test_a_twist_that_turns_is_led_by_a_long_step_and_the_delay():
    """It lagged by 52 ms."""
    moving, lags = shaped(), []
    for step in range(3000):
        if step % 20 == 0:
            moving.jog(circle(step * DT)[1])
        go(moving, DT)
        (vx, vy, _), (wx, wy, _) = platform_velocity(moving), circle((step + 1) * DT)[1]
        lags.append(math.atan2(vx * wy - vy * wx, vx * wx + vy * wy) / math.pi)
    assert abs(np.mean(lags[1000:])) < 5e-3


def test_a_shaper_takes_most_of_the_swing_out_of_following():
    left = []
    for shaper in (None, SHAPER):
        heights = followed(shaped(shaper=shaper), zigzag, 2.0)
        offsets = swing(MACHINE.forward_batch(heights), DT, MODE)
        # From 0.3 s after each turn on the target moves straight, so the platform should, too.
        calm = np.arange(len(offsets)) % 500 >= 300
        left.append(math.sqrt(float(np.square(offsets[calm]).sum(axis=1).mean())))
    assert left[0] > 1.5e-4
    assert left[1] < 0.1 * left[0]


@each_mode
def test_on_a_target_that_stands_still_the_platform_rests(in_pieces):
    moving = shaped(in_pieces)
    followed(moving, lambda _: (TARGET, AT_REST), 1.0)
    assert place(moving) == pytest.approx(TARGET, abs=1e-9)
    assert np.abs(moving.state.velocities).max() < 1e-12
    assert moving.remaining == math.inf
    moving.stop()
    go(moving, SHAPER.duration + 0.05)
    assert moving.phase is MotionPhase.IDLE


@each_mode
def test_in_mid_motion_a_target_takes_over(in_pieces):
    moving = shaped(in_pieces)
    moving.move_to(TARGET)
    heights = go(moving, 0.12)
    moving.track(OTHER, AT_REST)
    assert moving.phase is MotionPhase.TRACKING
    heights += go(moving, 1.5)
    assert place(moving) == pytest.approx(OTHER, abs=1e-9)
    assert within(np.array(heights))


@each_mode
def test_a_stop_is_idle_when_the_shaper_is_empty(in_pieces):
    moving = shaped(in_pieces)
    heights = followed(moving, conveyor, 1.0).tolist()
    moving.stop()
    assert moving.phase is MotionPhase.STOPPING
    assert math.isnan(moving.tracking_distance)
    steps = 0
    while moving.phase is not MotionPhase.IDLE:
        heights += go(moving, DT)
        steps += 1
    assert SHAPER.duration < steps * DT < SHAPER.duration + 0.08
    still = moving.state.heights
    go(moving, 0.1)
    assert moving.state.heights == still
    assert within(np.array(heights))


@each_mode
def test_a_move_ends_the_following(in_pieces):
    moving = shaped(in_pieces)
    heights = followed(moving, conveyor, 1.0).tolist()
    moving.move_to(TARGET)
    heights += go(moving, 2.0)
    assert moving.phase is MotionPhase.IDLE
    assert place(moving) == pytest.approx(TARGET, abs=1e-9)
    assert within(np.array(heights))


@each_mode
def test_lower_limits_come_in_force_while_a_target_is_followed(in_pieces):
    moving = shaped(in_pieces)
    heights = followed(moving, conveyor, 0.8).tolist()
    # So low that the machine has to slow down first: the platform moves faster than that.
    lower = SliderLimits.uniform(0.02, 5.0, 100.0)
    moving.set_limits(lower)
    slow = []
    for step in range(600):
        if step % 20 == 0:
            moving.track(*conveyor(0.8 + step * DT))
        is_pending = moving.limits_pending
        (slow if not is_pending else heights).extend(go(moving, DT))
    assert moving.limits == lower
    assert moving.phase is MotionPhase.TRACKING
    assert len(slow) > 300
    assert within(np.array(heights))
    assert within(np.array(slow), lower)
    moving.set_limits(LIMITS)
    away = errors(followed(moving, lambda time: (OTHER, AT_REST), 1.5), lambda _: (OTHER, AT_REST))
    assert moving.limits == LIMITS
    assert away[-1] < 1e-9


@each_mode
def test_a_target_that_leaves_the_workspace_is_waited_for(in_pieces):
    moving = shaped(in_pieces)

    def out_and_back(time: float) -> tuple[tuple, tuple]:
        angle = 0.25 * math.pi * time
        return (0.3 * math.sin(angle), 0.0, 0.3), (0.075 * math.pi * math.cos(angle), 0.0, 0.0)

    heights = followed(moving, out_and_back, 2.0)
    assert moving.tracking_distance > 0.05
    assert np.abs(moving.state.velocities).max() < 1e-9
    assert place(moving)[0] > 0.1
    back = followed(moving, lambda time: out_and_back(time + 2.0), 2.0)
    assert moving.tracking_distance < 1e-4
    for some in (heights, back):
        assert within(some)
        for each in some[::10].tolist():
            WORKSPACE.check_heights(each)


@each_mode
def test_a_jog_that_turns_is_tracked_and_becomes_straight(in_pieces):
    moving = shaped(in_pieces)
    moving.jog((0.05, 0.0, 0.0))
    heights = go(moving, 0.2)
    moving.jog((0.0, 0.05, 0.0))
    heights += go(moving, 0.1)
    assert moving.tracks
    number = moving.plan_number
    for turn in range(20):
        moving.jog((0.05 * math.cos(turn), 0.05 * math.sin(turn), 0.01))
        assert moving.phase is MotionPhase.JOGGING
        heights += go(moving, 0.01)
    heights += go(moving, 0.3)
    assert moving.plan_number == number
    wanted = np.array((0.05 * math.cos(19), 0.05 * math.sin(19), 0.01))
    assert platform_velocity(moving) == pytest.approx(wanted, abs=1e-6)
    begin = place(moving)
    heights += go(moving, 0.3)
    way = place(moving) - begin
    assert np.linalg.norm(way) == pytest.approx(0.3 * np.linalg.norm(wanted), rel=1e-4)
    assert np.linalg.norm(np.cross(way, wanted)) / np.linalg.norm(wanted) < 1e-6
    # It comes to rest at the edge.
    moving.jog((0.2, 0.0, 0.05))
    heights += go(moving, 4.0)
    assert moving.phase is MotionPhase.IDLE
    assert not moving.tracks
    assert place(moving)[0] > 0.1
    WORKSPACE.check_heights(moving.state.heights)
    assert within(np.array(heights))


@each_mode
@pytest.mark.parametrize(("step", "seconds"), [(0.0005, 2.0), (0.03, 6.0), (0.1, 12.0)])
def test_it_ends_on_the_target_whatever_the_steps_of_the_engine_are(step, seconds, in_pieces):
    moving = shaped(in_pieces)
    for number in range(round(seconds / step)):
        # For half a second it is outside the workspace.
        x = 0.5 if 0.5 < number * step < 1.0 else 0.05
        moving.track((x, 0.0, 0.3), AT_REST)
        moving.step(step)
        moving.work(lambda: True)
    assert place(moving) == pytest.approx((0.05, 0.0, 0.3), abs=1e-9)


@pytest.mark.parametrize("size", [5e-324, 1e-160, 1e9, 1e77, 1e160, 1e308])
def test_however_large_or_small_numbers_are_the_motion_goes_on_within_limits(size):
    velocity = tuple(size * part for part in (-0.6, 0.7, -0.4))
    moving = shaped()
    for command in (lambda: moving.track(CENTRE, velocity), lambda: moving.jog(velocity)):
        followed(moving, lambda _: (CENTRE, (0.0, 0.0, 0.1)), 0.05)
        with suppress(KinematicsError):
            command()
        heights = go(moving, 0.1)
        assert np.isfinite(heights).all()
        assert within(np.array(heights))
    moving.stop()
    go(moving, 1.0)
    assert moving.phase is MotionPhase.IDLE


def test_a_shaper_that_is_set_while_a_target_is_followed_waits_for_rest():
    moving = shaped(shaper=None)
    followed(moving, conveyor, 0.5)
    moving.set_shaper(SHAPER)
    followed(moving, lambda _: (CENTRE, AT_REST), 0.5)
    assert moving.shaper_pending
    moving.stop()
    go(moving, 0.1)
    followed(moving, lambda _: (CENTRE, AT_REST), 0.1)
    assert moving.shaper is SHAPER
