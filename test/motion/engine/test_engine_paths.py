"""Paths in the engine: driven, paused, extended, left; with plans at once and in pieces."""

from __future__ import annotations

import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    FINE,
    HOME,
    SHAPER,
    START,
    TARGET,
    RecordedEngine,
    assert_rests_at,
    beside,
    distance_from_polyline,
    each_mode,
    engine,
    path_beside,
    place,
    run,
    run_to_rest,
    speeds,
    under_way,
)
from soak import combined

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionPhase, PlatformPath
from tri_glide_kinematics.motion.engine.held_motion import progress
from tri_glide_kinematics.motion.errors import NewerGoalError, NoPathError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.trajectory import PathHeights

SIDE = 0.04
TOLERANCE = 0.001
CORNERS = [(0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE), (0.0, 0.0)]
FIRST = path_beside(*CORNERS[:2], tolerance=TOLERANCE)
AROUND = path_beside(*CORNERS[1:3])


def square(tolerance: float = TOLERANCE, speed: float | None = None) -> PlatformPath:
    return path_beside(*CORNERS, tolerance=tolerance, speed=speed)


def begun(path: PlatformPath, in_pieces: bool, **options) -> RecordedEngine:
    """Return an engine that has begun to follow a path."""
    moving = engine(in_pieces=in_pieces, **options)
    moving.follow(path)
    while moving.phase is not MotionPhase.FOLLOWING:
        run(moving, DT)
        assert len(moving.states) < 2000
    return moving


def slider_speeds(moving: RecordedEngine) -> np.ndarray:
    """Return how fast the fastest slider was at each setpoint. Shape (n,) [m/s]."""
    return np.array([max(map(abs, state.velocities)) for state in moving.states])


def assert_near_polyline(moving: RecordedEngine, *corners) -> None:
    """Judge how far the platform was from lines between places beside the start."""
    polyline = np.array([beside(*corner) for corner in corners])
    assert distance_from_polyline(moving.places_since(), polyline).max() <= TOLERANCE


@each_mode
def test_a_square_is_driven_within_limits_and_tolerance_to_its_end(in_pieces):
    moving = begun(square(), in_pieces)
    run_to_rest(moving)
    assert_rests_at(moving, START)
    assert_near_polyline(moving, *CORNERS)
    # It does not stop at the corners.
    assert slider_speeds(moving)[26:-25].min() > 0.01


@each_mode
def test_pausing_anywhere_keeps_the_path(in_pieces):
    # Open, so that no place of it is at both ends.
    path = path_beside(*CORNERS[:4], (0.0, 0.01), tolerance=TOLERANCE)
    driven = path.driven
    dense = driven.derivatives(np.linspace(0.0, driven.length, 40001), 0)[0]
    for pause_after in (0.02, 0.07, 0.2):
        moving = begun(path, in_pieces)
        run(moving, pause_after)
        moving.pause()
        run_to_rest(moving)
        assert moving.phase is MotionPhase.PAUSED
        rest = moving.state.heights
        run(moving, 0.05)
        assert moving.state.heights == rest
        moving.resume()
        run_to_rest(moving)
        assert_rests_at(moving, path.end)
        for point in moving.places_since(1)[::5]:
            nearest = np.argmin(np.linalg.norm(dense - point, axis=1))
            low, high = max(nearest - 1, 0), min(nearest + 1, len(dense) - 1)
            span = dense[low : high + 1]
            # The chord of so short a piece leaves it by a tenth of a nanometre.
            assert distance_from_polyline(point[np.newaxis], span)[0] < 1e-9


@each_mode
def test_resuming_before_the_pause_has_come_to_rest_goes_on(in_pieces):
    moving = begun(square(), in_pieces)
    run(moving, 0.1)
    moving.pause()
    run(moving, 0.01)
    moving.resume()
    run_to_rest(moving)
    assert_rests_at(moving, START)


