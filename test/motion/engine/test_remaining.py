"""How long is left until what was asked for has ended; at once and in pieces."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from motion_machine import (
    DT,
    OTHER,
    START,
    TARGET,
    beside,
    each_kind,
    each_mode,
    engine,
    more,
    path_beside,
    place,
    run,
    under_way,
)

from tri_glide_kinematics.motion import MotionEngine, MotionPhase, PlatformPath, SliderLimits

SLOW = SliderLimits.uniform(0.1, 2.0, 50.0)


def path(tolerance: float = 0.0) -> PlatformPath:
    """Return a path that begins elsewhere and stops on its way, without a tolerance."""
    return path_beside((0.01, 0.0), (0.05, 0.0), (0.05, 0.03), tolerance=tolerance)


def loop(moving: MotionEngine) -> list[float]:
    """Step as the README says, until nothing remains; return what remained at each step."""
    told = []
    while moving.remaining > 0.0:
        told.append(moving.remaining)
        moving.step(DT)
        moving.work(more(2))
        assert len(told) < 20_000, "it never ended"
    return told


def assert_counts_down(told: list[float]) -> None:
    """Assert that it is unknown first, and then gets less with the steps to the end."""
    known = [left for left in told if math.isfinite(left)]
    assert told[len(told) - len(known) :] == known
    assert known[-1] <= DT
    for before, after in pairwise(known):
        assert after == pytest.approx(before - DT, abs=1e-9)


@each_mode
@pytest.mark.parametrize("tolerance", [0.0, 0.002])
def test_a_loop_over_it_drives_a_path_to_its_end(in_pieces, tolerance):
    moving = engine(in_pieces=in_pieces)
    moving.follow(path(tolerance))
    told = loop(moving)
    assert math.isinf(told[0])
    assert_counts_down(told)
    assert moving.phase is MotionPhase.IDLE
    assert math.dist(place(moving), path().end) < 1e-9


@each_mode
def test_a_loop_over_it_drives_a_path_of_many_windows_and_its_extension(in_pieces):
    centre, axis = beside(0.0, 0.04), (0.0, 0.0, 1.0)
    circle = PlatformPath.start(START).arc_about(centre, axis, 2.0 * math.pi)
    moving = engine(in_pieces=in_pieces, limits=SliderLimits.uniform(1.0, 10.0, 2000.0))
    moving.follow(circle)
    for _ in range(100):
        run(moving, DT, pieces=2)
        assert moving.remaining > 0.0
    moving.extend(path_beside((0.0, 0.0), (0.02, 0.0), tolerance=0.002))
    assert math.isinf(moving.remaining)
    loop(moving)
    assert moving.take_refusal() is None
    assert math.dist(place(moving), beside(0.02)) < 1e-9


@each_kind
@each_mode
def test_a_loop_over_it_drives_a_move_that_comes_in_motion(kind, in_pieces):
    moving = under_way(TARGET, 0.1, kind, in_pieces=in_pieces, pieces=math.inf)
    moving.move_to(OTHER)
    assert math.isinf(moving.remaining) is in_pieces
    assert_counts_down(loop(moving))
    assert math.dist(place(moving), OTHER) < 1e-9


@each_kind
@each_mode
def test_it_is_unknown_while_a_goal_waits_for_limits(kind, in_pieces):
    moving = under_way(TARGET, 0.15, kind, in_pieces=in_pieces, pieces=math.inf)
    moving.set_limits(SLOW)
    moving.move_to(OTHER)
    assert moving.limits_pending
    assert math.isinf(moving.remaining)
    loop(moving)
    assert math.dist(place(moving), OTHER) < 1e-9


@each_mode
def test_a_pause_has_no_known_end_and_a_stop_has(in_pieces):
    moving = engine(in_pieces=in_pieces)
    moving.follow(path(0.002))
    while moving.path_progress is None or not moving.path_progress.way > 0.01:
        run(moving, DT)
    moving.pause()
    while moving.phase is not MotionPhase.PAUSED:
        assert math.isinf(moving.remaining)
        run(moving, DT)
    assert math.isinf(moving.remaining)
    moving.resume()
    for _ in range(25):
        assert moving.remaining > 0.0
        run(moving, DT)
    moving.stop()
    assert moving.remaining == moving.time_to_rest > 0.0
    loop(moving)
    assert moving.phase is MotionPhase.IDLE


@each_mode
def test_what_has_no_end_has_no_time_to_it(in_pieces):
    moving = under_way(TARGET, 0.1, in_pieces=in_pieces, pieces=math.inf)
    moving.jog((0.05, 0.0, 0.0))
    assert moving.tracks
    assert math.isinf(moving.remaining)
    assert 0.0 < moving.time_to_rest < 1.0
    moving.track(OTHER, (0.0, 0.0, 0.0))
    moving.step(DT)
    assert math.isinf(moving.remaining)
    moving.stop()
    loop(moving)
    assert moving.remaining == moving.time_to_rest == 0.0


@each_mode
def test_a_path_that_is_refused_leaves_nothing_to_do(in_pieces):
    moving = engine(in_pieces=in_pieces)
    try:
        moving.follow(PlatformPath.start(START).line_to((0.5, 0.0, 0.3)))
    except ValueError as error:
        assert not in_pieces, error
    else:
        loop(moving)
        assert moving.take_refusal() is not None
    assert moving.remaining == 0.0
