"""Brakings along a path: to rest soon, wherever that is."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.moves import hardest_braking
from tri_glide_kinematics.motion.path_timing.windows import plan_window
from tri_glide_kinematics.motion.trajectory import (
    MotionError,
    PathHeights,
    PathScaling,
    PathStart,
    PlanningError,
    RuckigPlanner,
    SliderLimits,
    TimeScaling,
    check_path_limits,
    evaluate,
    total_duration,
)

# Where a hard braking begins at the speed that the path asks for, its few pieces bound the speed no
# better than to this part.
_ABOVE_SPEED = 0.01

# A braking leads so much farther, one after another, than one that only the slopes limit.
_FARTHER = (1.15, 1.6, 2.5, 4.0)


def brake_hard(
    curve: PathHeights, start: PathStart, limits: SliderLimits, longest: float
) -> Interruptible[PathScaling]:
    """Return the hardest braking along the path.

    Args:
        curve: the path.
        start: where the motion is, inside all limits.
        limits: of the sliders.
        longest: time that it may take [s].

    Raises:
        MotionError: if it does not keep all limits, or takes longer.
    """
    scaling = TimeScaling(
        *hardest_braking(
            lambda ways: tuple(curve.derivatives(ways).heights[1:]),
            start,
            limits,
            until=_next_stop(curve, start.place),
            longest=longest,
        )
    )
    yield
    check_path_limits(curve, scaling, limits, above=_ABOVE_SPEED)
    return PathScaling(scaling, np.inf)


def brake(curve: PathHeights, start: PathStart, limits: SliderLimits) -> Interruptible[PathScaling]:
    """Return a motion that comes to rest soon, along the path.

    Args:
        curve: the path.
        start: where the motion is, inside all limits.
        limits: of the sliders.

    Raises:
        PlanningError: if none is found from here, or if there is nothing to brake.
    """
    if not start.speed > 0.0:
        raise PlanningError("the platform rests")
    stop = _next_stop(curve, start.place)
    shortest = _shortest(curve, start, limits)
    for factor in _FARTHER:
        until = min(start.place + factor * shortest, stop)
        try:
            found = yield from plan_window(curve, start, limits, until=until)
            return PathScaling(found.scaling, np.inf)
        except MotionError:
            if until == stop:
                break
    raise PlanningError("no braking along the path keeps the limits from here")


def _next_stop(curve: PathHeights, place: float) -> float:
    """Return the place of the next stop behind a ``place`` on the path [m]."""
    stops = curve.driven.stops
    return float(stops[min(int(np.searchsorted(stops, place, "right")), len(stops) - 1)])


def _shortest(curve: PathHeights, start: PathStart, limits: SliderLimits) -> float:
    """Return how far the platform goes on if it brakes as the slopes of the heights here allow [m].

    Raises:
        PlanningError: if ruckig finds no braking.
    """
    slopes = np.abs(curve.derivatives(np.array([start.place])).heights[1])
    _, acceleration, jerk = (limits.table[..., np.newaxis] / slopes).min(axis=(1, 2)).tolist()
    # A path that begins to bend leaves less; what is asked for now has to be possible.
    acceleration = max(acceleration, abs(start.acceleration))
    (phases,) = RuckigPlanner(1).to_rest(
        [start.speed], [start.acceleration], ([1.0], [acceleration], [jerk])
    )
    final = evaluate(phases, start, np.array([total_duration(phases)]))
    # Whoever brakes already may rest sooner than the jerk allows to end that.
    return max(float(final.values[-1]) - start.place, 0.5 * start.speed**2 / acceleration)
