"""An engine with a shaper: what it drives is proved, straight, and calm when it is idle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    HOME,
    LIMITS,
    MACHINE,
    OTHER,
    SHAPER,
    TARGET,
    RecordedEngine,
    assert_rests_at,
    each_kind,
    engine,
    platform_velocity,
    run,
    run_to_rest,
    under_way,
    within,
)

from tri_glide_kinematics.motion import (
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


def shaped(kind: MotionKind = MotionKind.SLIDER, **options) -> RecordedEngine:
    """Return an engine that rests, with the shaper in force."""
    moving = engine(kind, **options, shaper=SHAPER)
    assert moving.shaper is SHAPER
    return moving


def begun(seconds: float, kind: MotionKind = MotionKind.SLIDER) -> RecordedEngine:
    """Return an engine with the shaper that has been on its way to ``TARGET`` for some time."""
    moving = shaped(kind)
    moving.move_to(TARGET)
    run(moving, seconds)
    return moving


def test_what_is_driven_is_checked_for_the_workspace(monkeypatch):
    def outside(*_):
        raise SliderTravelError(0, 0.91, 0.9)

    monkeypatch.setattr(ShapedTrajectory, "checking_inside", outside)
    moving = shaped()
    with pytest.raises(SliderTravelError):
        moving.move_to(TARGET)
    assert moving.phase is MotionPhase.IDLE


def test_lines_and_their_stops_stay_straight():
    moving = shaped(MotionKind.LINEAR)
    moving.move_to(TARGET)
    run_to_rest(moving)
    moving.move_to(OTHER)
    run(moving, 0.15)
    moving.stop()
    places = MACHINE.forward_batch(run_to_rest(moving))
    along = np.subtract(OTHER, TARGET) / math.dist(TARGET, OTHER)
    assert np.linalg.norm(np.cross(places - np.array(TARGET), along), axis=1).max() < 1e-12


def test_a_slow_line_begins_though_what_is_shaped_exceeds_a_limit_by_a_millionth_all_the_way():
    start = MACHINE.inverse((-0.06, 0.04, 0.28))
    slow = Shaper.of(ShaperKind.THREE_HUMP_EI, Mode(3.0, 0.0))
    moving = engine(MotionKind.LINEAR, heights=start, in_pieces=True, shaper=slow)
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
    expected = len(run_to_rest(plain)) * DT + SHAPER.duration
    assert moving.remaining == pytest.approx(moving.time_to_rest)
    heights = run_to_rest(moving)
    assert expected <= len(heights) * DT + DT
    assert_rests_at(moving, TARGET)
    assert max(map(abs, moving.state.velocities)) < 1e-9
    assert np.abs(np.diff(heights[-3:], axis=0)).max() < 1e-5


@each_kind
def test_a_stop_takes_the_shaper_and_little_more(kind):
    later = []
    for begin in np.arange(0.03, 0.3, 0.03).tolist():
        times = []
        for each in (engine(kind), shaped(kind)):
            each.move_to(TARGET)
            run(each, begin)
            each.stop()
            times.append(len(run_to_rest(each)) * DT)
        later.append((times[1] - times[0] - SHAPER.duration) / times[0])
    assert np.median(later) <= 0.05


def test_a_plan_that_rests_later_than_a_stop_of_full_limits_is_no_stop():
    moving = shaped()
    moving.move_to(TARGET)
    holder = moving._holder
    left, own = math.inf, 0.0
    while left > 1.07 * own:
        moving.step(0.5 * DT)
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
    moving = under_way(TARGET, 0.1)
    moving.set_shaper(SHAPER)
    assert moving.shaper is None
    assert moving.shaper_pending
    run_to_rest(moving)
    assert_rests_at(moving, TARGET)
    assert not moving.shaper_pending
    moving.move_to(OTHER)
    assert moving.shaper is SHAPER
    assert not moving.shaper_pending
    run_to_rest(moving)
    assert moving.kept_limits
    moving.set_shaper(None)
    assert moving.shaper is None


def test_limits_may_change_while_it_is_full():
    moving = begun(0.2)
    lower = SliderLimits.uniform(0.3, 4.0, 80.0)
    moving.set_limits(lower)
    while moving.limits_pending:
        moving.step(DT)
    assert within(run_to_rest(moving), lower)
    assert moving.kept_limits


@each_kind
def test_limits_that_are_lowered_after_a_stop_are_in_force_when_the_shaper_is_empty(kind):
    moving = begun(0.12, kind)
    moving.stop()
    moving.set_speed_scale(0.05)
    assert moving.limits_pending
    rests = moving.time_to_rest
    assert len(run_to_rest(moving)) * DT < rests + 0.01
    assert not moving.limits_pending
    assert moving.speed_scale == 0.05
    assert moving.kept_limits


def test_limits_that_come_behind_a_stop_are_in_force_at_once():
    moving = begun(0.2)
    moving.stop()
    run_to_rest(moving)
    # What is held is the stop; it has ended, and what the sliders did before counts no more.
    moving.set_speed_scale(0.1)
    assert not moving.limits_pending
    assert moving.phase is MotionPhase.IDLE


def test_slow_motion_is_proved_in_few_pieces():
    moving = shaped(in_pieces=True)
    moving.jog((0.001, 0.0, 0.0))
    pieces = 0
    while moving.preparing:
        moving.work(lambda: False)
        pieces += 1
        assert pieces < 300
    run(moving, 0.5)
    assert moving.phase is MotionPhase.JOGGING
    assert moving.kept_limits
    assert platform_velocity(moving)[0] == pytest.approx(0.001, rel=1e-6)


def test_a_new_start_forgets_what_was_driven():
    moving = begun(0.1)
    moving.start(HOME)
    assert moving.shaper is SHAPER
    assert np.abs(run(moving, 0.1) - HOME).max() < 1e-12


@pytest.mark.parametrize(
    ("start", "end"),
    [((0.16, 0.08, 0.4), (-0.01, -0.03, 0.31)), ((0.14, 0.07, 0.33), (-0.1, -0.04, 0.27))],
)
def test_a_plan_from_rest_is_proved_from_its_start_however_long_that_takes(start, end, monkeypatch):
    # Nothing is left to the shaper, so that the first plan exceeds limits.
    monkeypatch.setattr(drive_limits, "LEFT_TO_PLANS", (1.0, 1.0, 1.0))
    moving = engine(heights=MACHINE.inverse(start), in_pieces=True, shaper=SHAPER)
    moving.move_to(end)
    while True:
        moving.work(lambda: False)
        if not moving.preparing:
            break
        moving.step(0.05)
    run_to_rest(moving)
    assert_rests_at(moving, end)


@pytest.mark.parametrize("in_pieces", [False, True])
def test_a_new_target_is_never_refused_for_what_the_shaper_holds_back(in_pieces):
    """Together with it, one plan in 16 exceeded a limit by up to a tenth; a later one does not."""
    rng = np.random.default_rng(4)
    moving = shaped(limits=SliderLimits.uniform(0.5, 6.0, 200.0), in_pieces=in_pieces)
    for _ in range(30):
        target = TARGET + rng.uniform(-0.06, 0.06, 3)
        moving.move_to(target)
        run(moving, rng.uniform(0.05, 0.4))
        assert moving.take_refusal() is None
    run_to_rest(moving)
    assert_rests_at(moving, target)


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
