r"""How far linear moves are from time-optimal: random ones against a lower bound of their duration.

No motion along a line can be faster than two bounds allow (docs/motion.md derives them):

- each slider alone has to go its way, with a turn at the extreme height if it has one inside;
- with $\Sigma = \int \max_i |h_i'| / V_i\, ds$, the fastest slider covers $\Sigma$ at a rate that
  is at most $\rho(t)$ after the start and before the end, where $\rho$ is the largest part of its
  velocity limit that any slider can have reached: $\Sigma \le 2 \int_0^{T/2} \rho\, dt$.

Run it as ``python -m benchmarks.linear_moves --moves 10000``; it exits with 1 if a requirement of
the measurement is not met.
"""

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, MACHINE, WIDE
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limit_use import CommandStream, LimitUse, are_within
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.moves import LinearMotion
from tri_glide_kinematics.motion.trajectory import StraightLine
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace

WORKSPACE = Workspace(MACHINE, WIDE)

DT = 0.001
LARGEST_RATIO = 1.5
LARGEST_MEDIAN = 1.2
LARGEST_DEVIATION = 1e-6

# Points of a line at which slopes are integrated.
POINTS = 1001


def rise_time(speed: float, acceleration: float, jerk: float) -> float:
    """Return how long it takes at least from rest to steady motion at ``speed``."""
    if speed * jerk <= acceleration * acceleration:
        return 2.0 * math.sqrt(speed / jerk)
    return speed / acceleration + acceleration / jerk


def speed_after(times: FloatArray, speed: float, acceleration: float, jerk: float) -> FloatArray:
    """Return the largest speed reached in ``times`` from rest if ``speed`` is never passed.

    It is the curve of constant jerk, then acceleration, then jerk that leads to steady motion: no
    other motion is faster at any time without being too fast later.
    """
    total = rise_time(speed, acceleration, jerk)
    ramp = min(acceleration / jerk, 0.5 * total)
    start = 0.5 * jerk * np.square(np.minimum(times, ramp))
    middle = jerk * ramp * np.clip(times - ramp, 0.0, total - 2.0 * ramp)
    rest = ramp - np.clip(times - (total - ramp), 0.0, ramp)
    return np.asarray(start + middle + 0.5 * jerk * (ramp * ramp - rest * rest))


def time_between_rests(way: float, speed: float, acceleration: float, jerk: float) -> float:
    """Return the least time from rest to rest over ``way``."""
    top = _top_speed(way, speed, lambda v: v * rise_time(v, acceleration, jerk))
    covered = top * rise_time(top, acceleration, jerk)
    return 2.0 * rise_time(top, acceleration, jerk) + (way - covered) / top


def time_to_turn(way: float, speed: float, acceleration: float, jerk: float) -> float:
    """Return the least time from rest over ``way`` to a turn, where only the speed is zero."""

    def falling(v: float) -> tuple[float, float]:
        """Return time and way from steady motion at ``v`` until the speed is zero."""
        ramp = min(math.sqrt(2.0 * v / jerk), acceleration / jerk)
        left = max(v - 0.5 * jerk * ramp * ramp, 0.0)
        return (
            ramp + left / acceleration,
            v * ramp - jerk * ramp**3 / 6.0 + 0.5 * left * left / acceleration,
        )

    def covers(v: float) -> float:
        return 0.5 * v * rise_time(v, acceleration, jerk) + falling(v)[1]

    top = _top_speed(way, speed, covers)
    return rise_time(top, acceleration, jerk) + falling(top)[0] + (way - covers(top)) / top


def lower_bound(line: StraightLine, limits: SliderLimits) -> float:
    """Return a time that no motion from rest to rest along ``line`` can undercut [s]."""
    ways = np.linspace(0.0, line.length, POINTS)
    heights, slopes = line.derivatives(ways).heights[:2]
    rates = np.abs(slopes) / np.array(limits.velocity)[:, np.newaxis]
    fastest = rates.max(axis=0)
    total = float((0.5 * (fastest[1:] + fastest[:-1]) * np.diff(ways)).sum())
    drives = list(zip(limits.velocity, limits.acceleration, limits.jerk))
    alone = 0.0
    for height, drive in zip(heights, drives):
        top = int(height.argmax())
        if 0 < top < POINTS - 1:
            falls = (height[top] - height[0], height[top] - height[-1])
            time = sum(time_to_turn(float(fall), *drive) for fall in falls)
        else:
            time = time_between_rests(abs(float(height[-1] - height[0])), *drive)
        alone = max(alone, time)
    return max(alone, _time_together(total, limits))