@each_mode
def test_a_stop_on_the_path_comes_to_rest_on_it_and_forgets_it(in_pieces):
    # At full speed its corners take all that the sliders can do, and a stop leaves it.
    moving = begun(square(speed=0.15), in_pieces)
    run(moving, 0.12)
    moving.stop()
    run_to_rest(moving)
    assert_rests_at(moving, place(moving))
    assert_near_polyline(moving, *CORNERS)
    with pytest.raises(NoPathError):
        moving.resume()


@each_mode
@pytest.mark.parametrize(
    ("tolerance", "after", "more"),
    [
        # Later, the platform would be too fast for the corner already.
        (TOLERANCE, 0.0, (SIDE, SIDE)),
        # Straight on, without a stop nearly up to the end.
        *((0.0, after, (2.0 * SIDE, 0.0)) for after in (0.03, 0.06, 0.09)),
    ],
)
def test_an_extension_goes_on_without_a_stop(in_pieces, tolerance, after, more):
    moving = begun(path_beside(*CORNERS[:2], tolerance=tolerance), in_pieces)
    run(moving, after)
    moving.extend(path_beside(CORNERS[1], more))
    run_to_rest(moving)
    assert_rests_at(moving, beside(*more))
    assert_near_polyline(moving, *CORNERS[:2], more)
    away = np.linalg.norm(moving.places_since() - beside(*CORNERS[1]), axis=1)
    assert slider_speeds(moving)[away < max(2.0 * tolerance, 0.002)].min() > 0.01


@each_mode
@pytest.mark.parametrize("pauses", [False, True])
def test_an_extension_after_the_end_begins_from_rest(in_pieces, pauses):
    """A pause at the very end does not hold it."""
    moving = begun(FIRST, in_pieces)
    while moving.remaining > 0.02:
        run(moving, DT)
    if pauses:
        moving.pause()
    run_to_rest(moving)
    assert moving.phase is MotionPhase.IDLE
    moving.extend(AROUND)
    run_to_rest(moving)
    assert_rests_at(moving, AROUND.end)


@each_mode
def test_a_new_target_leaves_the_path(in_pieces):
    moving = begun(square(), in_pieces)
    run(moving, 0.12)
    moving.move_to(TARGET)
    run_to_rest(moving)
    assert_rests_at(moving, TARGET, near=1e-7)


@each_mode
def test_a_path_elsewhere_begins_after_a_line_to_its_start(in_pieces):
    path = path_beside((0.01, 0.02, 0.01), (0.03, 0.02, 0.01))
    moving = under_way(TARGET, 0.05, in_pieces=in_pieces)
    moving.follow(path)
    run_to_rest(moving)
    assert_rests_at(moving, path.end)
    ways = moving.places_since() - path.position(0.0)
    assert np.linalg.norm(ways, axis=1).min() < 1e-9


@each_mode
def test_a_slower_scale_on_the_path_is_kept_and_a_faster_one_used(in_pieces):
    limits = SliderLimits.uniform(0.2, 10.0, 200.0)
    moving = begun(square(), in_pieces, limits=limits, period=FINE)
    run(moving, 0.1)
    moving.set_speed_scale(0.25)
    run(moving, 0.3)
    assert moving.phase is MotionPhase.FOLLOWING
    assert not moving.limits_pending
    run(moving, 0.1)
    assert slider_speeds(moving)[-100:].max() <= 0.05 * (1.0 + 1e-9)
    moving.set_speed_scale(1.0)
    run(moving, 0.2)
    slow = len(moving.states)
    run_to_rest(moving)
    assert slider_speeds(moving)[slow:].max() > 0.06
    assert_rests_at(moving, START)


def test_a_speed_that_the_path_asks_for_is_kept_and_scaled():
    path = PlatformPath.start(START).line_to(beside(SIDE), speed=0.1).line_to(beside(SIDE, SIDE))
    for scale in (1.0, 0.5):
        moving = begun(path, in_pieces=False, speed_scale=scale)
        run_to_rest(moving)
        on_first = moving.places_since(1)[:, 0] < beside(0.9 * SIDE)[0]
        fast = speeds(moving.heights_since())
        assert 0.99 * 0.1 * scale < fast[on_first].max() <= 0.1 * scale * (1.0 + 1e-9)
        assert fast[~on_first].max() > 0.15 * scale


