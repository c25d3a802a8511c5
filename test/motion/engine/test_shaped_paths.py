"""Paths with a shaper: what is driven keeps limits and tolerances, also at stops."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from motion_machine import (
    DT,
    LIMITS,
    MACHINE,
    SHAPER,
    START,
    WORKSPACE,
    RecordedEngine,
    assert_rests_at,
    each_mode,
    engine,
    run,
    run_to_rest,
    within,
)
from soak import many, some

from testing.path_samples import largest_part, random_path
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    MotionKind,
    MotionPhase,
    PlatformPath,
    SliderLimits,
    time_path,
)
from tri_glide_kinematics.motion.errors import CutBendError
from tri_glide_kinematics.motion.shaped import Bends, ShapedTrajectory
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.workspace import Workspace

SHAPERS = (
    SHAPER,
    Shaper.of(ShaperKind.ZV, Mode(12.0, 0.05)),
    Shaper.of(ShaperKind.EI, Mode(18.0, 0.03), Mode(30.0, 0.03)),
)


def at_start(path: PlatformPath, shaper: Shaper = SHAPER, **options) -> RecordedEngine:
    """Return an engine that rests at the start of a path, with a shaper in force."""
    start = MACHINE.inverse(path.position(0.0))
    return engine(MotionKind.LINEAR, heights=start, **options, shaper=shaper)


def following(path: PlatformPath, shaper: Shaper = SHAPER, **options) -> RecordedEngine:
    """Return an engine that has just begun to follow a path."""
    moving = at_start(path, shaper, **options)
    moving.follow(path)
    return moving


def offsets_of(path: PlatformPath) -> np.ndarray:
    """Return where an engine drives a path, seen from the start."""
    moving = following(path)
    run_to_rest(moving)
    return moving.places_since() - START


def around(*corners, tolerance: float = 0.0, speed: float | None = None) -> PlatformPath:
    """Return a polyline from the start; corners relative to it, in millimetres."""
    points = START + 1e-3 * np.array(((0.0, 0.0, 0.0), *corners))
    return PlatformPath.through(points, tolerance, speed)


SQUARE = ((40.0, 0.0, 0.0), (40.0, 40.0, 0.0), (0.0, 40.0, 0.0), (0.0, 0.0, 0.0))


def sampled_paths(count: int):
    """Yield paths at random, as pieces too, that are inside the workspace."""
    chance = np.random.default_rng(3)
    while count:
        path, pieces = random_path(chance, count=int(chance.integers(2, 9)), stops=0.0, size=0.05)
        try:
            time_path(path, WORKSPACE, LIMITS)
        except KinematicsError:
            continue
        count -= 1
        yield path, pieces


@pytest.mark.slow
@pytest.mark.parametrize("shaper", SHAPERS)
def test_paths_keep_limits_and_tolerances(shaper):
    for path, pieces in sampled_paths(many(1)):
        moving = following(path, shaper)
        run_to_rest(moving)
        assert largest_part(path, pieces, moving.places_since()) <= 1.0
        assert_rests_at(moving, path.end)


def test_without_speeds_for_bends_a_tolerance_would_not_hold(monkeypatch):
    path = around(*SQUARE, tolerance=2e-3)
    free = Bends._steady

    def fast(self, *arguments):
        return 0.0 * (yield from free(self, *arguments)) + math.inf

    monkeypatch.setattr(Bends, "_steady", fast)
    with pytest.raises(CutBendError, match="the shaper would cut it by"):
        at_start(path).follow(path)


def assert_inside_square(places: np.ndarray) -> None:
    """Judge places on the square with a tolerance of 1 mm."""
    assert np.abs(places - START - (0.02, 0.02, 0.0)).max() <= 0.021


def test_the_trajectory_without_an_engine_keeps_the_same():
    path = around(*SQUARE, tolerance=1e-3)
    motion = time_path(path, WORKSPACE, LIMITS, SHAPER)
    heights = motion.sample(np.arange(0.0, motion.duration, DT)).heights
    assert within(heights)
    assert_inside_square(MACHINE.forward_batch(heights))
    assert motion.duration > time_path(path, WORKSPACE, LIMITS).duration + SHAPER.duration


@pytest.mark.slow
@pytest.mark.parametrize("seed", some(range(12), 4))
def test_no_tolerance_makes_a_path_take_much_longer_than_stops_in_its_corners(seed):
    chance = np.random.default_rng(seed)
    mode = Mode(math.exp(chance.uniform(math.log(4.0), math.log(40.0))), 0.03)
    shaper = Shaper.of(chance.choice(list(ShaperKind)), mode)
    corners = chance.normal(0.0, chance.choice((5.0, 20.0)), (4, 3))
    tolerance = 10.0 ** chance.uniform(-6.0, -2.5)
    rounded = time_path(around(*corners, tolerance=tolerance), WORKSPACE, LIMITS, shaper)
    stopped = time_path(around(*corners), WORKSPACE, LIMITS, shaper)
    assert rounded.duration < 1.35 * stopped.duration


def test_a_corner_stops_only_where_that_is_quicker():
    corner = (40.0, 0.0, 0.0), (40.0, 40.0, 0.0)
    times = [
        time_path(around(*corner, tolerance=tolerance), WORKSPACE, LIMITS, SHAPER)
        for tolerance in (0.0, 2e-5, 3e-3)
    ]
    exact, tight, wide = (motion.duration for motion in times)
    assert tight == exact
    assert wide < 0.95 * exact
    # Of many corners near to each other, none stops for itself.
    angles = np.linspace(0.0, 2.0 * math.pi, 200)[1:]
    circle = 20.0 * np.stack((np.cos(angles) - 1.0, np.sin(angles), 0.0 * angles), axis=1)
    dense = time_path(around(*circle, tolerance=2e-5), WORKSPACE, LIMITS, SHAPER)
    assert dense.duration < 0.4 * len(circle) * SHAPER.duration
    # What is to be driven slowly does not stop.
    slow = time_path(around(*corner, tolerance=2e-4, speed=1e-2), WORKSPACE, LIMITS, SHAPER)
    assert slow.duration < 0.08 / 1e-2 + 2.0 * SHAPER.duration


def test_a_long_shaped_motion_beside_an_edge_is_proved_to_be_inside():
    slow = around((2.5, 0.0, 0.0), (2.5, 2.5, 0.0), tolerance=5e-5, speed=1e-3)
    fast = SliderLimits.uniform(1.0, 40.0, 1000.0)
    highest = START[2] + 1e-5
    flat = replace(WORKSPACE.limits, box_lower=(-1.0, -1.0, 0.0), box_upper=(1.0, 1.0, highest))
    assert time_path(slow, Workspace(MACHINE, flat), fast, SHAPER).duration > 4.5


def test_at_a_corner_without_tolerance_the_shaper_becomes_empty():
    path = around((40.0, 0.0, 0.0), (40.0, 40.0, 0.0))
    motion = time_path(path, WORKSPACE, LIMITS, SHAPER)
    times = np.arange(0.0, motion.duration + DT, DT)
    alone = MACHINE.forward_batch(motion.sample(times).heights) - START
    for places in (offsets_of(path), alone):
        beside = np.minimum(np.abs(places[:, 1]), np.abs(places[:, 0] - 0.04))
        assert beside.max() < 1e-12
        at_corner = np.linalg.norm(places - (0.04, 0.0, 0.0), axis=1) < 1e-9
        assert at_corner.any()


def test_a_speed_that_is_asked_for_holds_though_speeds_are_averaged():
    path = PlatformPath.start(START)
    for x, speed in ((40.0, None), (60.0, 0.1), (100.0, None)):
        path = path.line_to(np.add(START, (1e-3 * x, 0.0, 0.0)), 1e-3, speed)
    places = offsets_of(path)
    speeds = np.diff(places[:, 0]) / DT
    slow = (places[:-1, 0] > 0.04) & (places[1:, 0] < 0.06)
    assert slow.sum() > 50
    assert speeds[slow].max() <= 0.1 * (1.0 + 1e-6)
    assert speeds.max() > 0.3


def test_a_bend_without_tolerance_is_refused_and_nothing_changes():
    centre = np.add(START, (0.0, 0.02, 0.0))
    path = PlatformPath.start(START).arc_about(centre, (0.0, 0.0, 1.0), 2.0)
    moving = at_start(path)
    with pytest.raises(CutBendError, match="segment 1 of the path bends and has the tolerance 0"):
        moving.follow(path)
    assert moving.phase is MotionPhase.IDLE
    with pytest.raises(CutBendError):
        time_path(path, WORKSPACE, LIMITS, SHAPER)
    same = PlatformPath.start(START).arc_about(centre, (0.0, 0.0, 1.0), 2.0, tolerance=2e-4)
    moving.follow(same)
    places = MACHINE.forward_batch(run_to_rest(moving))
    away = np.abs(np.linalg.norm(places - centre, axis=1) - 0.02)
    assert 2e-5 < away.max() <= 2e-4


def test_it_may_be_paused_stopped_and_gone_on_with():
    path = around(*SQUARE, tolerance=1e-3)
    moving = following(path)
    for seconds, act in (
        (0.2, moving.pause),
        (0.4, moving.resume),
        (0.25, moving.pause),
        (0.03, moving.resume),
    ):
        run(moving, seconds)
        act()
    run_to_rest(moving)
    assert_rests_at(moving, path.end)
    assert_inside_square(moving.places_since())


def test_it_may_be_extended_in_motion_at_its_end_and_after_a_change_of_shaper():
    moving = following(around(*SQUARE[:2], tolerance=1e-3))
    run(moving, 0.3)
    moving.extend(PlatformPath.through(START + 1e-3 * np.array(SQUARE[1:3]), 1e-3))
    run_to_rest(moving)
    for shaper in (SHAPER, None, SHAPER):
        moving.set_shaper(shaper)
        end = MACHINE.forward(moving.state.heights)
        moving.extend(PlatformPath.start(end).line_to(np.add(end, (0.005, 0.01, 0.0)), 1e-3))
        run_to_rest(moving)
        assert moving.kept_limits
    assert moving.path_progress.deviation <= 1e-3 * (1.0 + 1e-9)


@each_mode
def test_a_next_part_that_is_not_proved_ends_the_path_with_the_reason(monkeypatch, in_pieces):
    # A path in motion, as one from rest is refused at once; from some time on nothing is proved.
    moving = following(around(*SQUARE), in_pieces=in_pieces)
    run(moving, 0.1, math.inf)
    tried = []

    def unproved(*_):
        tried.append(moving.time_to_rest)
        raise CutBendError(0, 2.0)
        yield

    monkeypatch.setattr(ShapedTrajectory, "limit_use", unproved)
    run_to_rest(moving)
    assert moving.kept_limits
    assert isinstance(moving.take_refusal(), CutBendError)
    assert moving.remaining == 0.0
    # It is tried once where it is due, and once at rest.
    assert 1 <= len(tried) <= 2
