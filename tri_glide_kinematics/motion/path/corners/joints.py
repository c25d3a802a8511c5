"""Joints between the segments of a path: which are smooth, which are stops, which are rounded.

Functions inside of others work on ``some`` of the rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import (
    Interruptible,
    column_of,
    columns_of,
    concatenated,
    indices_of,
    picked,
)
from tri_glide_kinematics.motion.path.segments import Segments
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Indices, are_among

# Tangents that differ by less are the same: rounding.
SAME_TANGENT = 1e-9

# Curvatures that differ by less, as part of the larger one, are the same: rounding.
SAME_CURVATURE = 1e-9

# A rounding with a smaller tolerance would be a stop, but for rounding [m].
LEAST_TOLERANCE = 1e-9

# A corner with a smaller tolerance is a stop: to pass it would take as long, but for milliseconds,
# and no cell of a motion is so short [m].
LEAST_OF_CORNER = 3e-6

# The way driven is nowhere shorter than this part of the way programmed. In the middle of a
# rounded corner it is half the sum of both tangents; a sharper corner is a stop.
LEAST_RATE = 0.2

NO_STOPS = np.zeros(0)


class ShapedCorners(NamedTuple):
    """How corners are driven whose tolerances a shaper needs, too.

    A corner that stands alone is passed at a speed that is proportional to its tolerance over its
    turn. Around it the platform is as slow as long as the shaper lasts and the rounding is long.
    Where that takes longer than to stop in the corner, it is a stop.

    Attributes:
        part: of the tolerances that roundings use.
        rate: a corner is passed at this times its tolerance, over its turn [1/s].
        slowest: speed below which it is quicker to stop [m/s].
        passing: how long the platform is slow around a corner [s].
    """

    part: float
    rate: float
    slowest: float
    passing: float

    def are_stops(self, turns: FloatArray, segments: Segments, before: slice) -> BoolArray:
        """Return which joints at the ends of some segments are passed more slowly than stopped in.

        Args:
            turns: at the joints. Shape (n,).
            segments: of the path.
            before: those before the joints.
        """
        after = slice(before.start + 1, before.stop + 1)
        # In a corner that does not stand alone, the platform is slow in any case.
        alone = np.diff(segments.joints[before.start : after.stop + 1])
        alone = np.minimum(alone[:-1], alone[1:]) / self.passing
        # A corner that is passed at half of the speed asked for, or more, costs little.
        asked = 0.5 * np.maximum(segments.speeds[before], segments.speeds[after])
        slowest = np.minimum(np.minimum(self.slowest, asked), alone)
        return np.asarray(self.rate * segments.tolerances[before] < slowest * turns)


@dataclass(frozen=True, eq=False)
class RoundedJoints:
    """Joints that are rounded, in the order of the path.

    Attributes:
        ways: programmed way at each. Shape (m,) [m].
        tangent_jumps: change of the unit tangent. Shape (m, 3).
        curvature_jumps: change of the curvature vector. Shape (m, 3) [1/m].
        turns: size of the change of the tangent. Shape (m,).
        bends: size of the change of the curvature. Shape (m,) [1/m].
        distances: of a path that is rounded at this joint alone from the path as programmed, as
            part of the rounding; at most ``turns``. Shape (m,).
        tolerances: Shape (m,) [m].
        rooms_before: way from the last stop. Shape (m,) [m].
        rooms_after: way to the next stop. Shape (m,) [m].
        free: whether all smooth joints up to the next others allow as much. Shape (m,).
    """

    ways: FloatArray
    tangent_jumps: FloatArray
    curvature_jumps: FloatArray
    turns: FloatArray
    bends: FloatArray
    distances: FloatArray
    tolerances: FloatArray
    rooms_before: FloatArray
    rooms_after: FloatArray
    free: BoolArray

    @property
    def rooms(self) -> FloatArray:
        """Way to the nearest stop. Shape (m,) [m]."""
        return np.asarray(np.minimum(self.rooms_before, self.rooms_after))

    def part(self, some: slice | Indices) -> RoundedJoints:
        """Return ``some`` of them."""
        return RoundedJoints(*(getattr(self, name)[some] for name in self.__dataclass_fields__))


class Jumps(NamedTuple):
    """What changes at the joints of a path, as in ``RoundedJoints``, and which of them count.

    Attributes:
        tangents: Shape (n, 3).
        curvatures: Shape (n, 3) [1/m].
        turns: Shape (n,).
        bends: Shape (n,) [1/m].
        distances: Shape (n,).
        rough: whether a joint is not smooth. Shape (n,).
        stops: whether the platform has to stop there. Shape (n,).
        rounded: whether it is neither. Shape (n,).
        smooth_tolerances: infinite where a joint is not smooth. Shape (n,) [m].
    """

    tangents: FloatArray
    curvatures: FloatArray
    turns: FloatArray
    bends: FloatArray
    distances: FloatArray
    rough: BoolArray
    stops: BoolArray
    rounded: BoolArray
    smooth_tolerances: FloatArray


def jumps_at(
    segments: Segments, before: slice, stops: FloatArray, shaped: ShapedCorners | None = None
) -> Jumps:
    """Return what changes at the ends of some segments.

    Args:
        segments: of the path.
        before: those before the joints.
        stops: ways of joints that are stops in any case, unless they are smooth; ascending [m].
        shaped: how corners are driven with a shaper; None without one.
    """
    after = slice(before.start + 1, before.stop + 1)
    ends, starts = segments.end_tangents[before], segments.tangents[after]
    tangents = starts - ends
    turns = lengths_of(tangents)
    half_sums = 0.5 * lengths_of(starts + ends)
    corner = turns > SAME_TANGENT
    old, new = segments.curvatures[before], segments.curvatures[after]
    curvatures, bends = np.zeros_like(tangents), np.zeros_like(turns)
    if old.any() or new.any():
        curvatures += new[:, np.newaxis] * segments.normals[after]
        curvatures -= old[:, np.newaxis] * segments.end_normals[before]
        bends = lengths_of(curvatures)
    bent = bends > SAME_CURVATURE * np.maximum(old, new)
    tangents[~corner] = 0.0
    turns[~corner] = 0.0
    curvatures[~bent] = 0.0
    bends[~bent] = 0.0
    # Between two lines: at a corner of the angle a, the rounding is across them by its sine.
    sines = np.where(turns * turns < 2.0, turns * half_sums, 1.0)
    distances = np.where((old == 0.0) & (new == 0.0) & corner, sines, turns)
    rough = corner | bent
    tolerances = segments.tolerances[before]
    least = np.where(corner, LEAST_OF_CORNER, LEAST_TOLERANCE)
    is_stop = (tolerances < least) | (half_sums < LEAST_RATE)
    is_stop |= are_among(segments.joints[after], stops)
    if shaped is not None:
        is_stop |= corner & shaped.are_stops(turns, segments, before)
    smooth_tolerances = np.where(rough, np.inf, tolerances)
    which = rough, rough & is_stop, rough & ~is_stop
    return Jumps(tangents, curvatures, turns, bends, distances, *which, smooth_tolerances)


def rooms_at(ways: FloatArray, stops: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ways from the last of the ``stops`` before, and to the next. Shape (m,) [m]."""
    following = np.searchsorted(stops, ways)
    return ways - stops[following - 1], stops[following] - ways


