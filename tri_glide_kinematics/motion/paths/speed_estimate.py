"""How fast a platform may be at each place of a path, estimated before its motion is planned.

It is the speed that steady motion allows at each place, and what accelerations and jerks allow
after the places before and behind it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.paths.distinct import distinct
from tri_glide_kinematics.motion.paths.path_heights import PathHeights
from tri_glide_kinematics.motion.paths.timing_errors import PathTimingError
from tri_glide_kinematics.vectors import FloatArray

BoolArray = NDArray[np.bool_]

# Cells during the time from no acceleration to the largest, and in the whole motion at least.
_CELLS_OF_RAMP = 16.0
_LEAST_CELLS = 128.0


# What is at least this part of the speed that the path asks for is as fast as that.
_AS_ASKED = 0.999

# Places at which speeds are estimated, besides the breaks.
SAMPLES = 240

# Places between the first two of these: after rest the way grows with the third power of time.
_NEAR_REST = (np.arange(1.0, 12.0) / 12.0) ** 3

# After rest with constant jerk J, v^(3/2) = sqrt(9 J / 2) s.
_REST = 4.5**0.5


class SpeedEstimate(NamedTuple):
    """An estimate of the motion at ascending places.

    Attributes:
        places: Shape (n,) [m].
        speeds: Shape (n,) [m/s].
        cells: how many cells are to lie before each place. Shape (n,).
        ramp: way during which the jerk is constant after rest, at each place. Shape (n,) [m].
        is_asked: where the speed is the one that the path asks for. Shape (n,).
    """

    places: FloatArray
    speeds: FloatArray
    cells: FloatArray
    ramp: FloatArray
    is_asked: BoolArray


def samples(begin: float, end: float, breaks: FloatArray) -> FloatArray:
    """Return places for an estimate, next to both ends as rest asks for. Shape (n,) [m]."""
    fill = np.linspace(begin, end, SAMPLES + 1)
    step = (fill[1] - begin) * _NEAR_REST
    return distinct(fill, breaks, begin + step, end - step)


def estimated(
    heights: PathHeights, places: FloatArray, speed: float, limits: SliderLimits
) -> Interruptible[SpeedEstimate]:
    """Return an estimate of the motion from a ``speed`` at the first place to rest at the last.

    Args:
        heights: of the sliders along the path.
        places: ascending, dense enough for what is estimated. Shape (n,) [m].
        speed: at the first of them [m/s].
        limits: of the sliders.

    Raises:
        PathTimingError: if an arm does not reach some place.
    """
    (_, first, second, third), rates = heights.derivatives(places)
    unreached = np.flatnonzero(~np.isfinite(first).all(axis=0))
    if len(unreached):
        place = float(places[unreached[0]])
        raise PathTimingError.at(heights.driven, place, "an arm does not reach so far")
    yield
    velocity, acceleration, jerk = limits.table[..., np.newaxis]
    with np.errstate(divide="ignore"):
        steady = np.minimum(
            (velocity / np.abs(first)).min(axis=0),
            np.minimum(
                np.sqrt((acceleration / np.abs(second)).min(axis=0)),
                np.cbrt((jerk / np.abs(third)).min(axis=0)),
            ),
        )
        asked = heights.speed_limits(places) / rates
        steady = np.minimum(steady, asked)
        along = (acceleration / np.abs(first)).min(axis=0)
        jerk_along = (jerk / np.abs(first)).min(axis=0)
    steps = np.diff(places)

    def summed(values: FloatArray) -> FloatArray:
        return np.concatenate(((0.0,), np.cumsum(0.5 * steps * (values[1:] + values[:-1]))))

    speeds = steady.copy()
    speeds[0], speeds[-1] = speed, 0.0
    for power, slopes in ((2.0, 2.0 * along), (1.5, _REST * np.sqrt(jerk_along))):
        reach = summed(slopes)
        raised = speeds**power
        raised = np.minimum.accumulate(raised - reach) + reach
        raised = np.minimum.accumulate((raised + reach)[::-1])[::-1] - reach
        speeds = np.maximum(raised, 0.0) ** (1.0 / power)
    times = 2.0 * steps / (speeds[1:] + speeds[:-1])
    total = float(times.sum())
    ramps = acceleration / jerk
    each = max(min(float(ramps.min()) / _CELLS_OF_RAMP, total / _LEAST_CELLS), 1e-9 * total)
    # As long as the jerk is constant after rest.
    until = np.minimum(along / jerk_along, np.sqrt(steady / jerk_along))
    until = np.minimum(until, 0.25 * total)
    cells = np.concatenate(((0.0,), np.cumsum(times))) / each
    ramp = jerk_along * until**3 / 6.0
    return SpeedEstimate(places, speeds, cells, ramp, speeds > _AS_ASKED * asked)
