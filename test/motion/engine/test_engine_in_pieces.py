"""Plans that are made in pieces: what is held goes on meanwhile, and nothing is lost."""

from __future__ import annotations

import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    FINE,
    HOME,
    LIMITS,
    MACHINE,
    OTHER,
    SHAPER,
    START,
    TARGET,
    WORKSPACE,
    RecordedEngine,
    assert_rests_at,
    each_kind,
    engine,
    more,
    place,
    run,
    run_to_rest,
    under_way,
)

from benchmarks.judge import UNEQUAL, UNEQUAL_LIMITS, WIDE
from testing.pieces import timed
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionPhase, PlatformSpeedLimit, time_path
from tri_glide_kinematics.motion.engine import replacing, replanning
from tri_glide_kinematics.motion.errors import PlanTooLongError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.moves import MotionKind
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.workspace import Workspace

TURN = 2.0 * math.pi
LOWER = SliderLimits.uniform(0.2, 5.0, 100.0)
NO_MORE = more(0)


def on_the_way(kind: MotionKind, seconds: float = 0.12) -> RecordedEngine:
    """Return an engine in mid-motion to ``TARGET``."""
    return under_way(TARGET, seconds, kind, in_pieces=True, pieces=100)


@each_kind
@pytest.mark.parametrize("pieces", [1, 3, 100])
def test_a_new_target_in_mid_motion_is_reached_with_no_step(kind, pieces):
    moving = under_way(TARGET, 0.12, kind, in_pieces=True, pieces=pieces)
    number = moving.plan_number
    moving.move_to(OTHER)
    assert moving.target == TARGET
    run_to_rest(moving, 3.0, pieces)
    assert moving.plan_number == number + 1
    assert_rests_at(moving, OTHER)


def test_what_is_made_in_pieces_is_what_is_made_at_once():
    """From rest, where it does not matter when the motion begins."""
    at_once, in_pieces = (engine(MotionKind.SLIDER, in_pieces=each) for each in (False, True))
    for moving in (at_once, in_pieces):
        moving.move_to(TARGET)
    assert in_pieces.phase is MotionPhase.IDLE
    while in_pieces.preparing:
        assert in_pieces.step(DT).heights == HOME
        in_pieces.work(NO_MORE)
    for _ in range(250):
        assert at_once.step(DT) == in_pieces.step(DT)


def test_a_linear_move_begins_quickly_and_goes_on_with_the_plan_that_is_made_at_once():
    at_once, in_pieces = (
        engine(MotionKind.LINEAR, in_pieces=each, period=FINE) for each in (False, True)
    )
    for moving in (at_once, in_pieces):
        moving.move_to(TARGET)
    shortest = at_once.remaining
    while in_pieces.preparing:
        run(in_pieces, FINE, pieces=1)
    longest = in_pieces.remaining
    heights = run(in_pieces, 1.0, pieces=2)
    assert_rests_at(in_pieces, TARGET)
    line = np.subtract(TARGET, START)
    beside = np.cross(MACHINE.forward_batch(heights) - TARGET, line) / np.linalg.norm(line)
    assert np.abs(beside).max() < 1e-9
    driven = FINE * np.count_nonzero(np.diff(heights, axis=0).any(axis=1))
    assert shortest < driven < longest


OF_UNEQUAL_LIMITS = TriGlide(UNEQUAL), UNEQUAL_LIMITS


@pytest.mark.parametrize(
    ("machine", "limits", "start", "end"),
    [
        (MACHINE, LIMITS, (-0.091, 0.025, 0.297), (-0.051, 0.005, 0.27)),
        (*OF_UNEQUAL_LIMITS, (-0.201, -0.029, 0.436), (-0.021, 0.037, 0.249)),
        (*OF_UNEQUAL_LIMITS, (0.207, 0.046, 0.317), (-0.017, 0.091, 0.111)),
        (*OF_UNEQUAL_LIMITS, (0.011, -0.06, 0.298), (-0.075, -0.004, 0.314)),
        (*OF_UNEQUAL_LIMITS, (-0.126, -0.16, 0.456), (0.002, 0.107, 0.201)),
    ],
)
def test_a_linear_move_takes_hardly_longer_than_its_line_as_a_path(machine, limits, start, end):
    workspace = Workspace(machine, WIDE)
    shortest = time_path(PlatformPath.start(start).line_to(end), workspace, limits).duration
    moving = RecordedEngine(workspace, limits, kind=MotionKind.LINEAR, in_pieces=True)
    moving.period = FINE
    moving.start(machine.inverse(start))
    moving.move_to(end)
    heights = run(moving, 1.0, pieces=3)
    assert machine.forward(heights[-1]) == pytest.approx(end, abs=1e-9)
    driven = FINE * np.count_nonzero(np.diff(heights, axis=0).any(axis=1))
    assert driven < 1.05 * shortest