def least_between(values: FloatArray, heads: Indices, some: slice) -> FloatArray:
    """Return the least of the ``values`` from a head up to the next one, for ``some`` heads.

    Args:
        values: Shape (n,).
        heads: ascending indices of values; behind the last one that counts comes another one.
        some: of the heads.
    """
    begin, end = heads[some.start], heads[some.stop]
    return np.asarray(np.minimum.reduceat(values[begin:end], heads[some] - begin))


def lengths_of(vectors: FloatArray) -> FloatArray:
    """Return the Euclidean lengths of vectors, shape (n, 3). Shape (n,)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def joints_of(
    segments: Segments, stops: FloatArray = NO_STOPS, shaped: ShapedCorners | None = None
) -> Interruptible[tuple[RoundedJoints, FloatArray]]:
    """Return the joints of a path that are rounded, and the ways at all stops [m].

    Args:
        segments: of the path.
        stops: ways of joints that are stops in any case, unless they are smooth; ascending [m].
        shaped: how corners are driven with a shaper; None without one.
    """
    ways = yield from Segments.joints.in_pieces(segments)
    inner, tolerances = ways[1:-1], segments.tolerances[:-1]
    changes = columns_of(
        len(inner), lambda some: jumps_at(segments, some, stops, shaped), spare_zeros=True
    )
    jumps = Jumps(*(yield from changes))
    stopped = yield from picked(inner, (yield from indices_of(jumps.stops)))
    all_stops = yield from concatenated((ways[:1], stopped, ways[-1:]))
    rounded = yield from indices_of(jumps.rounded)
    free = yield from _free(tolerances, jumps, rounded)
    columns: list[NDArray[Any]] = [inner, *jumps[:5], tolerances]
    # Nothing is copied if all joints are rounded, as those of a dense path.
    if len(rounded) < len(inner):
        columns = yield from columns_of(
            len(rounded),
            lambda some: [column[rounded[some]] for column in columns],
            spare_zeros=True,
        )
    rooms = yield from columns_of(len(rounded), lambda some: rooms_at(columns[0][some], all_stops))
    return RoundedJoints(*(*columns, *rooms, free)), all_stops


def _free(tolerances: FloatArray, jumps: Jumps, rounded: Indices) -> Interruptible[BoolArray]:
    """Return whether no smooth joint beside a rounded one has a smaller tolerance.

    Args:
        tolerances: of all joints between segments. Shape (n - 1,) [m].
        jumps: at these joints.
        rounded: indices of the rounded joints, ascending. Shape (m,).

    Returns:
        Shape (m,).
    """
    rough = yield from indices_of(jumps.rough)
    smooth = yield from concatenated((jumps.smooth_tolerances, np.array([np.inf])))
    # Of the smooth joints from one that is not to the next.
    heads = yield from concatenated((np.zeros(1, dtype=np.intp), rough, np.array([len(smooth)])))
    least = yield from column_of(len(rough) + 1, lambda some: least_between(smooth, heads, some))

    def is_free(some: slice) -> BoolArray:
        here = rounded[some]
        following = np.searchsorted(rough, here)
        beside = np.minimum(least[following], least[following + 1])
        return np.asarray(beside >= tolerances[here])

    return (yield from column_of(len(rounded), is_free))
