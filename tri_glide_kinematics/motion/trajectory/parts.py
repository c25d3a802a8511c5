"""Parts of the pieces of a time scaling, in each of which the path is smooth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.path.pieces import Indices
from tri_glide_kinematics.motion.trajectory import quintics
from tri_glide_kinematics.motion.trajectory.time_scaling import TimeScaling
from tri_glide_kinematics.vectors import FloatArray

# A break this near to a knot, as a part of the length of the piece, is at the knot.
_SAME_PLACE = 1e-9

# Steps of the search for the instant at which a break is passed, and how exact it is, as a part of
# the longest piece.
_INSTANT = 1e-11
_STEPS = 40


class PathParts(NamedTuple):
    """Parts of the pieces of a time scaling, each inside one piece of the path.

    Attributes:
        piece: of the time scaling. Shape (m,).
        begin: time since the piece began. Shape (m,) [s].
        end: likewise. Shape (m,) [s].
        from_way: where it begins. Shape (m,) [m].
        to_way: where it ends. Shape (m,) [m].
    """

    piece: Indices
    begin: FloatArray
    end: FloatArray
    from_way: FloatArray
    to_way: FloatArray


def divided(
    breaks: FloatArray, scaling: TimeScaling, dt: FloatArray, coefficients: FloatArray
) -> PathParts:
    """Return the parts of the pieces of a time scaling between ``breaks`` of the path."""
    ways = scaling.ways
    count = len(dt)
    slack = _SAME_PLACE * (ways[1:] - ways[:-1])
    firsts = np.searchsorted(breaks, ways[:-1] + slack, "right")
    numbers = np.maximum(np.searchsorted(breaks, ways[1:] - slack, "left") - firsts, 0)
    owners = np.repeat(np.arange(count), numbers)
    offsets = np.arange(len(owners)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    inside = breaks[firsts[owners] + offsets]
    passed = _instants(inside, coefficients[:, owners], dt[owners])
    # All begins, in order: where each piece begins, and after it the breaks in it.
    piece = np.repeat(np.arange(count), numbers + 1)
    begin, from_way = np.zeros(len(piece)), np.empty(len(piece))
    at_knots = np.arange(count) + np.cumsum(numbers) - numbers
    at_breaks = np.arange(len(owners)) + owners + 1
    from_way[at_knots] = ways[:-1]
    from_way[at_breaks], begin[at_breaks] = inside, passed
    end, to_way = np.empty(len(piece)), np.empty(len(piece))
    end[:-1], to_way[:-1] = begin[1:], from_way[1:]
    lasts = at_knots + numbers
    end[lasts], to_way[lasts] = dt, ways[1:]
    return PathParts(piece, begin, end, from_way, to_way)


def _instants(ways: FloatArray, coefficients: FloatArray, dt: FloatArray) -> FloatArray:
    """Return when quintics pass ``ways``, by Halley's method between bounds. Shape (n,) [s]."""
    if not len(ways):
        return np.empty(0)
    low, high = np.zeros(len(ways)), dt.copy()
    begin, end = coefficients[0], quintics.evaluate(coefficients, dt)[0]
    # As at a constant speed.
    time = np.clip((ways - begin) / (end - begin), 0.0, 1.0) * dt
    tolerance = _INSTANT * float(dt.max())
    for _ in range(_STEPS):
        value, slope, second = quintics.evaluate(coefficients, time)
        miss = value - ways
        before = miss < 0.0
        low, high = np.where(before, time, low), np.where(before, high, time)
        with np.errstate(divide="ignore", invalid="ignore"):
            better = time - 2.0 * miss * slope / (2.0 * slope * slope - miss * second)
        found = np.abs(better - time) <= tolerance
        if found.all():
            break
        sane = (better > low) & (better < high)
        # What is found stays: the next step would be one of rounding, out of the bounds.
        time = np.where(found, time, np.where(sane, better, 0.5 * (low + high)))
    return np.asarray(time)
