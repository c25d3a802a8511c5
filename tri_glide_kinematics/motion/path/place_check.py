r"""Proof that each place of a path is inside the workspace, from places that vouch for more.

It is that of ``workspace.tracing``, for a path of the platform. Let two places of it be inside, the
parameter between them h, the way w, and the tolerance T of that module be granted.

- Condition number: the balls about both, in which it is kept, have to meet: $w \le r_1 + r_2$.
- Reach, box and cylinder are convex: nothing between is farther out than the path bends away from
  its chord, $h^2 |p''| / 8$, nor than half the way.
- Slider travel: likewise with the second derivative of the heights, at most
  $c |p''| + K |p'|^2$ with the largest gain c and slope K of the Jacobian in both balls, or with
  half the way times c.

Where this is not enough, the place in the middle is looked at.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import PathPlaceError
from tri_glide_kinematics.motion.path.driven_path import DrivenPath
from tri_glide_kinematics.tri_glide import (
    ball_that_keeps,
    extreme_singular_values_batch,
    jacobian_rows,
    least_rises,
)
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Indices, ascending
from tri_glide_kinematics.wording import vector_text
from tri_glide_kinematics.workspace import ROUNDING, TOLERANCE, Workspace, slacks


class Clearances(NamedTuple):
    """What is known around places of the platform; without a meaning where they are outside.

    Attributes:
        inside: whether a place keeps all limits. Shape (n,).
        radius: no place within this distance breaks the condition number. Shape (n,) [m].
        slack: distance to the nearest bound of reach, box and cylinder. Shape (n,) [m].
        travel: distance to the nearest end of slider travel. Shape (n,) [m].
        gain: within the radius, no slider moves farther than the platform times this. Shape (n,).
        slope: within the radius, the Jacobian changes by at most this per metre. Shape (n,) [1/m].
    """

    inside: BoolArray
    radius: FloatArray
    slack: FloatArray
    travel: FloatArray
    gain: FloatArray
    slope: FloatArray


def clearances(workspace: Workspace, places: FloatArray) -> Clearances:
    """Return what is known around ``places`` of the platform, shape (n, 3) [m]."""
    bounds = workspace.bounds
    geometry = workspace.machine.geometry
    lengths = np.array(geometry.arm_lengths)[:, np.newaxis]
    across = np.array(geometry.anchors)[:, :, np.newaxis] - places[:, :2].T
    with np.errstate(invalid="ignore", divide="ignore"):
        distances, rises, rows = jacobian_rows(across, lengths)
        heights = places[:, 2:] + rises.T
        largest, smallest = extreme_singular_values_batch(rows)
        smallest = geometry.handedness * smallest
        margin = smallest - largest / bounds.condition
        kept = margin >= -ROUNDING * largest / bounds.condition
        radius, slope = ball_that_keeps(
            *(margin, smallest, bounds.condition, geometry.arm_lengths, distances, TOLERANCE),
            smaller=np.minimum,
            larger=np.maximum,
        )
        gain = (lengths / least_rises(lengths, distances, radius)).max(axis=0)
    travel, slack = bounds.travel_slacks(heights), slacks(bounds.shapes, places)
    # Not a number is not inside, either.
    inside = kept & (slack >= -ROUNDING) & (travel >= -ROUNDING)
    return Clearances(inside, radius, slack, travel, gain, slope)


# The first places are so far apart [m].
FIRST_PLACES_APART = 0.01

# Numbers of spans, places and first intervals that are looked at between two breaks.
CHECKED_SPANS = 4000
CHECKED_PLACES = 200
INTERVALS = 100


def check_place(
    driven: DrivenPath, workspace: Workspace, start: float = 0.0
) -> Interruptible[None]:
    """Check that each place of a path is inside; interruptibly.

    Args:
        driven: the path.
        workspace: in which it has to stay.
        start: programmed way from which on it is checked [m].

    Raises:
        PathPlaceError: with the segment, the place, and what the workspace says of it.
    """
    start = min(max(start, 0.0), driven.length)
    count = max(int(np.ceil((driven.length - start) / FIRST_PLACES_APART)), 1)
    even = np.linspace(start, driven.length, count + 1)
    ways = ascending(np.append(even, driven.stops[driven.stops > start]))
    part = driven.spans_of(ways) // CHECKED_SPANS + np.arange(len(ways)) // INTERVALS
    heads = np.flatnonzero(np.diff(part, prepend=-1))
    for first, last in zip(heads, (*heads[1:], len(ways) - 1)):
        yield
        yield from _check_between(driven, workspace, ways[first : last + 1])


def _check_between(
    driven: DrivenPath, workspace: Workspace, ways: FloatArray
) -> Interruptible[None]:
    """Check the path between some ways, whose number is small."""
    known = _looked_at(driven, workspace, ways)
    first, last = driven.spans_of(ways[[0, -1]]).tolist()
    bounds = driven.bounds_on(slice(first, last + 1))
    # All intervals between the ways, from the index of one to that of the next.
    low, high = np.arange(len(ways) - 1), np.arange(1, len(ways))
    while len(low):
        yield
        # The span in which an interval ends is looked at, too.
        heads, tails = driven.spans_of(ways[low]) - first, driven.spans_of(ways[high]) - first
        rates, bends = _largest(bounds.rates, heads, tails), _largest(bounds.bends, heads, tails)
        steps = ways[high] - ways[low]
        unproved = ~_is_inside_between(steps, rates, bends, known, low, high)
        low, high = low[unproved], high[unproved]
        if not len(low):
            return
        middles = 0.5 * (ways[low] + ways[high])
        new = np.arange(len(ways), len(ways) + len(middles))
        found = []
        for some in np.array_split(middles, 1 + len(middles) // CHECKED_PLACES):
            yield
            found.append(_looked_at(driven, workspace, some))
        ways = np.concatenate((ways, middles))
        known = Clearances(*(np.concatenate(column) for column in zip(known, *found)))
        low, high = np.concatenate((low, new)), np.concatenate((new, high))


def _looked_at(driven: DrivenPath, workspace: Workspace, ways: FloatArray) -> Clearances:
    """Return what is known around places of the path, all of which have to be inside."""
    places = driven.derivatives(ways, 0)[0]
    known = clearances(workspace, places)
    for index in np.flatnonzero(~known.inside)[:1].tolist():
        place = places[index].tolist()
        segment = int(driven.segment_of(ways[index]))
        try:
            workspace.check_position(place)
        except KinematicsError as error:
            raise PathPlaceError(segment, place, str(error)) from error
        reason = f"too near the edge of the workspace at {vector_text(place)} m"
        raise PathPlaceError(segment, place, reason)
    return known


def _is_inside_between(
    steps: FloatArray,
    rates: FloatArray,
    bends: FloatArray,
    known: Clearances,
    low: Indices,
    high: Indices,
) -> BoolArray:
    """Return between which places the path is inside, up to ``TOLERANCE``.

    Args:
        steps: of the programmed way between the places. Shape (m,) [m].
        rates: upper bounds of |p'| between them. Shape (m,).
        bends: upper bounds of |p''| between them. Shape (m,) [1/m].
        known: what is known of all places.
        low: indices of the first places. Shape (m,).
        high: indices of the second places. Shape (m,).
    """
    way = rates * steps
    slack = np.minimum(known.slack[low], known.slack[high]) + TOLERANCE
    travel = np.minimum(known.travel[low], known.travel[high]) + TOLERANCE
    gain = np.maximum(known.gain[low], known.gain[high])
    slope = np.maximum(known.slope[low], known.slope[high])
    eighth = 0.125 * steps * steps
    well_posed = way <= known.radius[low] + known.radius[high]
    in_room = np.minimum(0.5 * way, eighth * bends) <= slack
    of_sliders = np.minimum(0.5 * gain * way, eighth * (gain * bends + slope * rates * rates))
    return np.asarray(well_posed & in_room & (of_sliders <= travel))


def _largest(values: FloatArray, heads: Indices, tails: Indices) -> FloatArray:
    """Return the largest value from each head to its tail, which is no less. Shape (m,)."""
    # The values between one tail and the next head are worked out, too, and left out.
    ends = np.stack((heads, tails + 1), 1).ravel()
    return np.asarray(np.maximum.reduceat(np.append(values, 0.0), ends)[::2])
