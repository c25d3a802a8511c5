import numpy as np
import pytest
from motion_machine import DT, LIMITS, MACHINE, WORKSPACE, within
from soak import some
from timed_paths import AT_BEGIN, dense_path, driven, random_path, seen

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.motion.errors import PathTimingError, PlanningError
from tri_glide_kinematics.motion.moves import LineTiming
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path_timing import grid as timing_grid
from tri_glide_kinematics.motion.path_timing import plan_window, time_path
from tri_glide_kinematics.motion.path_timing import windows as path_timing
from tri_glide_kinematics.motion.path_timing.grid import MOST_PIECES
from tri_glide_kinematics.motion.trajectory import PathStart, StraightLine, check_along
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY

SQUARE = [(0.0, 0.0), (0.04, 0.0), (0.04, 0.04), (0.0, 0.04), (0.0, 0.0)]


def square(tolerance):
    points = np.array([(x - 0.02, y - 0.02, 0.3) for x, y in SQUARE])
    return PlatformPath.through(points, tolerance=tolerance)


def duration(path, limits=LIMITS):
    return driven(seen(path), limits).duration


OTHERS = [(0.3, 10.0, 200.0), (1.0, 2.0, 200.0), (2.0, 30.0, 5000.0)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "limits"),
    [
        *((seed, LIMITS) for seed in some(range(12), 4)),
        *((3, SliderLimits.uniform(*other)) for other in OTHERS),
    ],
)
def test_limits_hold_by_bounds_and_by_differences(seed, limits):
    curve = seen(random_path(seed))
    found = driven(curve, limits)
    for window in found.windows:
        check_along(curve, window.scaling, limits)
    assert within(curve.derivatives(found.ways).heights[0].T, limits)


@pytest.mark.parametrize("jerk", [30.0, 2000.0])
@pytest.mark.parametrize("speed", [1e-3, 1e-2])
def test_slow_speeds_are_driven_as_asked_and_without_stops(speed, jerk):
    points = np.array(((0.0, 0.0), (1.0, 0.2), (0.6, 1.0))) * 0.7 * speed
    path = PlatformPath.through([(x, y, 0.3) for x, y in points], 1e-5, speed)
    limits = SliderLimits.uniform(1.0, 10.0, jerk)
    motion = time_path(path, WORKSPACE, limits)
    assert motion.duration == pytest.approx(path.driven.arc_length.total / speed, rel=0.03)
    moving = np.arange(0.1, motion.duration - 0.1, 0.01)
    places = MACHINE.forward_batch(motion.sample(moving).heights)
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / 0.01
    assert speeds.max() <= speed * (1.0 + 1e-9)
    # Only the rounded corner is shorter than what is programmed.
    assert np.median(speeds) >= 0.999 * speed
    assert speeds.min() > 0.3 * speed


@pytest.mark.parametrize("seed", range(6))
def test_no_tolerance_is_so_small_that_a_path_crawls(seed):
    chance = np.random.default_rng(seed)
    stopped = rounded = PlatformPath.start((0.0, 0.0, 0.28))
    tolerance = 10.0 ** chance.uniform(-8.0, -5.0)
    for _ in range(3):
        centre, axis = stopped.end + chance.normal(0.0, 0.015, 3), chance.normal(size=3)
        angle = chance.uniform(1.0, 4.0)
        stopped = stopped.arc_about(centre, axis, angle)
        rounded = rounded.arc_about(centre, axis, angle, tolerance)
    durations = [time_path(path, WORKSPACE, LIMITS).duration for path in (rounded, stopped)]
    assert durations[0] < 1.1 * durations[1]


@pytest.mark.parametrize("seed", range(4))
def test_the_way_back_takes_as_long(seed):
    path = random_path(seed, most=4)
    assert duration(path.reversed()) == pytest.approx(duration(path), rel=0.01)


@pytest.mark.parametrize("seed", range(4))
def test_larger_limits_are_no_slower(seed):
    path = random_path(seed, most=4)
    base = duration(path)
    for changed in ((1.2, 10.0, 200.0), (1.0, 12.0, 200.0), (1.0, 10.0, 240.0)):
        assert duration(path, SliderLimits.uniform(*changed)) < base * 1.01


def test_the_same_in_other_units_of_time():
    """Limits of a machine that is k times slower give the same motion in k times the time."""
    path, k = square(1e-3), 3.0
    slow = SliderLimits.uniform(1.0 / k, 10.0 / k**2, 200.0 / k**3)
    assert duration(path, slow) == pytest.approx(k * duration(path), rel=1e-3)