def test_a_sooner_plan_that_takes_too_many_pieces_is_tried_once(monkeypatch):
    tried = []
    made = replanning.Replanning.sooner

    def counted(*arguments):
        tried.append(arguments)
        return made(*arguments)

    monkeypatch.setattr(replanning.Replanning, "sooner", counted)
    monkeypatch.setattr(replacing, "MOST_PIECES", 40)
    moving = under_way(TARGET, 1.0, MotionKind.LINEAR, pieces=0)
    assert place(moving) == pytest.approx(TARGET, abs=1e-9)
    assert len(tried) == 1


@each_kind
def test_a_plan_that_is_late_begins_later(kind):
    moving = on_the_way(kind)
    moving.move_to(OTHER)
    # Nothing is done for longer than any plan took before.
    run(moving, 0.03, pieces=0)
    assert moving.preparing
    run_to_rest(moving, 3.0, pieces=1)
    assert_rests_at(moving, OTHER)


def test_the_lead_time_is_that_of_the_longest_or_of_the_median():
    longest, median = replacing.LeadTime(), replacing.LeadTime(0.028, share=0.5)
    assert longest.after(DT) == 0.0
    assert median.after(0.0) == replacing.MARGIN * 0.028
    for taken in (0.03, 0.02, 0.5, 0.026):
        longest.note(taken)
        median.note(taken)
    assert longest.after(0.0) == replacing.MARGIN * 0.5
    assert median.after(0.0) == replacing.MARGIN * 0.028
    # What was expected at first is forgotten, as all times are.
    for _ in range(replacing.REMEMBERED):
        longest.note(0.02)
        median.note(0.02)
    assert longest.after(0.0) == median.after(0.0) == replacing.MARGIN * 0.02


def test_the_next_plan_begins_so_far_ahead_as_the_last_ones_took():
    moving = under_way(TARGET, 0.1, MotionKind.LINEAR, in_pieces=True, period=FINE, pieces=1)
    waits = []
    for turn in range(8):
        number = moving.plan_number
        moving.move_to((0.05, 0.05 * math.cos(turn), 0.3))
        waits.append(0)
        while moving.preparing and waits[-1] < 1000:
            run(moving, FINE, pieces=1)
            waits[-1] += 1
        assert moving.plan_number == number + 1
        run(moving, 0.02, pieces=1)
    # The first one is begun again and again, each time with twice the time; the others once.
    assert max(waits[1:]) < 0.8 * waits[0]


@each_kind
def test_a_refusal_comes_when_it_is_known_and_what_went_on_goes_on(kind):
    moving = on_the_way(kind)
    with pytest.raises(KinematicsError):
        moving.move_to((0.5, 0.0, 0.3))
    run_to_rest(moving, pieces=1)
    assert moving.take_refusal() is None
    assert_rests_at(moving, TARGET)
    # At the edge, where a jog outwards has no room; that is found while it is planned.
    moving.jog((0.2, 0.0, 0.0))
    run_to_rest(moving, pieces=1)
    resting = moving.state
    try:
        moving.jog((0.2, 0.0, 0.0))
    except KinematicsError:
        refusal = None
    else:
        run(moving, 0.05, pieces=1)
        refusal = moving.take_refusal()
        assert isinstance(refusal, KinematicsError)
        assert moving.take_refusal() is None
    assert moving.state == resting


@each_kind
def test_a_stop_is_told_at_once_and_brakes_within_milliseconds(kind):
    moving = on_the_way(kind, 0.07)
    longest = moving.remaining
    moving.stop()
    assert moving.phase is MotionPhase.STOPPING
    assert moving.target is None
    run(moving, 5 * DT, pieces=100)
    assert not moving.preparing
    assert moving.remaining < longest - 5 * DT
    run_to_rest(moving, 1.0)
    assert_rests_at(moving, place(moving))


@each_kind
def test_a_stop_drops_a_target_that_is_being_planned(kind):
    moving = on_the_way(kind)
    moving.move_to(OTHER)
    assert moving.preparing
    moving.stop()
    run_to_rest(moving, 2.0, pieces=1)
    assert moving.phase is MotionPhase.IDLE
    assert np.abs(place(moving) - OTHER).max() > 0.01


@each_kind
def test_the_present_target_again_gives_up_another_one(kind):
    moving = on_the_way(kind)
    number = moving.plan_number
    moving.move_to(OTHER)
    moving.move_to(TARGET)
    assert not moving.preparing
    run_to_rest(moving, 2.0, pieces=1)
    assert moving.plan_number == number
    assert_rests_at(moving, TARGET)


def at_rest(kind: MotionKind) -> RecordedEngine:
    return engine(kind, in_pieces=True)


def jogging(kind: MotionKind) -> RecordedEngine:
    """Return an engine that tracks a jog."""
    moving = engine(kind, in_pieces=True)
    for velocity in ((0.05, 0.0, 0.0), (0.0, 0.05, 0.0)):
        moving.jog(velocity)
        run(moving, 0.15, pieces=1)
    assert moving.tracks
    return moving