@each_mode
def test_a_long_path_is_driven_in_parts_and_its_geometry_looked_at_before(in_pieces):
    angles = np.linspace(0.0, 20.0 * np.pi, 2001)
    offsets = np.column_stack(
        (0.02 * np.cos(angles) - 0.02, 0.02 * np.sin(angles), 0.00001 * np.arange(2001))
    )
    path = path_beside(*offsets, tolerance=0.0001)
    moving = begun(path, in_pieces)
    run_to_rest(moving)
    assert_rests_at(moving, path.end)
    # Nowhere on the way does it crawl: each part goes over into the next.
    assert slider_speeds(moving)[101:-100].min() > 0.02


@each_mode
def test_a_path_out_of_the_workspace_is_refused_with_the_segment(in_pieces):
    moving = engine(in_pieces=in_pieces)
    with pytest.raises(KinematicsError, match="segment 2"):
        moving.follow(path_beside((0.0, 0.0), (0.02, 0.0), (0.02, 0.0, 5.0)))
        run(moving, 1.0)
        raise moving.take_refusal() or AssertionError("not refused")
    assert moving.phase is MotionPhase.IDLE
    assert moving.state.heights == HOME


def test_without_a_path_nothing_can_be_paused_resumed_or_extended():
    moving = engine()
    for ask in (moving.pause, moving.resume, lambda: moving.extend(square())):
        with pytest.raises(NoPathError):
            ask()


def test_a_newer_goal_that_is_planned_is_not_lost_by_a_pause():
    moving = begun(square(), in_pieces=True)
    run(moving, 0.1)
    moving.move_to(TARGET)
    for ask in (moving.pause, moving.resume):
        with pytest.raises(NewerGoalError):
            ask()
    run_to_rest(moving)
    assert_rests_at(moving, TARGET, near=1e-7)


@each_mode
def test_lower_limits_at_the_very_end_change_nothing(in_pieces):
    for before in (0.01, 0.04, 0.08):
        moving = begun(square(), in_pieces)
        while moving.remaining > before or not moving.path_progress.way_remaining < 0.01:
            run(moving, DT)
        moving.set_limits(SliderLimits.uniform(0.1, 1.0, 20.0))
        run_to_rest(moving)
        assert moving.take_refusal() is None
        assert_rests_at(moving, START)


@pytest.mark.parametrize("speed_scale", [1.0, 0.001])
def test_however_slow_a_path_is_it_is_planned(speed_scale):
    moving = engine(speed_scale=speed_scale)
    moving.follow(path_beside(*CORNERS[:2], speed=1e-5))
    run(moving, 0.05)
    assert moving.phase is MotionPhase.FOLLOWING
    assert moving.kept_limits


def steadily(speed: float, in_pieces: bool, shaper=None) -> RecordedEngine:
    """Return an engine that is for some time on a circle that asks for a speed [m/s]."""
    path = PlatformPath.start(START)
    for _ in range(4):
        path = path.arc_about(beside(-0.03), (0.0, 0.0, 1.0), 2.0 * np.pi, 1e-3, speed)
    moving = engine(in_pieces=in_pieces, shaper=shaper)
    moving.follow(path)
    run(moving, 0.8)
    return moving


@pytest.mark.slow
@pytest.mark.parametrize(
    ("in_pieces", "shaper", "scale"), combined((False, True), (None, SHAPER), (0.3, 1.5))
)
def test_a_speed_override_is_in_force_soon_and_the_platform_never_stops(in_pieces, shaper, scale):
    asked = 0.05
    moving = steadily(asked, in_pieces, shaper)
    moving.set_path_speed_scale(scale)
    after = speeds(run(moving, 0.35))
    assert moving.path_speed_scale == scale and not moving.limits_pending
    # A slower one may be undershot for a moment.
    assert after.min() > 0.4 * min(scale, 1.0) * asked
    assert after.max() < max(scale, 1.0) * asked * 1.01
    assert after[-100:] == pytest.approx(scale * asked, rel=0.01)
    moving.set_path_speed_scale(1.0)
    assert speeds(run(moving, 0.35))[-50:] == pytest.approx(asked, rel=0.01)
    assert moving.kept_limits


