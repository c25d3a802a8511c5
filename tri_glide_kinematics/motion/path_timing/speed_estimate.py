"""How fast a platform may be at each place of a path, estimated before its motion is planned.

It is the speed that steady motion allows at each place, and what accelerations and jerks allow
after the places before and behind it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.limits import PathPlaces, PathRows, SliderLimits
from tri_glide_kinematics.motion.trajectory import HeightDerivatives, PathHeights
from tri_glide_kinematics.vectors import BoolArray, FloatArray, ascending

# Cells during the time from no acceleration to the largest, and in the whole motion at least.
_CELLS_OF_RAMP = 16.0
LEAST_CELLS = 128.0

# The shortest cell, but for motions that are shorter than so many of them [s].
SHORTEST_CELL = 1e-3

# A window of this many cells is to last so many times as long as a braking takes. So a braking
# fits into what lies behind the place where it is continued.
_CELLS_AHEAD = 300
_BRAKINGS_AHEAD = 3.0

# Cells that it takes at least to come to rest from a speed that the path asks for: with fewer, no
# motion in cells does so, and the platform would be slower, or stop where nobody asks for it.
_LEAST_OF_BRAKING = 4.0

# Cells that it takes at least to get from no acceleration to the largest.
_LEAST_OF_RAMP = 4.0

# Part of the speed that the path asks for from which on a speed counts as that one.
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
        speeds: of the way programmed. Shape (n,) [m/s].
        cells: how many cells are to lie before each place. Shape (n,).
        each: how long the platform takes in a cell [s].
        limits: those of the sliders that cells of this length can use.
        ramp: way during which the jerk is constant after rest, at each place. Shape (n,) [m].
        is_asked: where the speed is the one that the path asks for. Shape (n,).
    """

    places: FloatArray
    speeds: FloatArray
    cells: FloatArray
    each: float
    limits: SliderLimits
    ramp: FloatArray
    is_asked: BoolArray


def samples(begin: float, end: float, breaks: FloatArray) -> FloatArray:
    """Return places for an estimate, next to both ends as rest asks for. Shape (n,) [m]."""
    fill = np.linspace(begin, end, SAMPLES + 1)
    step = (fill[1] - begin) * _NEAR_REST
    return ascending(np.concatenate((fill, breaks, begin + step, end - step)))


