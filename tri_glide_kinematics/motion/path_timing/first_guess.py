"""First guesses of the speed along a path, from which the solver begins."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.path_timing.grid import TimingGrid
from tri_glide_kinematics.motion.trajectory import PathHeights, RuckigPlanner, TimeScaling, evaluate
from tri_glide_kinematics.vectors import FloatArray

# Part of the limits with which a motion is made slower in a guess.
_GENTLE = 0.3

# Part of the accelerations with which a guess gets faster and slower from place to place.
_FLAT = 0.1

# Steps of Newton's method from times between knots.
_NEWTON_STEPS = 4

# Next to the rest at the end of a window, where the way hardly depends on the parameter, a guess is
# no larger than this multiple of the largest, and found with this slope at least.
_MOST = 2.0
_LEAST_SLOPE = 1e-6


def first_guess(
    curve: PathHeights,
    grid: TimingGrid,
    start: tuple[float, float, float],
    limits: SliderLimits,
    held: TimeScaling | None,
) -> FloatArray:
    """Return coefficients of a spline that is rather slow: near what steady speeds allow.

    A motion that goes on becomes so slow first: as a held one does, or gently.

    Args:
        curve: the path.
        grid: cells of the window.
        start: place [m], speed [m/s] and acceleration [m/s^2].
        limits: of the sliders.
        held: a motion from the start to rest that keeps the limits, if there is one.
    """
    slow = _steady(grid)
    count = len(grid.cells.parameters) - 1
    if start[1] == 0.0:
        return np.concatenate((slow[:1], slow, slow[-1:]))
    slow = np.minimum(slow, start[1] ** 2)
    if held is None:
        held = _slowing(curve, start, float(slow.min()) ** 0.5, limits)
    if held is None:
        return np.concatenate((slow[:1], slow, slow[-1:]))
    parameters = grid.cells.parameters
    middles = grid.cells.rest_map.derivatives(0.5 * (parameters[1:] + parameters[:-1]))
    slopes = np.concatenate((grid.cells.ways[1], middles[1]))
    ways = np.concatenate((grid.cells.ways[0], middles[0]))
    speeds = np.where(ways < held.ways[-1], _speeds(held, ways), 0.0)
    fastest = _MOST * float(held.speeds.max()) ** 2
    values = np.square(speeds / np.maximum(slopes, _LEAST_SLOPE))
    floor = np.concatenate((slow, slow[-1:], slow))
    values = np.maximum(np.minimum(values, fastest), floor)
    ends, inside = values[: count + 1], values[count + 1 :]
    # The control point that leads a quadratic through all three.
    points = np.maximum(2.0 * inside - 0.5 * (ends[1:] + ends[:-1]), 0.5 * inside)
    return np.concatenate((ends[:1], points, ends[-1:]))


def _steady(grid: TimingGrid) -> FloatArray:
    """Return a b that steady speeds allow, and that changes slowly. Shape (n,)."""
    _, second, highest, lowest = grid.heights
    third = np.maximum(np.abs(highest), np.abs(lowest))
    acceleration, jerk, added = grid.limits[1:]
    with np.errstate(divide="ignore"):
        steady = np.minimum(
            (acceleration / np.abs(second)).min(axis=(0, 1)),
            np.square(np.cbrt((jerk / third).min(axis=(0, 1)))),
        )
        slopes = (acceleration / np.abs(grid.heights.first)).min(axis=(0, 1))
        if len(added.squared):
            steady = np.minimum(steady, 0.5 / np.abs(added.squared).max(axis=0))
            slopes = np.minimum(slopes, 1.0 / np.abs(added.acceleration).max(axis=0))
        slopes = 2.0 * _FLAT * slopes
    steady = np.minimum(steady, grid.limits.squared_speed)
    spans = np.diff(grid.cells.parameters)
    # Next to rest the heights hardly depend on the parameter; no slope has to be so large there.
    with np.errstate(divide="ignore"):
        slopes = np.minimum(slopes, steady.max() / spans)
    reach = np.cumsum(slopes * spans)
    steady = np.minimum.accumulate(steady - reach) + reach
    return np.asarray(np.minimum.accumulate((steady + reach)[::-1])[::-1] - reach)


def _slowing(
    curve: PathHeights, start: tuple[float, float, float], speed: float, limits: SliderLimits
) -> TimeScaling | None:
    """Return how a motion gets another ``speed`` [m/s], gently; None if ruckig finds no way."""
    slopes = np.abs(curve.derivatives(np.array(start[:1])).heights[1, :, 0])
    # A slider that rests for a moment, as where the platform passes its axis, bounds nothing.
    with np.errstate(divide="ignore"):
        _, acceleration, jerk = (_GENTLE * (limits.table / slopes).min(axis=1)).tolist()
    bounds = ([1.0], [acceleration], [jerk])
    try:
        (phases,) = RuckigPlanner(1).to_velocity([speed], [start[1]], [start[2]], bounds)
    except PlanningError:
        return None
    phases = [(duration, jerk) for duration, jerk in phases if duration > 1e-9]
    if not phases:
        return None
    times = np.concatenate(((0.0,), np.cumsum([duration for duration, _ in phases])))
    return TimeScaling(*evaluate(phases, start, times))


def _speeds(scaling: TimeScaling, ways: FloatArray) -> FloatArray:
    """Return the speeds of a ``scaling`` at ``ways`` [m]; behind its end, the last. Shape (n,)."""
    times = np.interp(ways, np.maximum.accumulate(scaling.ways), scaling.times)
    for _ in range(_NEWTON_STEPS):
        way, speed, _ = scaling.evaluate(times)
        times = times - (way - ways) / np.maximum(speed, 1e-3 * scaling.speeds.max())
        times = np.clip(times, 0.0, scaling.times[-1])
    return scaling.evaluate(times)[1]
