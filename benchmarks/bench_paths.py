"""Paths without a stop: how near the optimum their timing is, and what it costs.

Whether they keep all limits is judged by ``soak_paths``, how calm they are by ``bench_smoothness``.

Run it as ``python -m benchmarks.bench_paths --count 100`` for more random paths than the table of
all benchmarks has.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, MACHINE
from benchmarks.references import square_optimum
from benchmarks.table import Row, print_rows
from testing.pieces import timed
from tri_glide_kinematics.interruptible import at_once
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
    """Yield times and costs."""
    yield from _random_rows(count)
    yield from _square_rows()
    yield from _dense_rows()


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
    """Yield how random paths compare with the reference."""
    chance = np.random.default_rng(12)
    drives = []
    ratios = []
    least_time = optimum()
    for _ in range(count):
        path = _random_path(chance)
        driven = drive(path)
        drives.append(driven)
        if least_time is not None:
            curve = PathHeights(path.driven, DEFAULT_GEOMETRY)
            ratios.append(driven.duration / least_time(curve, driven.motion, LIMITS))
    if ratios:
        what = f"time of {count} random paths over copp-py's TOPP3"
        yield Row.at_most(f"{what}, median", float(np.median(ratios)), 1.05, ".4f")
        yield Row.at_most(f"{what}, 99 %", float(np.quantile(ratios, 0.99)), 1.25, ".4f")
    yield _broken(drives)


def _broken(drives: Sequence[Drive]) -> Row:
    """Return the row of windows that could not be continued."""
    broken, windows = (sum(counts) for counts in zip(*(drive[-2:] for drive in drives)))
    return Row("windows that could not be continued", f"{broken} of {windows}", "0", broken == 0)


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


def optimum() -> Callable[..., float] | None:
    """Return the least time by another optimiser; None if it is not installed."""
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
    yield _broken([driven])


if __name__ == "__main__":
    run(numbers(__doc__, count=(12, "random paths")).count)
