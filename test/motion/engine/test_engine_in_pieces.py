"""Plans that are made in pieces: what is held goes on meanwhile, and nothing is lost."""

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
    WORKSPACE,
    each_kind,
    engine,
    place,
    within,
)

from testing.pieces import timed
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionPhase, PlatformSpeedLimit
from tri_glide_kinematics.motion.engine import replacing, replanning
from tri_glide_kinematics.motion.errors import PlanTooLongError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.moves import MotionKind

TURN = 2.0 * math.pi


def no_more() -> bool:
    """Let no second piece be done."""
    return False


def go(moving: MotionEngine, steps: int, pieces: int = 1) -> list:
    """Step an engine with some pieces of planning in each cycle; return the setpoints."""
    states = []
    for _ in range(steps):
        states.append(moving.step(DT))
        for _ in range(pieces):
            moving.work(no_more)
    return states


def heights_of(states) -> np.ndarray:
    return np.array([HOME, *(state.heights for state in states)])


@each_kind
@pytest.mark.parametrize("pieces", [1, 3, 100])
def test_a_new_target_in_mid_motion_is_reached_with_no_step(kind, pieces):
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    states = go(moving, 120, pieces)
    number = moving.plan_number
    moving.move_to(OTHER)
    assert moving.target == TARGET
    states += go(moving, 3000, pieces)
    assert moving.plan_number == number + 1
    assert moving.phase is MotionPhase.IDLE
    assert not moving.preparing
    assert np.abs(place(moving) - OTHER).max() < 1e-9
    assert within(heights_of(states))


def test_what_is_made_in_pieces_is_what_is_made_at_once():
    """From rest, where it does not matter when the motion begins."""
    at_once, in_pieces = (engine(MotionKind.SLIDER, in_pieces=each) for each in (False, True))
    for moving in (at_once, in_pieces):
        moving.move_to(TARGET)
    assert in_pieces.phase is MotionPhase.IDLE
    while in_pieces.preparing:
        assert in_pieces.step(DT).heights == HOME
        in_pieces.work(no_more)
    for _ in range(500):
        assert at_once.step(DT) == in_pieces.step(DT)


def test_a_linear_move_begins_quickly_and_goes_on_with_the_plan_that_is_made_at_once():
    at_once, in_pieces = (engine(MotionKind.LINEAR, in_pieces=each) for each in (False, True))
    for moving in (at_once, in_pieces):
        moving.move_to(TARGET)
    shortest = at_once.remaining
    while in_pieces.preparing:
        in_pieces.step(DT)
        in_pieces.work(no_more)
    longest = in_pieces.remaining
    heights = heights_of(go(in_pieces, 1000))
    assert within(heights)
    line = np.subtract(TARGET, MACHINE.forward(HOME))
    beside = np.cross(MACHINE.forward_batch(heights) - TARGET, line) / np.linalg.norm(line)
    assert np.abs(beside).max() < 1e-9
    driven = DT * np.count_nonzero(np.diff(heights, axis=0).any(axis=1))
    assert shortest < driven < longest


def test_a_sooner_plan_that_takes_too_many_pieces_is_tried_once(monkeypatch):
    tried = []
    made = replanning.Replanning.sooner

    def counted(*arguments):
        tried.append(arguments)
        return made(*arguments)

    monkeypatch.setattr(replanning.Replanning, "sooner", counted)
    monkeypatch.setattr(replacing, "MOST_PIECES", 40)
    moving = engine(MotionKind.LINEAR)
    moving.move_to(TARGET)
    for _ in range(1000):
        moving.step(DT)
    assert place(moving) == pytest.approx(TARGET, abs=1e-9)
    assert len(tried) == 1


@each_kind
def test_a_plan_that_is_late_begins_later(kind):
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    states = go(moving, 120, pieces=100)
    moving.move_to(OTHER)
    # Nothing is done for longer than any plan took before.
    states += [moving.step(DT) for _ in range(30)]
    assert moving.preparing
    states += go(moving, 3000)
    assert np.abs(place(moving) - OTHER).max() < 1e-9
    assert within(heights_of(states))


def test_the_next_plan_begins_so_far_ahead_as_the_last_ones_took():
    moving = engine(MotionKind.LINEAR, in_pieces=True)
    moving.move_to(TARGET)
    go(moving, 100)
    waits = []
    for turn in range(8):
        number = moving.plan_number
        moving.move_to((0.05, 0.05 * math.cos(turn), 0.3))
        waits.append(0)
        while moving.preparing and waits[-1] < 1000:
            go(moving, 1)
            waits[-1] += 1
        assert moving.plan_number == number + 1
        go(moving, 20)
    # The first one is begun again and again, each time with twice the time; the others once.
    assert max(waits[1:]) < 0.8 * waits[0]