@pytest.mark.parametrize("end", [(0.1, 0.05, 0.3), (-0.06, -0.1, 0.27), (-0.09, 0.0, 0.32)])
def test_a_straight_path_takes_no_longer_than_a_line(end):
    start = (-0.1, 0.0, 0.3)
    line = StraightLine.between(DEFAULT_GEOMETRY, start, end)
    expected = at_once(LineTiming().from_rest(line, LIMITS)).times[-1]
    ours = duration(PlatformPath.start(start).line_to(end))
    assert 0.8 * expected < ours < 1.02 * expected


def test_rounded_corners_are_faster_than_stops():
    assert duration(square(1e-3)) < 0.92 * duration(square(0.0))


def test_corners_without_tolerance_are_stops():
    curve = seen(square(0.0))
    found = driven(curve)
    assert [window.ends_at for window in found.windows] == pytest.approx([0.04, 0.08, 0.12, 0.16])
    assert all(window.continue_at == window.duration for window in found.windows)


@pytest.mark.parametrize("path", [dense_path(2500), random_path(21, most=30)])
def test_windows_go_on_without_a_jump(path):
    curve = seen(path)
    found = driven(curve)
    assert len(found.windows) > 1
    on_the_way = [start for start in found.starts if start.speed > 0.0]
    assert on_the_way
    for window, start in zip(found.windows, found.starts):
        begin = tuple(float(values[0]) for values in window.scaling[1:])
        assert begin == pytest.approx(start, rel=0.0, abs=1e-12)
        # Whatever is held comes to rest.
        assert window.scaling.speeds[-1] == 0.0 and window.scaling.accelerations[-1] == 0.0
        check_along(curve, window.scaling, LIMITS)


def test_a_short_first_window_costs_no_time(monkeypatch):
    curve = seen(dense_path(2500))
    short = driven(curve)
    for module in (path_timing, timing_grid):
        monkeypatch.setattr(module, "FIRST_PIECES", MOST_PIECES)
    whole = driven(curve)
    first, last = np.searchsorted(curve.driven.breaks, short.windows[0].scaling.ways[[0, -1]])
    assert last - first < 0.25 * MOST_PIECES
    assert short.duration < 1.05 * whole.duration


def test_the_platform_speed_is_kept():
    curve = seen(dense_path(800, speed=0.1))
    found = driven(curve)
    places = curve.driven.derivatives(found.ways, 0)[0]
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / DT
    assert speeds.max() <= 0.1 * (1.0 + 1e-6)
    assert np.median(speeds) > 0.097


def test_planning_is_done_in_short_pieces():
    curve = seen(dense_path(1000))
    pieces = sum(1 for _ in plan_window(curve, AT_BEGIN, LIMITS))
    assert pieces > 20


def test_a_motion_that_cannot_stop_in_time_is_refused_with_its_place():
    curve = seen(random_path(2))
    start = PathStart(curve.driven.length - 1e-3, 0.8, 0.0)
    with pytest.raises(PathTimingError, match=r"segment \d+ of the path, .* m along it") as refused:
        at_once(plan_window(curve, start, LIMITS))
    assert 0.0 <= refused.value.place <= curve.driven.length


def test_out_of_reach_there_is_none():
    path = PlatformPath.start((0.0, 0.0, 0.3)).line_to((0.6, 0.0, 0.3))
    with pytest.raises(PathTimingError, match=r"segment 1 of the path, .* reach") as refused:
        at_once(plan_window(seen(path), AT_BEGIN, LIMITS))
    # Arms of 0.4 m from anchors at 0.2 m reach 0.2 m at least, and less than 0.4 m.
    assert 0.2 < refused.value.place < 0.4


def test_at_the_end_there_is_none():
    curve = seen(random_path(1))
    with pytest.raises(PlanningError, match="at its end"):
        at_once(plan_window(curve, PathStart(curve.driven.length, 0.0, 0.0), LIMITS))


def test_at_a_speed_that_the_path_asks_for_the_motion_is_steady():
    path = PlatformPath.start((-0.06, 0.0, 0.3)).line_to((0.06, 0.0, 0.3), speed=0.25)
    scaling = at_once(plan_window(seen(path), AT_BEGIN, LIMITS)).scaling
    total = float(scaling.times[-1])
    _, _, accelerations = scaling.evaluate(np.arange(0.35 * total, 0.65 * total, DT))
    # At most a thousandth of what the sliders are allowed.
    assert np.abs(np.diff(accelerations) / DT).max() < 0.2
