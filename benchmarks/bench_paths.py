"""Paths without a stop: how near the optimum their timing is, what limits it uses, what it costs.

Run it as ``python -m benchmarks.bench_paths --count 100`` for more random paths than the table of
all benchmarks has.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, MACHINE
from benchmarks.references import square_optimum
from benchmarks.soak import engine_at
from benchmarks.table import Row, print_rows
from testing.jerk_on_paths import chatter, circle, polyline, square
from testing.pieces import timed
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import MotionPhase
from tri_glide_kinematics.motion.errors import MotionError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path_timing import plan_window
from tri_glide_kinematics.motion.trajectory import (
    PathHeights,
    PathPlan,
    PathStart,
    TimeScaling,
    derivative_bounds,
)
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY
from tri_glide_kinematics.vectors import FloatArray

PERIOD = 0.001  # s, at which heights are differentiated
SQUARE = np.array(
    [
        (-0.02, -0.02, 0.3),
        (0.02, -0.02, 0.3),
        (0.02, 0.02, 0.3),
        (-0.02, 0.02, 0.3),
        (-0.02, -0.02, 0.3),
    ]
)  # m
SQUARE_TOLERANCE = 1e-3  # m
SQUARE_STEPS = 160  # in time, of the linear program: 240 find 0.6 % less
CIRCLES = (0.01, 0.02, 0.04, 0.06)  # radii [m]
SPEEDS = (0.03, 0.05, 0.1, 0.2, 0.3, 0.4)  # m/s
JERKS = (200.0, 1000.0, 5000.0, 20_000.0, 50_000.0, 100_000.0, 1e6)  # m/s^3
COARSE_STEPS = (4, 20, 50, 300)  # ms
COARSE_JERK = 5000.0  # m/s^3
LOWER, UPPER = (-0.12, -0.12, 0.25), (0.12, 0.12, 0.35)  # m


class Drive(NamedTuple):
    """A whole path, driven in windows.

    Attributes:
        duration: [s].
        motion: the way along it over time.
        uses: largest parts of the limits of velocity, acceleration and jerk, by bounds.
        planning: processor time of all windows [s].
        longest: processor time of the longest piece of planning between two turns [s].
        broken: how many windows could not be continued, so that the platform stopped.
        windows: how many there are.
    """

    duration: float
    motion: TimeScaling
    uses: FloatArray
    planning: float
    longest: float
    broken: int
    windows: int


def run(count: int = 12) -> bool:
    """Measure and print the table; it is always complete."""
    return print_rows("paths", rows(count))


def rows(count: int) -> Iterable[Row]:
    """Yield times, uses of limits and costs."""
    yield from _random_rows(count)
    yield from _square_rows()
    yield from _dense_rows()
    yield from _chatter_rows()
    yield from _jerk_rows()
    yield from _coarse_rows()


def drive(path: PlatformPath, limits: SliderLimits = LIMITS) -> Drive:
    """Drive a path from its begin to its end, window after window."""
    curve = PathHeights(path.driven, DEFAULT_GEOMETRY)
    start, held = PathStart(0.0, 0.0, 0.0), None
    parts: list[TimeScaling] = []
    uses = np.zeros(3)
    now = planning = longest = 0.0
    windows = broken = 0
    last: PathPlan | None = None
    while start.place < curve.driven.length:
        windows += 1
        try:
            pieces: list[float] = []
            found = at_once(timed(plan_window(curve, start, limits, held), pieces))
        except MotionError:
            if last is None or start.speed == 0.0:
                raise
            # What is held goes on to its end, and the next window begins there.
            broken += 1
            rest = last.scaling.since(last.continue_at)
            parts.append(rest._replace(times=rest.times - last.continue_at + now))
            now += float(last.scaling.times[-1]) - last.continue_at
            start, held = PathStart(last.ends_at, 0.0, 0.0), None
            continue
        planning, longest = planning + sum(pieces), max(longest, *pieces)
        uses = np.maximum(uses, derivative_bounds(curve, found.scaling).parts(limits).max(axis=1))
        last, scaling = found, found.scaling
        if found.continue_at == found.duration:
            parts.append(scaling._replace(times=scaling.times + now))
            now += float(scaling.times[-1])
            start, held = PathStart(found.ends_at, 0.0, 0.0), None
        else:
            part = scaling.until(found.continue_at)
            parts.append(part._replace(times=part.times + now))
            now += found.continue_at
            here = scaling.evaluate(np.array([found.continue_at]))
            start = PathStart(*(float(values[0]) for values in here))
            held = scaling.since(found.continue_at)
    joined = [np.concatenate([part[i][:-1] for part in parts]) for i in range(4)]
    ends = (now, *(values[-1] for values in parts[-1][1:]))
    motion = TimeScaling(*(np.append(values, end) for values, end in zip(joined, ends)))
    return Drive(now, motion, uses, planning, longest, broken, windows)


def _random_path(chance: np.random.Generator) -> PlatformPath:
    points = chance.uniform(LOWER, UPPER, (int(chance.integers(3, 42)), 3))
    tolerance = float(np.exp(chance.uniform(math.log(5e-5), math.log(1e-2))))
    return PlatformPath.through(points, tolerance=tolerance)


def _random_rows(count: int) -> Iterable[Row]:
    """Yield how random paths compare with the reference, and their use of limits."""
    chance = np.random.default_rng(12)
    drives = []
    ratios = []
    least_time = _reference()
    for _ in range(count):
        path = _random_path(chance)
        driven = drive(path)
        drives.append((path, driven))
        if least_time is not None:
            curve = PathHeights(path.driven, DEFAULT_GEOMETRY)
            ratios.append(driven.duration / least_time(curve, driven.motion, LIMITS))
    if ratios:
        what = f"time of {count} random paths over copp-py's TOPP3"
        yield Row.at_most(f"{what}, median", float(np.median(ratios)), 1.05, ".4f")
        yield Row.at_most(f"{what}, 99 %", float(np.quantile(ratios, 0.99)), 1.25, ".4f")
    uses = np.max([driven.uses for _, driven in drives], axis=0)
    for name, use in zip(("velocity", "acceleration", "jerk"), uses.tolist()):
        yield Row(f"{name} by bounds, part of the limit", f"{use:.6f}", "1", use <= 1.0 + 1e-8)
    differences = np.max([differences_of(*each) for each in drives], axis=0)
    for name, use, more in zip(
        ("velocity", "acceleration", "jerk"), differences.tolist(), (1e-6, 1e-6, 1e-3)
    ):
        yield Row(
            f"{name} by differences at 1 kHz, part of the limit",
            f"{use:.6f}",
            f"1 + {more:g}",
            use <= 1.0 + more,
        )
    yield _broken("", [driven for _, driven in drives])


def _broken(what: str, drives: Sequence[Drive]) -> Row:
    """Return the row of windows that could not be continued."""
    broken, windows = (sum(counts) for counts in zip(*(drive[-2:] for drive in drives)))
    what = f"{what}windows that could not be continued"
    return Row(what, f"{broken} of {windows}", "0", broken == 0)


def differences_of(path: PlatformPath, driven: Drive) -> FloatArray:
    """Return the largest parts of the limits by differences of heights. Shape (3,)."""
    curve = PathHeights(path.driven, DEFAULT_GEOMETRY)
    ways, _, _ = driven.motion.evaluate(np.arange(0.0, driven.duration, PERIOD))
    values = curve.derivatives(ways).heights[0]
    result = []
    for limit in LIMITS.table:
        values = np.diff(values, axis=1) / PERIOD
        result.append(float((np.abs(values) / limit[:, np.newaxis]).max()))
    return np.array(result)


def _reference() -> Callable[..., float] | None:
    try:
        from benchmarks.references.path_optimum import least_time
    except ImportError:
        return None
    return least_time


def square_time(tolerance: float) -> float:
    """Return the time of a square of 40 mm with a ``tolerance`` [m] at its corners [s]."""
    return drive(PlatformPath.through(SQUARE, tolerance=tolerance)).duration


def _square_rows() -> Iterable[Row]:
    stopping = square_time(0.0)
    part = square_time(SQUARE_TOLERANCE) / stopping
    yield Row.at_most("time of a square of 40 mm, tolerance 1 mm, over that with stops", part, 0.75)
    tolerance = SQUARE_TOLERANCE
    for where, outside in (("inside", 0.0), ("on both sides of", tolerance)):
        least = square_optimum.least_time(MACHINE, SQUARE, LIMITS, tolerance, outside, SQUARE_STEPS)
        what = f"the same, the least of any path {where} the square, by a linear program"
        yield Row(what, f"{least / stopping:.3f}")


def _dense_rows() -> Iterable[Row]:
    """Yield what 10,000 segments of 0.1 mm cost."""
    angles = np.arange(10_001) * 1e-4 / 0.08
    course = (0.08 * np.cos(angles), 0.06 * np.sin(1.3 * angles), 0.3 + 0.02 * np.sin(0.7 * angles))
    path = PlatformPath.through(np.stack(course, axis=1), tolerance=2e-5)
    driven = drive(path)
    each = 1e3 * driven.planning / 10_000
    yield Row.at_most("planning per segment of 10,000 segments of 0.1 mm", each, 1.0, unit=" ms")
    yield Row.at_most("longest piece of planning", 1e3 * driven.longest, 2.0, ".2f", " ms")
    yield _broken("", [driven])


def _chatter_rows() -> Iterable[Row]:
    """Yield how calm the jerk is where paths ask for a speed (``testing/jerk_on_paths.py``)."""
    shapes: list[tuple[Callable[[float | None], PlatformPath], int]] = []
    # A path has so many corners; the places where it begins and ends count as one.
    for radius in CIRCLES:
        shapes.append((partial(circle, radius), 1))
    for side, tolerance in ((0.04, 1e-3), (0.04, 2e-4), (0.08, 1e-3)):
        shapes.append((partial(square, side, tolerance=tolerance), 4))
    for seed in (1, 2, 3, 4):
        shapes.append((partial(polyline, seed), 7))
    for name, speeds in (("0.03 to 0.4 m/s", SPEEDS), ("full speed", (None,))):
        fast, turns, most, drives = [], [], [], []
        for speed in speeds:
            for shape, corners in shapes:
                path = shape(speed)
                driven = drive(path)
                curve = PathHeights(path.driven, DEFAULT_GEOMETRY)
                found = chatter(curve, driven.motion, LIMITS)
                fast.append(found.fast)
                turns.append(found.turns / driven.duration)
                most.append(found.turns / max(20.0 * driven.duration, 6.0 * corners))
                drives.append(driven)
        what = f"circles, squares and polylines, {name}: "
        median, largest = float(np.median(fast)), max(fast)
        over = sum(part > 1.0 for part in most)
        told = (
            Row(
                f"{what}energy of the jerk above 100 Hz, median; most",
                f"{100 * median:.1f} %; {100 * largest:.1f} %",
                "5 %; 10 %",
                median <= 0.05 and largest <= 0.1,
            ),
            Row.at_most(
                f"{what}sign changes of the jerk per second, median",
                float(np.median(turns)),
                20.0,
                ".1f",
            ),
            Row(
                f"{what}more than 20 a second and than six a corner",
                f"{over} of {len(most)}",
                "0",
                over == 0,
            ),
        )
        for row in told:
            yield row if speeds is SPEEDS else row._replace(goal="-", is_reached=None)
        yield _broken(what, drives)


def _jerk_rows() -> Iterable[Row]:
    """Yield what more jerk than before costs: times, and processor time."""
    paths = [circle(radius) for radius in CIRCLES]
    paths += [square(0.04), polyline(1), polyline(2), circle(0.04, 0.1)]
    times = np.empty((len(JERKS), len(paths)))
    drives: list[Drive] = []
    for i, jerk in enumerate(JERKS):
        limits = SliderLimits.uniform(1.0, 10.0, jerk)
        for j, path in enumerate(paths):
            driven = drive(path, limits)
            times[i, j] = driven.duration
            drives.append(driven)
    lower = np.minimum.accumulate(times, axis=0)[:-1]
    ratio = float((times[1:] / lower).max())
    until = f"jerk limits from {JERKS[0]:g} to {JERKS[-1]:g} m/s^3"
    yield Row.at_most(f"{until}: time over the best of all lower ones, most", ratio, 1.01, ".4f")
    of_circle = ", ".join(f"{value:.3f}" for value in times[:, CIRCLES.index(0.04)])
    yield Row("the same, time of a circle of 40 mm radius at full speed", f"{of_circle} s")
    worst = max(float(driven.uses.max()) for driven in drives)
    yield Row(f"{until}: bounds, part of the limits", f"{worst:.6f}", "1", worst <= 1.0 + 1e-8)
    costs = [driven.planning / driven.duration for driven in drives]
    told = f"{np.median(costs):.2f} s; {max(costs):.2f} s"
    yield Row(f"{until}: planning per second of motion, median; most", told)
    yield _broken(f"{until}: ", drives)


def _coarse_rows() -> Iterable[Row]:
    """Yield how far setpoints of long steps are from those of short ones at the same times."""
    fine = _stepped(1)
    worst, compared = 0.0, 0
    for step in COARSE_STEPS:
        coarse = _stepped(step)[:-1]
        worst = max(worst, float(np.abs(coarse - fine[::step][: len(coarse)]).max()))
        compared += len(coarse)
    steps = ", ".join(f"{step}" for step in COARSE_STEPS)
    what = f"circle in steps of {steps} ms: from those of 1 ms at {compared} times, most"
    yield Row.at_most(what, worst, 1e-12, ".1g", " m")


def _stepped(step: int) -> FloatArray:
    """Return the heights on a circle of 40 mm radius, from rest to rest. Shape (n, 3) [m].

    Args:
        step: length of each step [ms].
    """
    limits = SliderLimits.uniform(1.0, 10.0, COARSE_JERK)
    moving = engine_at((0.04, 0.0, 0.3), limits)
    moving.follow(circle(0.04))
    heights = [moving.state.heights]
    while moving.phase is not MotionPhase.IDLE:
        heights.append(moving.step(step * PERIOD).heights)
    return np.array(heights)


if __name__ == "__main__":
    run(numbers(__doc__, count=(12, "random paths")).count)
