"""Paths in the engine: driven, paused, extended, left; with plans at once and in pieces."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from motion_machine import (
    DT,
    HOME,
    LIMITS,
    MACHINE,
    SHAPER,
    TARGET,
    WORKSPACE,
    engine,
    place,
    within,
)

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionPhase, PlatformPath
from tri_glide_kinematics.motion.errors import NewerGoalError, NoPathError
from tri_glide_kinematics.motion.limits import SliderLimits

START = MACHINE.forward(HOME)
SIDE = 0.04
TOLERANCE = 0.001
# Pieces of planning in a step, about half a millisecond.
PIECES = 9
CORNERS = [(0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE), (0.0, 0.0)]

each_mode = pytest.mark.parametrize("in_pieces", [False, True])


def at(x: float, y: float, z: float = 0.0) -> tuple[float, float, float]:
    """Return a place beside the start."""
    return START[0] + x, START[1] + y, START[2] + z


def square(
    tolerance: float = TOLERANCE, start: tuple = START, speed: float | None = None
) -> PlatformPath:
    path = PlatformPath.start(start)
    for x, y in CORNERS[1:]:
        path = path.line_to(at(x, y), tolerance=tolerance, speed=speed)
    return path


def go(moving: MotionEngine, seconds: float) -> list:
    """Step an engine, with a little planning in each step; return the setpoints."""
    states = []
    for _ in range(round(seconds / DT)):
        states.append(moving.step(DT))
        moving.work(partial(next, iter((True,) * PIECES), False))
    return states


def go_to_rest(moving: MotionEngine, longest: float = 60.0) -> list:
    states = []
    while moving.phase not in (MotionPhase.IDLE, MotionPhase.PAUSED):
        states += go(moving, DT)
        assert len(states) < longest / DT, "never came to rest"
    return states


def begun(path: PlatformPath, in_pieces: bool, **options) -> tuple[MotionEngine, list]:
    """Return an engine that has begun to follow a path, and its setpoints."""
    moving = engine(in_pieces=in_pieces, **options)
    moving.follow(path)
    states = []
    while moving.phase is not MotionPhase.FOLLOWING:
        states += go(moving, DT)
        assert len(states) < 2000
    return moving, states


def heights_of(states) -> np.ndarray:
    return np.array([HOME, *(state.heights for state in states)])


def places_of(states) -> np.ndarray:
    return np.array([MACHINE.forward(state.heights) for state in states])


def distance_from_polyline(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return how far each of the points is from the lines between the corners."""
    begins, ways = corners[:-1], np.diff(corners, axis=0)
    offsets = points[:, np.newaxis] - begins
    parts = np.clip((offsets * ways).sum(axis=2) / (ways * ways).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(offsets - parts[..., np.newaxis] * ways, axis=2).min(axis=1)


SQUARE = np.array([at(x, y) for x, y in CORNERS])


@each_mode
def test_a_square_is_driven_within_limits_and_tolerance_to_its_end(in_pieces):
    moving, states = begun(square(), in_pieces)
    states += go_to_rest(moving)
    assert moving.phase is MotionPhase.IDLE
    assert math.dist(place(moving), START) < 1e-9
    assert within(heights_of(states))
    assert distance_from_polyline(places_of(states), SQUARE).max() <= TOLERANCE
    # It does not stop at the corners.
    moving_states = states[50:-50]
    speeds = [max(map(abs, state.velocities)) for state in moving_states]
    assert min(speeds) > 0.01


def test_a_corner_with_a_tolerance_takes_less_time_than_a_stop():
    times = []
    for tolerance in (0.0, TOLERANCE):
        moving, states = begun(square(tolerance), in_pieces=False)
        times.append(len(states + go_to_rest(moving)))
    # In whole cycles; without them it is 0.75 (``test/benchmarks/test_paths.py``).
    assert times[1] <= 0.76 * times[0]


@each_mode
def test_pausing_anywhere_keeps_the_path(in_pieces):
    # Open, so that no place of it is at both ends.
    path = PlatformPath.start(START)
    for x, y in (*CORNERS[1:4], (0.0, 0.01)):
        path = path.line_to(at(x, y), tolerance=TOLERANCE)
    driven = path.driven
    dense = driven.derivatives(np.linspace(0.0, driven.length, 40001), 0)[0]
    for pause_after in (0.02, 0.07, 0.12, 0.17, 0.2):
        moving, states = begun(path, in_pieces)
        states += go(moving, pause_after)
        moving.pause()
        states += go_to_rest(moving)
        assert moving.phase is MotionPhase.PAUSED
        rest = moving.state.heights
        states += go(moving, 0.05)
        assert moving.state.heights == rest
        moving.resume()
        states += go_to_rest(moving)
        assert moving.phase is MotionPhase.IDLE
        assert math.dist(place(moving), path.end) < 1e-9
        assert within(heights_of(states))
        for point in places_of(states)[::7]:
            nearest = np.argmin(np.linalg.norm(dense - point, axis=1))
            low, high = max(nearest - 1, 0), min(nearest + 1, len(dense) - 1)
            span = dense[low : high + 1]
            # The chord of so short a piece leaves it by a tenth of a nanometre.
            assert distance_from_polyline(point[np.newaxis], span)[0] < 1e-9


@each_mode
def test_resuming_before_the_pause_has_come_to_rest_goes_on(in_pieces):
    moving, states = begun(square(), in_pieces)
    states += go(moving, 0.1)
    moving.pause()
    states += go(moving, 0.01)
    moving.resume()
    states += go_to_rest(moving)
    assert moving.phase is MotionPhase.IDLE
    assert math.dist(place(moving), START) < 1e-9
    assert within(heights_of(states))


@each_mode
def test_a_stop_on_the_path_comes_to_rest_on_it_and_forgets_it(in_pieces):
    # At full speed its corners take all that the sliders can do, and a stop leaves it.
    moving, states = begun(square(speed=0.15), in_pieces)
    states += go(moving, 0.12)
    moving.stop()
    states += go_to_rest(moving)
    assert moving.phase is MotionPhase.IDLE
    assert within(heights_of(states))
    assert distance_from_polyline(places_of(states), SQUARE).max() <= TOLERANCE
    with pytest.raises(NoPathError):
        moving.resume()


@each_mode
def test_an_extension_goes_on_without_a_stop(in_pieces):
    first = PlatformPath.start(START).line_to(at(SIDE, 0.0), tolerance=TOLERANCE)
    more = PlatformPath.start(at(SIDE, 0.0)).line_to(at(SIDE, SIDE))
    moving, states = begun(first, in_pieces)
    # Later, the platform would be too fast for the corner already.
    moving.extend(more)
    states += go_to_rest(moving)
    assert math.dist(place(moving), at(SIDE, SIDE)) < 1e-9
    assert within(heights_of(states))
    corners = np.array([START, at(SIDE, 0.0), at(SIDE, SIDE)])
    points = places_of(states)
    assert distance_from_polyline(points, corners).max() <= TOLERANCE
    near = np.linalg.norm(points - corners[1], axis=1) < 2.0 * TOLERANCE
    speeds = np.array([max(map(abs, state.velocities)) for state in states])
    assert speeds[near].min() > 0.01


@each_mode
@pytest.mark.parametrize("after", [0.03, 0.06, 0.09])
def test_an_extension_straight_on_is_driven_on_without_a_stop_nearly_to_the_end(in_pieces, after):
    first = PlatformPath.start(START).line_to(at(SIDE, 0.0))
    moving, states = begun(first, in_pieces)
    states += go(moving, after)
    moving.extend(PlatformPath.start(at(SIDE, 0.0)).line_to(at(2.0 * SIDE, 0.0)))
    states += go_to_rest(moving)
    assert math.dist(place(moving), at(2.0 * SIDE, 0.0)) < 1e-9
    assert within(heights_of(states))
    near = np.linalg.norm(places_of(states) - np.array(at(SIDE, 0.0)), axis=1) < 0.005
    speeds = np.array([max(map(abs, state.velocities)) for state in states])
    assert speeds[near].min() > 0.01


@each_mode
def test_an_extension_after_the_end_begins_from_rest(in_pieces):
    first = PlatformPath.start(START).line_to(at(SIDE, 0.0), tolerance=TOLERANCE)
    moving, states = begun(first, in_pieces)
    states += go_to_rest(moving)
    moving.extend(PlatformPath.start(at(SIDE, 0.0)).line_to(at(SIDE, SIDE)))
    states += go(moving, 0.1)
    states += go_to_rest(moving)
    assert math.dist(place(moving), at(SIDE, SIDE)) < 1e-9
    assert within(heights_of(states))


@each_mode
def test_a_new_target_leaves_the_path(in_pieces):
    moving, states = begun(square(), in_pieces)
    states += go(moving, 0.12)
    moving.move_to(TARGET)
    states += go(moving, 0.02)
    states += go_to_rest(moving)
    assert math.dist(place(moving), TARGET) < 1e-7
    assert within(heights_of(states))


@each_mode
def test_a_path_elsewhere_begins_after_a_line_to_its_start(in_pieces):
    start = at(0.01, 0.02, 0.01)
    path = PlatformPath.start(start).line_to(at(0.03, 0.02, 0.01))
    moving = engine(in_pieces=in_pieces)
    moving.move_to(TARGET)
    states = go(moving, 0.05)
    moving.follow(path)
    states += go(moving, 0.02)
    states += go_to_rest(moving)
    assert math.dist(place(moving), at(0.03, 0.02, 0.01)) < 1e-9
    assert within(heights_of(states))
    points = places_of(states)
    assert np.linalg.norm(points - np.array(start), axis=1).min() < 1e-9


@each_mode
def test_a_slower_scale_on_the_path_is_kept_and_a_faster_one_used(in_pieces):
    moving, states = begun(square(), in_pieces, limits=SliderLimits.uniform(0.2, 10.0, 200.0))
    states += go(moving, 0.1)
    moving.set_speed_scale(0.25)
    states += go(moving, 0.25)
    assert moving.phase is MotionPhase.FOLLOWING
    assert not moving.limits_pending
    slow = go(moving, 0.1)
    assert max(max(map(abs, state.velocities)) for state in slow) <= 0.05 * (1.0 + 1e-9)
    moving.set_speed_scale(1.0)
    states += slow + go(moving, 0.2)
    fast = go_to_rest(moving)
    assert max(max(map(abs, state.velocities)) for state in fast) > 0.06
    assert math.dist(place(moving), START) < 1e-9
    assert within(heights_of(states + fast), SliderLimits.uniform(0.2, 10.0, 200.0))


def test_a_speed_that_the_path_asks_for_is_kept_and_scaled():
    path = PlatformPath.start(START).line_to(at(SIDE, 0.0), speed=0.1).line_to(at(SIDE, SIDE))
    for scale in (1.0, 0.5):
        moving, states = begun(path, in_pieces=False, speed_scale=scale)
        states += go_to_rest(moving)
        points = places_of(states)
        speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / DT
        on_first = points[1:, 0] < at(0.9 * SIDE, 0.0)[0]
        assert 0.99 * 0.1 * scale < speeds[on_first].max() <= 0.1 * scale * (1.0 + 1e-9)
        assert speeds[~on_first].max() > 0.15 * scale


@each_mode
def test_a_long_path_is_driven_in_parts_and_its_geometry_looked_at_before(in_pieces):
    angles = np.linspace(0.0, 20.0 * np.pi, 2001)
    points = np.column_stack(
        (0.02 * np.cos(angles) - 0.02, 0.02 * np.sin(angles), 0.00001 * np.arange(2001))
    ) + np.array(START)
    path = PlatformPath.through(points, tolerance=0.0001)
    moving, states = begun(path, in_pieces)
    states += go_to_rest(moving)
    assert math.dist(place(moving), points[-1]) < 1e-9
    assert within(heights_of(states))
    speeds = np.array([max(map(abs, state.velocities)) for state in states])
    # Nowhere on the way does it crawl: each part goes over into the next.
    assert speeds[200:-200].min() > 0.02


@each_mode
def test_a_path_out_of_the_workspace_is_refused_with_the_segment(in_pieces):
    path = PlatformPath.start(START).line_to(at(0.02, 0.0)).line_to(at(0.02, 0.0, 5.0))
    moving = engine(in_pieces=in_pieces)
    with pytest.raises(KinematicsError, match="segment 2"):
        moving.follow(path)
        go(moving, 1.0)
        raise moving.take_refusal() or AssertionError("not refused")
    assert moving.phase is MotionPhase.IDLE
    assert moving.state.heights == HOME


def test_without_a_path_nothing_can_be_paused_resumed_or_extended():
    moving = engine()
    for ask in (
        moving.pause,
        moving.resume,
        lambda: moving.extend(square()),
    ):
        with pytest.raises(NoPathError):
            ask()


@each_mode
@pytest.mark.parametrize("seed", range(6))
def test_whatever_is_asked_on_a_path_the_limits_hold(seed, in_pieces):
    random = np.random.default_rng(seed)
    moving = engine(in_pieces=in_pieces)
    states = []
    end = START
    for _ in range(25):
        kind = random.integers(8)
        try:
            if kind <= 1:
                offsets = random.uniform(-0.03, 0.03, (random.integers(1, 6), 3))
                path = PlatformPath.start(place(moving))
                for offset in offsets:
                    end = tuple(np.array(START) + offset)
                    path = path.line_to(end, tolerance=random.choice([0.0, 1e-4, 1e-3]))
                moving.follow(path)
            elif kind == 2:
                more = tuple(np.array(START) + random.uniform(-0.03, 0.03, 3))
                moving.extend(PlatformPath.start(end).line_to(more))
                end = more
            elif kind == 3:
                moving.pause()
            elif kind == 4:
                moving.resume()
            elif kind == 5:
                moving.set_speed_scale(float(random.uniform(0.1, 1.0)))
            elif kind == 6:
                moving.move_to(tuple(np.array(START) + random.uniform(-0.03, 0.03, 3)))
            else:
                moving.stop()
        except KinematicsError:
            pass
        states += go(moving, float(random.uniform(0.002, 0.15)))
    if moving.phase is MotionPhase.PAUSED:
        moving.resume()
    states += go_to_rest(moving)
    if moving.phase is MotionPhase.PAUSED:
        moving.resume()
        states += go_to_rest(moving)
    assert within(heights_of(states), LIMITS)
    for state in states[::50]:
        WORKSPACE.check_heights(state.heights)


def test_a_newer_goal_that_is_planned_is_not_lost_by_a_pause():
    moving, _ = begun(square(), in_pieces=True)
    go(moving, 0.1)
    moving.move_to(TARGET)
    for ask in (moving.pause, moving.resume):
        with pytest.raises(NewerGoalError):
            ask()
    go(moving, 0.05)
    go_to_rest(moving)
    assert math.dist(place(moving), TARGET) < 1e-7


@each_mode
def test_lower_limits_at_the_very_end_change_nothing(in_pieces):
    for before in (0.01, 0.04, 0.08):
        moving, _ = begun(square(), in_pieces)
        while moving.remaining > before or not moving.path_progress.way_remaining < 0.01:
            go(moving, DT)
        moving.set_limits(SliderLimits.uniform(0.1, 1.0, 20.0))
        go(moving, 0.02)
        go_to_rest(moving)
        assert moving.take_refusal() is None
        assert math.dist(place(moving), START) < 1e-9


@each_mode
def test_a_pause_at_the_very_end_does_not_hold_an_extension(in_pieces):
    first = PlatformPath.start(START).line_to(at(SIDE, 0.0))
    moving, _ = begun(first, in_pieces)
    while moving.remaining > 0.02:
        go(moving, DT)
    moving.pause()
    go_to_rest(moving)
    assert moving.phase is MotionPhase.IDLE
    moving.extend(PlatformPath.start(at(SIDE, 0.0)).line_to(at(SIDE, SIDE)))
    go(moving, 0.1)
    go_to_rest(moving)
    assert math.dist(place(moving), at(SIDE, SIDE)) < 1e-9


@pytest.mark.parametrize("speed_scale", [1.0, 0.001])
def test_however_slow_a_path_is_it_is_planned(speed_scale):
    path = PlatformPath.start(START).line_to(at(SIDE, 0.0), speed=1e-5)
    moving = engine(speed_scale=speed_scale)
    moving.follow(path)
    states = go(moving, 0.05)
    assert moving.phase is MotionPhase.FOLLOWING
    assert within(heights_of(states))


def platform_speeds(states):
    """Return the speed of the platform between setpoints. Shape (n - 1,) [m/s]."""
    return np.linalg.norm(np.diff(places_of(states), axis=0), axis=1) / DT


def steadily(speed, in_pieces, shaper=None):
    """Return an engine on a circle that asks for a speed [m/s], and what it has driven."""
    path = PlatformPath.start(START)
    for _ in range(4):
        path = path.arc_about(at(-0.03, 0.0), (0.0, 0.0, 1.0), 2.0 * np.pi, 1e-3, speed)
    moving = engine(in_pieces=in_pieces)
    moving.set_shaper(shaper)
    moving.follow(path)
    return moving, go(moving, 0.8)


@each_mode
@pytest.mark.parametrize("shaper", [None, SHAPER])
@pytest.mark.parametrize("scale", [0.3, 1.5])
def test_a_speed_override_is_in_force_soon_and_the_platform_never_stops(in_pieces, shaper, scale):
    asked = 0.05
    moving, states = steadily(asked, in_pieces, shaper)
    moving.set_path_speed_scale(scale)
    after = go(moving, 0.5)
    assert moving.path_speed_scale == scale and not moving.limits_pending
    speeds = platform_speeds(after)
    # A slower one may be undershot for a moment.
    assert speeds.min() > 0.4 * min(scale, 1.0) * asked
    assert speeds.max() < max(scale, 1.0) * asked * 1.01
    assert speeds[-200:] == pytest.approx(scale * asked, rel=0.01)
    moving.set_path_speed_scale(1.0)
    after += go(moving, 0.5)
    assert platform_speeds(after)[-100:] == pytest.approx(asked, rel=0.01)
    assert within(heights_of(states + after))


def test_a_speed_override_is_no_factor_of_a_limit():
    limits = SliderLimits.uniform(0.05, 10.0, 200.0)
    moving, states = begun(square(), in_pieces=False, limits=limits, path_speed_scale=2.0)
    states += go_to_rest(moving)
    assert within(heights_of(states), limits)
    slow, others = begun(square(), in_pieces=False, limits=limits, path_speed_scale=0.5)
    others += go_to_rest(slow)
    # The square asks for no speed.
    assert len(others) == len(states)


@each_mode
def test_overrides_and_scales_at_random_keep_all_limits_and_go_on(in_pieces):
    random = np.random.default_rng(7)
    moving, states = steadily(0.1, in_pieces)
    least = 1.0
    for _ in range(12):
        scale = float(random.choice((0.2, 0.5, 0.9, 1.0, 1.6, 2.0)))
        moving.set_path_speed_scale(scale)
        least = min(least, scale)
        more = go(moving, float(random.choice((0.01, 0.05, 0.2))))
        states += more
        assert moving.phase is MotionPhase.FOLLOWING
        assert platform_speeds(states[-len(more) - 1 :]).min() > 0.3 * least * 0.1
    assert within(heights_of(states))


def test_a_lower_speed_scale_slows_a_path_down_that_asks_for_a_speed_and_stops_nothing():
    moving, states = steadily(0.1, in_pieces=False)
    moving.set_speed_scale(0.4)
    after = go(moving, 0.4)
    assert moving.speed_scale == 0.4
    speeds = platform_speeds(after)
    assert speeds.min() > 0.02
    assert speeds[-100:] == pytest.approx(0.04, rel=0.01)
    assert within(heights_of(states + after))


@each_mode
@pytest.mark.parametrize("shaper", [None, SHAPER])
def test_the_place_on_the_path_is_that_of_the_setpoint(in_pieces, shaper):
    moving = engine(in_pieces=in_pieces)
    moving.set_shaper(shaper)
    assert math.isnan(moving.path_place)
    # There and back, with a stop between; then another path.
    moving.follow(PlatformPath.start(START).line_to(at(0.02, 0.0)).line_to(at(0.0, 0.0)))
    ways = []
    for step in range(2000):
        go(moving, DT)
        way = moving.path_place
        if not math.isnan(way):
            ways.append(way)
            assert place(moving) == pytest.approx(at(0.02 - abs(way - 0.02), 0.0), abs=1e-9)
        if step > 100 and moving.phase is MotionPhase.IDLE:
            break
    assert (np.diff(ways) >= -1e-15).all()
    assert ways[-1] == pytest.approx(0.04, abs=1e-12)
    moving.follow(PlatformPath.start(START).line_to(at(0.0, 0.01)))
    go(moving, 50 * DT)
    assert 0.0 <= moving.path_place < 0.01
    assert place(moving) == pytest.approx(at(0.0, moving.path_place), abs=1e-9)