@each_kind
def test_a_refusal_comes_when_it_is_known_and_what_went_on_goes_on(kind):
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    go(moving, 100, pieces=100)
    with pytest.raises(KinematicsError):
        moving.move_to((0.5, 0.0, 0.3))
    go(moving, 3000)
    assert moving.take_refusal() is None
    assert np.abs(place(moving) - TARGET).max() < 1e-9
    # At the edge, where a jog outwards has no room; that is found while it is planned.
    moving.jog((0.2, 0.0, 0.0))
    go(moving, 4000)
    assert moving.phase is MotionPhase.IDLE
    resting = moving.state
    try:
        moving.jog((0.2, 0.0, 0.0))
    except KinematicsError:
        refusal = None
    else:
        go(moving, 50)
        refusal = moving.take_refusal()
        assert isinstance(refusal, KinematicsError)
        assert moving.take_refusal() is None
    assert moving.state == resting


@each_kind
def test_a_stop_is_told_at_once_and_brakes_within_milliseconds(kind):
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    states = go(moving, 70, pieces=100)
    longest = moving.remaining
    moving.stop()
    assert moving.phase is MotionPhase.STOPPING
    assert moving.target is None
    states += go(moving, 5, pieces=100)
    assert not moving.preparing
    assert moving.remaining < longest - 5 * DT
    states += go(moving, 1000)
    assert moving.phase is MotionPhase.IDLE
    assert within(heights_of(states))


@each_kind
def test_a_stop_drops_a_target_that_is_being_planned(kind):
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    go(moving, 120, pieces=100)
    moving.move_to(OTHER)
    assert moving.preparing
    moving.stop()
    go(moving, 2000)
    assert moving.phase is MotionPhase.IDLE
    assert np.abs(place(moving) - OTHER).max() > 0.01


@each_kind
def test_the_present_target_again_gives_up_another_one(kind):
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    go(moving, 120, pieces=100)
    number = moving.plan_number
    moving.move_to(OTHER)
    moving.move_to(TARGET)
    assert not moving.preparing
    go(moving, 2000)
    assert moving.plan_number == number
    assert np.abs(place(moving) - TARGET).max() < 1e-9


@each_kind
def test_limits_that_come_while_a_target_is_planned_lose_neither(kind):
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    states = go(moving, 120, pieces=100)
    moving.move_to(OTHER)
    lower = SliderLimits.uniform(0.2, 5.0, 100.0)
    moving.set_limits(lower)
    states += go(moving, 6000)
    assert moving.limits == lower
    assert np.abs(place(moving) - OTHER).max() < 1e-9
    assert within(heights_of(states))


def test_limits_at_rest_are_in_force_at_once():
    moving = engine(in_pieces=True)
    lower = SliderLimits.uniform(0.2, 5.0, 100.0)
    moving.set_limits(lower)
    assert moving.limits == lower
    assert moving.phase is MotionPhase.IDLE


def test_steps_of_another_length_make_no_step():
    """A plan then begins between two setpoints."""
    moving = engine(MotionKind.LINEAR, in_pieces=True)
    moving.move_to(TARGET)
    rng = np.random.default_rng(4)
    last, largest = moving.state, 0.0
    for index in range(3000):
        dt = float(rng.uniform(2e-4, 2e-3))
        state = moving.step(dt)
        moving.work(no_more)
        change = np.subtract(state.accelerations, last.accelerations) / dt
        largest = max(largest, float(np.abs(change).max()))
        last = state
        if index in (150, 220, 300):
            angle = TURN * index / 7.0
            moving.move_to((0.05 * math.cos(angle), 0.05 * math.sin(angle), 0.28))
    assert largest <= 200.0 * (1.0 + 1e-6)
    assert moving.phase is MotionPhase.IDLE


def test_each_start_forgets_what_was_being_planned():
    moving = engine(in_pieces=True)
    moving.move_to(TARGET)
    assert moving.preparing
    moving.start(HOME)
    assert not moving.preparing
    assert {state.heights for state in go(moving, 50)} == {HOME}
    assert moving.limits is LIMITS
    WORKSPACE.check_heights(moving.state.heights)


@each_kind
def test_a_stop_brakes_at_once_however_long_other_plans_took(kind):
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    go(moving, 40, pieces=100)
    # A plan for which there was no time.
    moving.move_to(OTHER)
    for _ in range(30):
        moving.step(DT)
    go(moving, 200)
    moving.move_to(TARGET)
    go(moving, 60, pieces=100)
    moving.stop()
    assert not moving.preparing
    assert moving.phase is MotionPhase.STOPPING
    go(moving, 1000)
    assert moving.phase is MotionPhase.IDLE


@each_kind
def test_limits_that_come_while_a_target_is_planned_from_rest_lose_neither(kind):
    moving = engine(kind, in_pieces=True)
    lower = SliderLimits.uniform(0.2, 5.0, 100.0)
    moving.move_to(TARGET)
    moving.set_limits(lower)
    go(moving, 6000)
    assert moving.limits == lower
    assert np.abs(place(moving) - TARGET).max() < 1e-9
    assert moving.phase is MotionPhase.IDLE


def test_a_tracked_jog_a_target_and_limits_lose_none():
    lower = SliderLimits.uniform(0.2, 5.0, 100.0)
    moving = engine(in_pieces=True)
    moving.jog((0.05, 0.0, 0.0))
    go(moving, 150)
    moving.jog((0.0, 0.05, 0.0))
    go(moving, 50)
    assert moving.tracks
    moving.move_to(TARGET)
    moving.set_limits(lower)
    go(moving, 6000)
    assert moving.limits == lower
    assert np.abs(place(moving) - TARGET).max() < 1e-9


