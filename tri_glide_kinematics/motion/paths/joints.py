"""Joints between the segments of a path: which are smooth, which are stops, which are rounded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import Interruptible, concatenated, picked
from tri_glide_kinematics.motion.paths.distinct import are_among
from tri_glide_kinematics.motion.paths.segments import Segments
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

# So many joints are worked on between two breaks of the computation.
AT_A_TIME = 4000


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
    found = []
    for first in range(0, len(segments), AT_A_TIME):
        found.append(_jumps(segments, first, min(first + AT_A_TIME, len(segments) - 1)))
        yield
    columns = []
    for column in zip(*found):
        columns.append((yield from concatenated(column)))
    jumps = _Jumps(*columns)
    del found
    ways = segments.joints
    inner = ways[1:-1]
    yield
    stop = jumps.stop | (jumps.rough & are_among(inner, stops))
    stops = np.concatenate((ways[:1], inner[stop], ways[-1:]))
    yield
    rounded = np.flatnonzero(jumps.rough & ~stop)
    at = yield from picked(inner, rounded)
    before, after = np.empty(len(at)), np.empty(len(at))
    for first in range(0, len(at), AT_A_TIME):
        some = slice(first, first + AT_A_TIME)
        following = np.searchsorted(stops, at[some])
        before[some] = at[some] - stops[following - 1]
        after[some] = stops[following] - at[some]
        yield
    yield
    free = yield from _free(segments.tolerances[:-1], jumps.rough, rounded)
    return RoundedJoints(
        at,
        (yield from picked(jumps.tangents, rounded)),
        (yield from picked(jumps.curvatures, rounded)),
        (yield from picked(jumps.turns, rounded)),
        (yield from picked(jumps.bends, rounded)),
        (yield from picked(jumps.distances, rounded)),
        (yield from picked(segments.tolerances, rounded)),
        before,
        after,
        free,
    ), stops


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
    smooth = np.append(np.where(rough, np.inf, tolerances), np.inf)
    yield
    # Of the smooth joints from one that is not to the next.
    heads = np.append(0, np.flatnonzero(rough))
    tails = np.append(heads[1:], len(smooth))
    least = np.empty(len(heads))
    for first in range(0, len(heads), AT_A_TIME):
        yield
        some = slice(first, first + AT_A_TIME)
        begin, end = heads[first], tails[some][-1]
        least[some] = np.minimum.reduceat(smooth[begin:end], heads[some] - begin)
    yield
    ends = heads[1:]
    free: NDArray[np.bool_] = np.minimum(least[:-1], least[1:]) >= tolerances[ends]
    yield
    return free[np.searchsorted(ends, rounded)]


def _jumps(segments: Segments, first: int, last: int) -> _Jumps:
    """Return what changes at the ends of the segments from ``first`` on, before ``last``."""
    before, after = slice(first, last), slice(first + 1, last + 1)
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


def any_bend(joints: RoundedJoints) -> bool:
    """Return whether the curvature jumps at a joint."""
    found: NDArray[np.bool_] = joints.bends > 0.0
    return bool(found.any())