@lru_cache(maxsize=8)
def _course_together(limits: SliderLimits) -> tuple[FloatArray, FloatArray]:
    r"""Return times and how much of $\Sigma$ can be covered by then, both in [s]."""
    drives = list(zip(limits.velocity, limits.acceleration, limits.jerk))
    times = np.linspace(0.0, max(rise_time(*drive) for drive in drives), 20_001)
    rates = np.max([speed_after(times, *drive) / drive[0] for drive in drives], axis=0)
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(times)
    return times, np.concatenate(([0.0], np.cumsum(steps)))


def _time_together(total: float, limits: SliderLimits) -> float:
    times, covered = _course_together(limits)
    half = 0.5 * total
    if half >= covered[-1]:
        return 2.0 * float(times[-1] + half - covered[-1])
    return 2.0 * float(np.interp(half, covered, times))


def _top_speed(way: float, speed: float, covers: Callable[[float], float]) -> float:
    """Return the speed, up to ``speed``, at which ``covers`` gives the ``way``, by bisection."""
    if covers(speed) <= way:
        return speed
    low, high = 0.0, speed
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if covers(middle) < way else (low, middle)
    return max(low, 1e-12)


@dataclass
class Measurement:
    """What many linear moves have shown.

    Attributes:
        ratios: duration of each, as a multiple of its lower bound. Shape (n,).
        deviation: largest distance from the line [m].
        peaks: largest finite difference of velocity, acceleration and jerk as a part of the limit.
    """

    ratios: FloatArray
    deviation: float
    peaks: FloatArray


def random_moves(count: int, seed: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield starts and ends of straight moves inside the workspace."""
    rng = np.random.default_rng(seed)
    while count:
        start, end = rng.uniform((-0.25, -0.25, -0.1), (0.25, 0.25, 0.8), (2, 3))
        try:
            WORKSPACE.check_segment(start, end)
        except KinematicsError:
            continue
        count -= 1
        yield start, end


def along_and_beside(
    places: FloatArray, start: FloatArray, direction: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how far places are along a line from ``start``, and beside it. Both (n,) [m]."""
    offsets = places - start
    along = offsets @ direction
    beside = np.linalg.norm(offsets - along[:, np.newaxis] * direction, axis=1)
    return along, beside


def measure(count: int, seed: int) -> Measurement:
    """Plan random moves and check each setpoint of a 1 kHz control loop."""
    motion = LinearMotion(MACHINE)
    ratios, deviation, peaks = [], 0.0, np.zeros(3)
    for start, end in random_moves(count, seed):
        line = StraightLine.between(MACHINE.geometry, start.tolist(), end.tolist())
        plan = motion.from_rest(line, LIMITS)
        ratios.append(plan.duration / lower_bound(line, LIMITS))
        times = np.arange(-3.0, plan.duration / DT + 4.0) * DT
        heights = plan.sample(np.maximum(times, 0.0)).heights
        use = LimitUse.of(CommandStream.from_heights(heights, DT), LIMITS)
        peaks = np.maximum(peaks, use.largest)
        places = MACHINE.forward_batch(heights)
        _, beside = along_and_beside(places, start, np.array(line.direction))
        deviation = max(deviation, float(beside.max()))
    return Measurement(np.array(ratios), deviation, peaks)


def tell(count: int, seed: int) -> int:
    """Measure, print what was found, and return the exit code."""
    found = measure(count, seed)
    quantiles = np.quantile(found.ratios, (0.0, 0.5, 0.9, 0.99, 1.0))
    print("duration over its lower bound: least, median, 90 %, 99 %, largest:", quantiles.round(4))
    print(f"largest deviation from the line {found.deviation:.3g} m")
    print("largest velocity, acceleration, jerk over the limits:", found.peaks.round(9))
    met = (
        found.ratios.max() <= LARGEST_RATIO
        and np.median(found.ratios) < LARGEST_MEDIAN
        and found.deviation < LARGEST_DEVIATION
        and are_within(found.peaks)
    )
    return 0 if met else 1


def main() -> int:
    """Measure as many moves as are asked for."""
    options = numbers(__doc__, moves=(10_000, "at random"), seed=(1, "of these"))
    return tell(options.moves, options.seed)


if __name__ == "__main__":
    sys.exit(main())