@each_kind
def test_limits_that_come_while_a_moving_target_is_begun_with_are_not_lost(kind):
    lower = SliderLimits.uniform(0.1, 5.0, 100.0)
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    go(moving, 120, pieces=100)
    moving.track((0.0, 0.0, 0.3), (0.0, 0.0, 0.0))
    moving.set_limits(lower)
    go(moving, 2500)
    assert moving.limits == lower
    assert np.abs(place(moving) - (0.0, 0.0, 0.3)).max() < 1e-9


def test_the_newest_of_a_target_that_moves_and_one_that_does_not_wins():
    moving = engine(in_pieces=True)
    moving.track((0.0, 0.0, 0.3), (0.0, 0.0, 0.0))
    go(moving, 500)
    moving.move_to(TARGET)
    moving.track((0.01, 0.0, 0.3), (0.0, 0.0, 0.0))
    go(moving, 1000)
    assert moving.phase is MotionPhase.TRACKING
    assert np.abs(place(moving) - (0.01, 0.0, 0.3)).max() < 1e-9


@pytest.mark.parametrize("error", [ZeroDivisionError, OSError])
def test_an_error_in_planning_ends_that_plan_only(monkeypatch, error):
    moving = engine(in_pieces=True)

    def broken(*_arguments, **_options):
        raise error("on purpose")

    with monkeypatch.context() as patch:
        patch.setattr(type(WORKSPACE), "path_check", broken)
        moving.move_to(TARGET)
        if error is ZeroDivisionError:
            # Numbers may be absurd; that refuses the target, and ends nothing else.
            go(moving, 50)
            assert "lead nowhere: on purpose" in str(moving.take_refusal())
        else:
            with pytest.raises(error):
                go(moving, 50)
    assert not moving.preparing
    moving.move_to(TARGET)
    go(moving, 3000)
    assert np.abs(place(moving) - TARGET).max() < 1e-9


class CountedSpeed(PlatformSpeedLimit):
    """A speed limit that counts the cells it looks at."""

    cells = 0

    def used(self, position, half):
        type(self).cells += len(half)
        return super().used(position, half)


def cells_of_pieces(moving: MotionEngine) -> list[int]:
    """Return how many cells are looked at in each piece of what is being prepared."""
    pieces = []
    while moving.preparing:
        before = CountedSpeed.cells
        moving.work(no_more)
        pieces.append(CountedSpeed.cells - before)
    return pieces


@each_kind
def test_no_piece_looks_at_many_cells_however_slow_the_platform_has_to_be(kind):
    work = []
    for speed in (0.1, 1e-3, 1e-5):
        limits = LIMITS.with_added(CountedSpeed(MACHINE, speed))
        moving = engine(kind, in_pieces=True, limits=limits)
        moving.move_to(TARGET)
        pieces = cells_of_pieces(moving)
        go(moving, 100)
        moving.move_to(OTHER)
        pieces += cells_of_pieces(moving)
        assert moving.take_refusal() is None
        go(moving, 100)
        moving.jog((0.0, 0.05, 0.0))
        pieces += cells_of_pieces(moving)
        assert max(pieces) <= 64
        work.append(sum(pieces))
    # They are no more where the motion takes a hundred times as long, and so again.
    assert max(work) < 6.0 * work[0]


def test_a_plan_that_takes_too_many_pieces_is_refused_with_what_makes_it_long(monkeypatch):
    limits = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.01))
    moving = engine(in_pieces=True, limits=limits)
    moving.set_shaper(SHAPER)
    monkeypatch.setattr(replacing, "MOST_PIECES", 6)
    moving.move_to(TARGET)
    pieces = 1
    while moving.preparing:
        moving.work(no_more)
        pieces += 1
    refusal = moving.take_refusal()
    assert isinstance(refusal, PlanTooLongError)
    assert refusal.pieces == 6
    assert pieces <= 8
    assert "more than 6 pieces of work; it is long with a shaper and a platform" in str(refusal)
    # It begins anew with the next one.
    monkeypatch.undo()
    moving.move_to(TARGET)
    go(moving, 30, pieces=100)
    assert moving.phase is MotionPhase.MOVING


def test_what_goes_on_for_ever_is_given_up_after_so_much_work():
    """Each way that is tried after that has one piece, so what would do without is found."""
    tried = []

    def making(held, start):
        for way in range(3):
            try:
                while True:
                    tried.append(way)
                    yield
            except PlanTooLongError:
                pass
        return replanning.Replanned(held)

    held = engine(in_pieces=True)._holder.held
    times: list[float] = []
    made = replacing.Preparation(
        lambda *each: timed(making(*each), times), None, held, 0.0, 0.0, replacing.LeadTime()
    )
    made.work(lambda: True)
    assert made.ready == replanning.Replanned(held)
    assert tried == [0] * replacing.MOST_PIECES + [1, 2]
    # It is so, too, where somebody looks at how long the pieces take.
    assert len(times) == len(tried) + 1
