"""An engine with a shaper: what it drives is proved, straight, and calm when it is idle."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from motion_machine import (
    DT,
    HOME,
    KINDS,
    LIMITS,
    MACHINE,
    OTHER,
    SHAPER,
    TARGET,
    assert_keeps,
    driven,
    each_kind,
    engine,
    run,
)

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    CommandStream,
    LimitUse,
    MotionEngine,
    MotionKind,
    MotionPhase,
    SliderLimits,
    SliderState,
    SliderTravelError,
)
from tri_glide_kinematics.motion.engine import drive_limits
from tri_glide_kinematics.motion.moves import own_stop
from tri_glide_kinematics.motion.shaped import Planned, ShapedTrajectory
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind

SHAPERS = (None, SHAPER, Shaper.of(ShaperKind.ZVD, Mode(30.0, 0.05)))


def shaped(kind: MotionKind = MotionKind.SLIDER, **options) -> MotionEngine:
    """Return an engine that rests, with the shaper in force."""
    moving = engine(kind, **options)
    moving.set_shaper(SHAPER)
    assert moving.shaper is SHAPER
    return moving


@each_kind
@pytest.mark.parametrize("in_pieces", [False, True])
def test_whatever_is_commanded_the_limits_hold(kind, in_pieces):
    rng = random.Random(5)
    moving = shaped(kind, in_pieces=in_pieces)
    heights, plans = [], moving.plan_number
    for _ in range(2000):
        try:
            event = rng.random()
            if event < 0.004:
                moving.move_to([rng.uniform(*pair) for pair in ((-0.1, 0.1),) * 2 + ((0.2, 0.36),)])
            elif event < 0.008:
                moving.jog([rng.uniform(-0.4, 0.4) for _ in range(3)])
            elif event < 0.010:
                moving.stop()
            elif event < 0.011:
                moving.set_speed_scale(rng.choice((0.2, 0.6, 1.0)))
            elif event < 0.012:
                moving.set_shaper(rng.choice(SHAPERS))
        except KinematicsError:
            pass
        heights.append(moving.step(DT).heights)
        if in_pieces:
            left = iter(range(20))
            moving.work(lambda left=left: next(left, None) is not None)
    assert_keeps(heights)
    assert moving.plan_number - plans > 8


def test_what_is_driven_is_checked_for_the_workspace(monkeypatch):
    def outside(*_):
        raise SliderTravelError(0, 0.91, 0.9)

    monkeypatch.setattr(ShapedTrajectory, "checks_inside", outside)
    moving = shaped()
    with pytest.raises(SliderTravelError):
        moving.move_to(TARGET)
    assert moving.phase is MotionPhase.IDLE


def test_lines_and_their_stops_stay_straight():
    moving = shaped(MotionKind.LINEAR)
    moving.move_to(TARGET)
    driven(moving)
    moving.move_to(OTHER)
    for _ in range(150):
        moving.step(DT)
    moving.stop()
    heights = driven(moving)
    along = np.subtract(OTHER, TARGET) / math.dist(TARGET, OTHER)
    places = MACHINE.forward_batch(heights)
    assert np.linalg.norm(np.cross(places - np.array(TARGET), along), axis=1).max() < 1e-12


def test_a_slow_line_begins_though_what_is_shaped_exceeds_a_limit_by_a_millionth_all_the_way():
    start = MACHINE.inverse((-0.06, 0.04, 0.28))
    moving = engine(MotionKind.LINEAR, heights=start, in_pieces=True)
    moving.set_shaper(Shaper.of(ShaperKind.THREE_HUMP_EI, Mode(3.0, 0.0)))
    moving.set_speed_scale(0.01)
    moving.move_to((0.06, -0.04, 0.3))
    pieces = 0
    while moving.preparing_goal:
        moving.work(lambda: False)
        moving.step(DT)
        pieces += 1
    assert moving.take_refusal() is None
    assert moving.phase is MotionPhase.MOVING
    assert pieces < 400


@each_kind
def test_it_is_idle_only_when_the_shaper_is_empty(kind):
    plain, moving = engine(kind), shaped(kind)
    for each in (plain, moving):
        each.move_to(TARGET)
    expected = len(driven(plain)) * DT + SHAPER.duration
    assert moving.remaining == pytest.approx(moving.time_to_rest)
    heights = driven(moving)
    assert expected <= len(heights) * DT + DT
    assert MACHINE.forward(moving.state.heights) == pytest.approx(TARGET, abs=1e-9)
    assert max(map(abs, moving.state.velocities)) < 1e-9
    assert np.abs(np.diff(heights[-3:], axis=0)).max() < 1e-5


def test_the_plan_that_is_shown_is_what_is_driven():
    moving = shaped()
    moving.move_to(TARGET)
    for _ in range(50):
        moving.step(DT)
    times = DT * np.arange(1, 300)
    shown = moving.sample_plan(times).heights
    heights = [moving.step(DT).heights for _ in times]
    np.testing.assert_allclose(heights, shown, rtol=0.0, atol=1e-10)


@each_kind
def test_a_stop_takes_the_shaper_and_little_more(kind):
    later = []
    for steps in range(30, 300, 30):
        times = []
        for each in (engine(kind), shaped(kind)):
            each.move_to(TARGET)
            for _ in range(steps):
                each.step(DT)
            each.stop()
            times.append(len(driven(each)) * DT)
        later.append((times[1] - times[0] - SHAPER.duration) / times[0])
    assert np.median(later) <= 0.05


def test_a_plan_that_rests_later_than_a_stop_of_full_limits_is_no_stop():
    moving = shaped()
    moving.move_to(TARGET)
    holder = moving._holder
    left, own = math.inf, 0.0
    while left > 1.07 * own:
        moving.step(DT)
        left = holder.held.plan.duration - holder.time
        own = own_stop(holder.held.plan.at(holder.time), LIMITS).duration
    assert left > 1.06 * own
    moving.stop()
    assert moving.time_to_rest - SHAPER.duration <= 1.05 * own


def test_a_stop_on_a_line_is_as_hard_as_without_a_shaper():
    times = []
    for each in (engine(MotionKind.LINEAR), shaped(MotionKind.LINEAR)):
        each.jog((0.2, 0.0, 0.05))
        run(each, 0.3)
        each.stop()
        times.append(each.time_to_rest)
    assert times[1] - SHAPER.duration == pytest.approx(times[0], rel=5e-3)


@pytest.mark.parametrize(
    ("velocity", "acceleration"), [(0.9, 0.0), (0.7, 6.0), (-0.7, -6.0), (0.1, -9.5)]
)
def test_a_motion_is_never_planned_for_less_than_it_has(velocity, acceleration):
    state = SliderState(HOME, (velocity, 0.0, 0.0), (acceleration, 0.0, 0.0))
    limits = drive_limits.DriveLimits(LIMITS, 1.0, shaper=SHAPER)
    less = Planned(LIMITS.times(0.6, 0.5, 0.8))
    assert not drive_limits.stays_within(state, limits.leaving(less).effective)
    leaving = limits.leaving(less, state).effective
    assert drive_limits.stays_within(state, leaving)
    assert (leaving.table <= LIMITS.table).all()
    assert leaving.jerk == less.limits.jerk
    assert leaving.velocity[1:] == less.limits.velocity[1:]


def test_a_change_of_shaper_waits_for_rest():
    moving = engine()
    moving.move_to(TARGET)
    for _ in range(100):
        moving.step(DT)
    moving.set_shaper(SHAPER)
    assert moving.shaper is None
    assert moving.shaper_pending
    driven(moving)
    assert MACHINE.forward(moving.state.heights) == pytest.approx(TARGET, abs=1e-9)
    assert not moving.shaper_pending
    moving.move_to(OTHER)
    assert moving.shaper is SHAPER
    assert not moving.shaper_pending
    assert_keeps(driven(moving))
    moving.set_shaper(None)
    assert moving.shaper is None


def test_limits_may_change_while_it_is_full():
    moving = shaped()
    moving.move_to(TARGET)
    heights = [moving.step(DT).heights for _ in range(200)]
    lower = SliderLimits.uniform(0.3, 4.0, 80.0)
    moving.set_limits(lower)
    while moving.limits_pending:
        heights.append(moving.step(DT).heights)
    assert_keeps(heights)
    assert_keeps(driven(moving), lower)


@each_kind
def test_limits_that_are_lowered_after_a_stop_are_in_force_when_the_shaper_is_empty(kind):
    moving = shaped(kind)
    moving.move_to(TARGET)
    heights = [moving.state.heights]
    heights += [moving.step(DT).heights for _ in range(120)]
    moving.stop()
    moving.set_speed_scale(0.05)
    assert moving.limits_pending
    rests = moving.time_to_rest
    rest = driven(moving)
    assert len(rest) * DT < rests + 0.01
    assert not moving.limits_pending
    assert moving.speed_scale == 0.05
    assert_keeps([*heights, *rest[1:]])


def test_limits_that_come_behind_a_stop_are_in_force_at_once():
    moving = shaped()
    moving.move_to(TARGET)
    for _ in range(200):
        moving.step(DT)
    moving.stop()
    driven(moving)
    # What is held is the stop; it has ended, and what the sliders did before counts no more.
    moving.set_speed_scale(0.1)
    assert not moving.limits_pending
    assert moving.phase is MotionPhase.IDLE


def test_slow_motion_is_proved_in_few_pieces():
    moving = shaped(in_pieces=True)
    moving.jog((0.001, 0.0, 0.0))
    pieces = 0
    while moving.preparing:
        left = iter(range(0))
        moving.work(lambda left=left: next(left, None) is not None)
        pieces += 1
        assert pieces < 300
    heights = run(moving, 0.5)
    assert moving.phase is MotionPhase.JOGGING
    assert_keeps(heights)
    places = MACHINE.forward_batch(heights)
    assert np.diff(places[-2:, 0])[0] / DT == pytest.approx(0.001, rel=1e-6)


def test_a_new_start_forgets_what_was_driven():
    moving = shaped()
    moving.move_to(TARGET)
    for _ in range(100):
        moving.step(DT)
    moving.start(HOME)
    assert moving.state.heights == pytest.approx(HOME, abs=1e-12)
    assert moving.shaper is SHAPER
    for _ in range(100):
        assert moving.step(DT).heights == pytest.approx(HOME, abs=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_jog_in_another_direction_is_calm(kind):
    moving = shaped(kind)
    heights = [moving.state.heights]
    for velocity in ((0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (-0.1, 0.0, 0.1)):
        moving.jog(velocity)
        heights += [moving.step(DT).heights for _ in range(250)]
        assert moving.phase is MotionPhase.JOGGING
    moving.stop()
    assert_keeps([*heights, *driven(moving)[1:]])


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ((0.16, 0.08, 0.4), (-0.01, -0.03, 0.31)),
        ((0.14, 0.07, 0.33), (-0.1, -0.04, 0.27)),
    ],
)
def test_a_plan_from_rest_is_proved_from_its_start_however_long_that_takes(start, end, monkeypatch):
    # Nothing is left to the shaper, so that the first plan exceeds limits.
    monkeypatch.setattr(drive_limits, "LEFT_TO_PLANS", (1.0, 1.0, 1.0))
    moving = engine(heights=MACHINE.inverse(start), in_pieces=True)
    moving.set_shaper(SHAPER)
    moving.move_to(end)
    while True:
        moving.work(lambda: False)
        if not moving.preparing:
            break
        moving.step(0.05)
    heights = [moving.state.heights]
    while moving.phase is not MotionPhase.IDLE:
        heights.append(moving.step(DT).heights)
    assert MACHINE.forward(heights[-1]) == pytest.approx(end, abs=1e-9)
    assert LimitUse.of(CommandStream.from_heights(heights, DT), LIMITS).is_within


def test_new_limits_at_rest_are_in_force_at_once():
    moving = engine(in_pieces=True)
    moving.set_shaper(SHAPER)
    moving.set_limits(SliderLimits.uniform(0.3, 4.0, 80.0))
    assert moving.phase is MotionPhase.IDLE
    assert not moving.limits_pending


def test_a_slow_motion_as_fast_as_allowed_is_stopped_at_once():
    limits = SliderLimits.uniform(0.02, 0.06, 20.0)
    begin, target = (0.0484, 0.0507, 0.2744), (-0.0793, 0.0934, 0.2513)
    moving = engine(MotionKind.LINEAR, limits, heights=MACHINE.inverse(begin))
    shaper = Shaper.of(ShaperKind.ZVD, Mode(5.41, 0.03))
    moving.set_shaper(shaper)
    moving.set_speed_scale(0.01)
    moving.move_to(target)
    moving.step(0.4 * moving.remaining)
    moving.stop()
    assert moving.remaining < shaper.duration + 0.02
