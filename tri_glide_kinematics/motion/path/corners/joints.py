"""Joints between the segments of a path: which are smooth, which are stops, which are rounded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

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
from tri_glide_kinematics.motion.path.number_sets import are_among
from tri_glide_kinematics.motion.path.segments import Segments
from tri_glide_kinematics.vectors import FloatArray

Indices = NDArray[np.intp]

# Tangents that differ by less are the same: rounding.
SAME_TANGENT = 1e-9

# Curvatures that differ by less, as part of the larger one, are the same: rounding.
SAME_CURVATURE = 1e-9

# A rounding with a smaller tolerance would be a stop, but for rounding [m].
LEAST_TOLERANCE = 1e-9

# The way driven is nowhere shorter than this part of the way programmed. In the middle of a
# rounded corner it is half the sum of both tangents; a sharper corner is a stop.
LEAST_RATE = 0.2

NO_STOPS = np.zeros(0)


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
    free: NDArray[np.bool_]

    @property
    def rooms(self) -> FloatArray:
        """Way to the nearest stop. Shape (m,) [m]."""
        return np.asarray(np.minimum(self.rooms_before, self.rooms_after))

    def part(self, some: slice | Indices) -> RoundedJoints:
        """Return ``some`` of them."""
        return RoundedJoints(*(getattr(self, name)[some] for name in self.__dataclass_fields__))


class _Jumps(NamedTuple):
    """What changes at joints, as in ``RoundedJoints``; and which are not smooth, and stops."""

    tangents: FloatArray
    curvatures: FloatArray
    turns: FloatArray
    bends: FloatArray
    distances: FloatArray
    rough: NDArray[np.bool_]
    stop: NDArray[np.bool_]


def joints_of(
    segments: Segments, stops: FloatArray = NO_STOPS
) -> Interruptible[tuple[RoundedJoints, FloatArray]]:
    """Return the joints of a path that are rounded, and the ways at all stops [m].

    Args:
        segments: of the path.
        stops: ways of joints that are stops in any case, unless they are smooth; ascending [m].
    """
    ways = yield from segments.measured()
    inner = ways[1:-1]
    changes = yield from columns_of(
        len(inner), lambda some: _jumps(segments, some), spare_zeros=True
    )
    jumps = _Jumps(*changes)
    rough = jumps.rough
    stop = yield from column_of(
        len(inner),
        lambda some: jumps.stop[some] | (rough[some] & are_among(inner[some], stops)),
    )
    all_stops = yield from concatenated(
        (ways[:1], (yield from picked(inner, (yield from indices_of(stop)))), ways[-1:])
    )
    is_rounded = yield from column_of(len(inner), lambda some: rough[some] & ~stop[some])
    rounded = yield from indices_of(is_rounded)
    free = yield from _free(segments.tolerances[:-1], rough, rounded)
    columns = [inner, *jumps[:5], segments.tolerances[:-1]]
    # Where all joints are rounded, as those of a dense path, nothing is copied.
    if len(rounded) < len(inner):
        columns = yield from columns_of(
            len(rounded),
            lambda some: [column[rounded[some]] for column in columns],
            spare_zeros=True,
        )
    at = columns[0]

    def rooms(some: slice) -> tuple[FloatArray, FloatArray]:
        following = np.searchsorted(all_stops, at[some])
        return at[some] - all_stops[following - 1], all_stops[following] - at[some]

    before, after = yield from columns_of(len(at), rooms)
    at, tangents, curvatures, turns, bends, distances, tolerances = columns
    return RoundedJoints(
        *(at, tangents, curvatures, turns, bends, distances, tolerances, before, after),
        free,
    ), all_stops


def _free(
    tolerances: FloatArray, rough: NDArray[np.bool_], rounded: Indices
) -> Interruptible[NDArray[np.bool_]]:
    """Return whether no smooth joint beside a rounded one has a smaller tolerance.

    Args:
        tolerances: of all joints between segments. Shape (n - 1,) [m].
        rough: whether a joint is not smooth. Shape (n - 1,).
        rounded: indices of the rounded joints, ascending. Shape (m,).

    Returns:
        Shape (m,).
    """
    count = len(rough)
    ends = yield from indices_of(rough)
    smooth = yield from column_of(
        count, lambda some: np.where(rough[some], np.inf, tolerances[some])
    )
    smooth = yield from concatenated((smooth, np.array([np.inf])))
    # Of the smooth joints from one that is not to the next.
    heads = yield from concatenated((np.zeros(1, dtype=np.intp), ends, np.array([count + 1])))

    def least_of(some: slice) -> FloatArray:
        begin, end = heads[some.start], heads[some.stop]
        return np.minimum.reduceat(smooth[begin:end], heads[some] - begin)

    least = yield from column_of(len(ends) + 1, least_of)
    following = yield from column_of(
        len(rounded), lambda some: np.searchsorted(ends, rounded[some])
    )
    return (
        yield from column_of(
            len(rounded),
            lambda some: (
                np.minimum(least[following[some]], least[following[some] + 1])
                >= tolerances[rounded[some]]
            ),
        )
    )


def _jumps(segments: Segments, before: slice) -> _Jumps:
    """Return what changes at the ends of some segments, those ``before`` the joints."""
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
    sharp = (segments.tolerances[before] < LEAST_TOLERANCE) | (half_sums < LEAST_RATE)
    return _Jumps(tangents, curvatures, turns, bends, distances, rough, rough & sharp)


def lengths_of(vectors: FloatArray) -> FloatArray:
    """Return the Euclidean lengths of vectors, shape (n, 3). Shape (n,)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))