@pytest.mark.slow
@pytest.mark.parametrize(("in_pieces", "shaper"), combined((False, True), (None, SHAPER)))
def test_a_rapid_override_bounds_what_asks_for_no_speed_in_mid_path_and_nothing_else(
    in_pieces, shaper
):
    scale, asked = 0.05, 0.08
    path = PlatformPath.start(START)
    for number in range(6):
        path = path.line_to(beside(0.05 * (-1) ** number, 0.005 * number), tolerance=1e-3)
    moving = engine(in_pieces=in_pieces, shaper=shaper)
    moving.follow(path.line_to(beside(0.0, -SIDE), speed=asked))
    assert speeds(run(moving, 0.4)).max() > 5.0 * scale
    moving.set_limits(moving.limits, rapid_scale=scale)
    run(moving, 0.2)
    slow = speeds(run(moving, 0.3))
    assert slow.max() == pytest.approx(scale, rel=0.01)
    assert moving.scales == (1.0, 1.0, scale) and not moving.limits_pending
    first = len(moving.states)
    run_to_rest(moving)
    # The line at the end asks for more than rapids may have.
    assert speeds(moving.heights_since(first)).max() == pytest.approx(asked, rel=0.01)
    assert moving.kept_limits


def test_a_speed_override_is_no_factor_of_a_limit():
    limits, counts = SliderLimits.uniform(0.05, 10.0, 200.0), []
    for scale in (2.0, 0.5):
        moving = begun(square(), in_pieces=False, limits=limits, path_speed_scale=scale)
        run_to_rest(moving)
        assert moving.kept_limits
        counts.append(len(moving.states))
    # The square asks for no speed.
    assert counts[0] == counts[1]


def test_a_lower_speed_scale_slows_a_path_down_that_asks_for_a_speed_and_stops_nothing():
    moving = steadily(0.1, in_pieces=False)
    moving.set_speed_scale(0.4)
    after = speeds(run(moving, 0.4))
    assert moving.speed_scale == 0.4
    assert after.min() > 0.02
    assert after[-50:] == pytest.approx(0.04, rel=0.01)
    assert moving.kept_limits


@each_mode
@pytest.mark.parametrize("shaper", [None, SHAPER])
def test_the_place_on_the_path_is_that_of_the_setpoint(in_pieces, shaper):
    moving = engine(in_pieces=in_pieces, shaper=shaper)
    assert math.isnan(moving.path_place)
    # There and back, with a stop between; then another path.
    moving.follow(path_beside((0.0, 0.0), (0.02, 0.0), (0.0, 0.0)))
    ways = []
    for step in range(1000):
        run(moving, DT)
        way = moving.path_place
        if not math.isnan(way):
            ways.append(way)
            assert place(moving) == pytest.approx(beside(0.02 - abs(way - 0.02)), abs=1e-9)
        if step > 50 and moving.phase is MotionPhase.IDLE:
            break
    assert (np.diff(ways) >= -1e-15).all()
    assert ways[-1] == pytest.approx(0.04, abs=1e-12)
    moving.follow(path_beside((0.0, 0.0), (0.0, 0.01)))
    run(moving, 0.05)
    assert 0.0 <= moving.path_place < 0.01
    assert place(moving) == pytest.approx(beside(0.0, moving.path_place), abs=1e-9)


def test_no_time_is_known_while_the_plan_does_not_follow_the_path():
    moving = engine()
    moving.move_to(TARGET)
    elsewhere = moving._holder.held.plan
    heights = PathHeights(square().driven, moving.machine.geometry)
    for way, time in ((0.01, math.nan), (heights.driven.length, 0.0)):
        told = progress(heights, way, elsewhere, 0.0)
        assert told.time_remaining == pytest.approx(time, nan_ok=True)