@each_kind
@pytest.mark.parametrize(
    ("begin", "tracks"),
    [(at_rest, False), (on_the_way, False), (on_the_way, True), (jogging, False)],
)
def test_limits_that_come_while_a_target_is_planned_or_begun_with_lose_neither(kind, begin, tracks):
    moving = begin(kind)
    if tracks:
        moving.track(OTHER, (0.0, 0.0, 0.0))
    else:
        moving.move_to(OTHER)
    moving.set_limits(LOWER)
    run(moving, 3.0, pieces=1)
    assert moving.limits == LOWER
    assert place(moving) == pytest.approx(OTHER, abs=1e-9)
    assert moving.kept_limits


@pytest.mark.parametrize("shaper", [None, SHAPER])
def test_limits_at_rest_are_in_force_at_once(shaper):
    moving = engine(in_pieces=True, shaper=shaper)
    moving.set_limits(LOWER)
    assert moving.limits == LOWER
    assert not moving.limits_pending
    assert moving.phase is MotionPhase.IDLE


def test_steps_of_another_length_make_no_step():
    """A plan then begins between two setpoints."""
    moving = engine(MotionKind.LINEAR, in_pieces=True)
    moving.move_to(TARGET)
    rng = np.random.default_rng(4)
    for index in range(1500):
        moving.step(float(rng.uniform(2e-4, 4e-3)))
        moving.work(NO_MORE)
        if index in (80, 115, 155):
            angle = TURN * index / 7.0
            moving.move_to((0.05 * math.cos(angle), 0.05 * math.sin(angle), 0.28))
    accelerations = np.array([state.accelerations for state in moving.states])
    jerks = np.diff(accelerations, axis=0) / np.array(moving.periods)[1:, np.newaxis]
    assert np.abs(jerks).max() <= 200.0 * (1.0 + 1e-6)
    assert moving.phase is MotionPhase.IDLE


def test_each_start_forgets_what_was_being_planned():
    moving = engine(in_pieces=True)
    moving.move_to(TARGET)
    assert moving.preparing
    moving.start(HOME)
    assert not moving.preparing
    assert (run(moving, 0.05) == HOME).all()
    assert moving.limits is LIMITS


@each_kind
def test_a_stop_brakes_at_once_however_long_other_plans_took(kind):
    moving = on_the_way(kind, 0.04)
    # A plan for which there was no time.
    moving.move_to(OTHER)
    run(moving, 0.03, pieces=0)
    run(moving, 0.2, pieces=1)
    moving.move_to(TARGET)
    run(moving, 0.06, pieces=100)
    moving.stop()
    assert not moving.preparing
    assert moving.phase is MotionPhase.STOPPING
    run_to_rest(moving, 1.0)


def test_the_newest_of_a_target_that_moves_and_one_that_does_not_wins():
    moving = engine(in_pieces=True)
    moving.track((0.0, 0.0, 0.3), (0.0, 0.0, 0.0))
    run(moving, 0.5, pieces=1)
    moving.move_to(TARGET)
    moving.track((0.01, 0.0, 0.3), (0.0, 0.0, 0.0))
    run(moving, 1.0, pieces=1)
    assert moving.phase is MotionPhase.TRACKING
    assert place(moving) == pytest.approx((0.01, 0.0, 0.3), abs=1e-9)


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
            run(moving, 0.05, pieces=1)
            assert "lead nowhere: on purpose" in str(moving.take_refusal())
        else:
            with pytest.raises(error):
                run(moving, 0.05, pieces=1)
    assert not moving.preparing
    moving.move_to(TARGET)
    run_to_rest(moving, pieces=1)
    assert_rests_at(moving, TARGET)


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
        moving.work(NO_MORE)
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
        run(moving, 0.1, pieces=1)
        moving.move_to(OTHER)
        pieces += cells_of_pieces(moving)
        assert moving.take_refusal() is None
        run(moving, 0.1, pieces=1)
        moving.jog((0.0, 0.05, 0.0))
        pieces += cells_of_pieces(moving)
        assert max(pieces) <= 64
        work.append(sum(pieces))
    # They are no more where the motion takes a hundred times as long, and so again.
    assert max(work) < 6.0 * work[0]


def test_a_plan_that_takes_too_many_pieces_is_refused_with_what_makes_it_long(monkeypatch):
    limits = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.01))
    moving = engine(in_pieces=True, limits=limits, shaper=SHAPER)
    monkeypatch.setattr(replacing, "MOST_PIECES", 6)
    moving.move_to(TARGET)
    pieces = 1
    while moving.preparing:
        moving.work(NO_MORE)
        pieces += 1
    refusal = moving.take_refusal()
    assert isinstance(refusal, PlanTooLongError)
    assert refusal.pieces == 6
    assert pieces <= 8
    assert "more than 6 pieces of work; it is long with a shaper and a platform" in str(refusal)
    # It begins anew with the next one.
    monkeypatch.undo()
    moving.move_to(TARGET)
    run(moving, 0.03, pieces=100)
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