def estimated(
    heights: PathHeights,
    places: FloatArray,
    seen: HeightDerivatives,
    speed: float,
    limits: SliderLimits,
    each: float | None = None,
    shortest: float = 0.0,
) -> SpeedEstimate:
    """Return an estimate of the motion from a ``speed`` at the first place to rest at the last.

    Args:
        heights: of the sliders along the path.
        places: ascending, dense enough for what is estimated. Shape (n,) [m].
        seen: derivatives of the heights there.
        speed: at the first of them [m/s].
        limits: of the sliders; those that cells can use, if ``each`` is known.
        each: how long the platform is to take in a cell [s].
        shortest: how long it is to take at least, if ``each`` is not known [s].

    Raises:
        PathTimingError: if an arm does not reach some place.
    """
    (_, first, second, third), rates = seen
    unreached = np.flatnonzero(~np.isfinite(first).all(axis=0))
    if len(unreached):
        place = float(places[unreached[0]])
        raise heights.timing_error(place, "an arm does not reach so far")
    steps = np.diff(places)
    velocity, acceleration, _ = limits.table[..., np.newaxis]
    with np.errstate(divide="ignore"):
        asked = heights.speed_limits(places) / rates
        # What is asked for behind the place of rest bounds nothing before it.
        asked[-1] = asked[-2]
        steady = np.minimum((velocity / np.abs(first)).min(axis=0), asked)
        steady = np.minimum(steady, np.sqrt((acceleration / np.abs(second)).min(axis=0)))
        along = (acceleration / np.abs(first)).min(axis=0)
        if limits.added:
            # The places are a parameter of themselves.
            by_way = np.array((places, np.ones_like(places), np.zeros_like(places)))
            added = added_rows(heights, by_way, limits, steady)
            steady = np.minimum(
                steady, np.sqrt(1.0 / np.abs(added.squared).max(axis=0, initial=0.0))
            )
            along = np.minimum(along, 1.0 / np.abs(added.acceleration).max(axis=0, initial=0.0))
    reached = steady.copy()
    reached[0], reached[-1] = speed, 0.0
    reached = _reachable(reached, steps, 2.0, 2.0 * along)

    def with_jerk(jerk: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return steady speeds, speeds, and jerks along the path, with ``jerk`` limits (3,)."""
        with np.errstate(divide="ignore"):
            bends = np.cbrt((jerk[:, np.newaxis] / np.abs(third)).min(axis=0))
            jerk_along = (jerk[:, np.newaxis] / np.abs(first)).min(axis=0)
        speeds = reached.copy()
        speeds[1:-1] = np.minimum(speeds, bends)[1:-1]
        speeds = _reachable(speeds, steps, 1.5, _REST * np.sqrt(jerk_along))
        return np.minimum(steady, bends), speeds, jerk_along

    if each is None:
        _, speeds, jerk_along = with_jerk(limits.table[2])
        brakings = _brakings(speeds, along, jerk_along)
        ramp = float((limits.table[1] / limits.table[2]).min())
        slowest = float(brakings[speeds > _AS_ASKED * asked].min(initial=np.inf))
        each = max(_cell(_times(steps, speeds), brakings, ramp, slowest), shortest)
        limits = _usable(limits, each, slowest)
    steady, speeds, jerk_along = with_jerk(limits.table[2])
    times = _times(steps, speeds)
    total = float(times[-1])
    # As long as the jerk is constant after rest.
    until = np.minimum(along / jerk_along, np.sqrt(steady / jerk_along))
    until = np.minimum(until, 0.25 * total)
    ramp = jerk_along * until**3 / 6.0
    is_asked = speeds > _AS_ASKED * asked
    return SpeedEstimate(places, speeds, times / each, each, limits, ramp, is_asked)


def added_rows(
    heights: PathHeights, ways: FloatArray, limits: SliderLimits, speed: FloatArray
) -> PathRows:
    """Return what the added bounds ask of the timing of a path.

    Args:
        heights: of the sliders along the path.
        ways: places, and two derivatives by the parameter u. Shape (3, n) [m].
        limits: with added bounds.
        speed: that u may have there, about. Shape (n,).
    """
    place, slope, bend = ways
    position, tangent, half = heights.place_series(place, np.zeros(len(place))).values[:3]
    curvature = 2.0 * half * slope * slope + tangent * bend
    places = PathPlaces(position, tangent * slope, curvature, speed)
    rows = [bound.rows(places) for bound in limits.added]
    return PathRows(*(np.concatenate(each) for each in zip(*rows)))


def _reachable(
    speeds: FloatArray, steps: FloatArray, power: float, slopes: FloatArray
) -> FloatArray:
    """Return ``speeds`` from which all others can be reached.

    Args:
        speeds: wanted. Shape (n,) [m/s].
        steps: between their places. Shape (n - 1,) [m].
        power: of the speed that grows with the way.
        slopes: by how much at most. Shape (n,).
    """
    reach = np.concatenate(((0.0,), np.cumsum(0.5 * steps * (slopes[1:] + slopes[:-1]))))
    raised = speeds**power
    raised = np.minimum.accumulate(raised - reach) + reach
    raised = np.minimum.accumulate((raised + reach)[::-1])[::-1] - reach
    return np.asarray(np.maximum(raised, 0.0) ** (1.0 / power))


def _times(steps: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return when the platform is at each place. Shape (n,) [s]."""
    return np.concatenate(((0.0,), np.cumsum(2.0 * steps / (speeds[1:] + speeds[:-1]))))


def _brakings(speeds: FloatArray, accelerations: FloatArray, jerks: FloatArray) -> FloatArray:
    """Return how long it takes to come to rest from ``speeds``, with constant limits (n,) [s]."""
    ramps = accelerations / jerks
    short = speeds < accelerations * ramps
    return np.where(short, 2.0 * np.sqrt(speeds / jerks), speeds / accelerations + ramps)


def _cell(times: FloatArray, brakings: FloatArray, ramp: float, slowest: float) -> float:
    """Return how long the platform is to take in a cell [s].

    Args:
        times: when it is at each place. Shape (n,) [s].
        brakings: how long it takes to come to rest from there. Shape (n,) [s].
        ramp: least time from no acceleration to the largest [s].
        slowest: least time to come to rest from a speed that the path asks for [s].
    """
    total = float(times[-1])
    least = min(max(ramp / _CELLS_OF_RAMP, SHORTEST_CELL), total / LEAST_CELLS)
    least = min(least, max(slowest / _LEAST_OF_BRAKING, SHORTEST_CELL))
    far = times >= np.maximum(
        _BRAKINGS_AHEAD * np.maximum.accumulate(brakings), _CELLS_AHEAD * least
    )
    window = float(times[far.argmax()]) if far.any() else total
    return max(window / _CELLS_AHEAD, least, 1e-9 * total)


def _usable(limits: SliderLimits, each: float, slowest: float) -> SliderLimits:
    """Return ``limits`` with a lower jerk where cells are too long to use it.

    Args:
        limits: of the sliders.
        each: how long the platform takes in a cell [s].
        slowest: least time to come to rest from a speed that the path asks for [s].
    """
    acceleration, jerk = limits.table[1:]
    usable = np.minimum(jerk, acceleration / (_LEAST_OF_RAMP * each))
    # The time in which a low speed is reached grows with the root of the jerk.
    usable *= min(slowest / (_LEAST_OF_BRAKING * each), 1.0) ** 2
    return replace(limits, jerk=tuple(usable.tolist()))
