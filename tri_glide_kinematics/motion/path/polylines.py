"""A path as points on it, for whoever draws it: as programmed, and as driven."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import Interruptible, column_of
from tri_glide_kinematics.motion.path.driven_path import DrivenPath
from tri_glide_kinematics.motion.path.piecewise_path import PiecewisePath
from tri_glide_kinematics.motion.path.segments import Segments
from tri_glide_kinematics.vectors import FloatArray

# An arc is drawn with chords of this angle, a span of a rounding with so many [rad].
CHORD_ANGLE = np.deg2rad(5.0)
ROUNDING_CHORDS = 8

# No more points are taken; of a path that has more places to draw, only some.
MOST_POINTS = 3000

# Number of places that are worked out together.
DRAWN_PLACES = 300


class PathPolylines(NamedTuple):
    """Points on a path, in their order.

    Attributes:
        programmed: on the path as programmed, its corners among them. Shape (m, 3) [m].
        driven: on the path as driven. Shape (n, 3) [m].
    """

    programmed: FloatArray
    driven: FloatArray


def polylines_of(driven: DrivenPath, most: int = MOST_POINTS) -> Interruptible[PathPolylines]:
    """Return points on a path as programmed and as ``driven``, interruptibly.

    Args:
        driven: the path.
        most: largest number of points of each.
    """
    segments = driven.segments
    if len(segments) < most:
        programmed = yield from _points_on(_as_programmed(segments), most)
    else:
        programmed = segments.points[_evenly(len(segments) + 1, most)]
    return PathPolylines(programmed, (yield from _points_on(driven, most)))


def _as_programmed(segments: Segments) -> PiecewisePath:
    """Return the path without roundings."""
    table = np.zeros((len(segments), 2, 3))
    table[:, 0] = segments.points[:-1]
    is_line = segments.curvatures == 0.0
    table[is_line, 1] = segments.tangents[is_line]
    return PiecewisePath(segments, segments.joints, table, np.arange(len(segments)))


def _points_on(path: PiecewisePath, most: int) -> Interruptible[FloatArray]:
    """Return the points at which to draw a path. Shape (n, 3) [m]."""
    ways = _ways(path, most)
    yield
    found = column_of(len(ways), lambda some: path.derivatives(ways[some], 0)[0], rows=DRAWN_PLACES)
    return (yield from found)


def _ways(path: PiecewisePath, most: int) -> FloatArray:
    """Return the programmed ways at which to draw a path, both ends among them [m]."""
    ways = path.breaks
    if len(ways) < most:
        steps = np.diff(ways)
        angles = path.segments.curvatures[path.segment] * steps
        chords = np.maximum(np.ceil(angles / CHORD_ANGLE).astype(int), 1)
        is_rounded = path.table[:, 2:].any(axis=(1, 2))
        chords[is_rounded] = np.maximum(chords[is_rounded], ROUNDING_CHORDS)
        firsts = np.repeat(np.cumsum(chords) - chords, chords)
        parts = (np.arange(len(firsts)) - firsts) / np.repeat(chords, chords)
        starts = np.repeat(ways[:-1], chords)
        ways = np.append(starts + parts * np.repeat(steps, chords), ways[-1])
    return ways[_evenly(len(ways), most)] if len(ways) > most else ways


def _evenly(count: int, most: int) -> NDArray[np.intp]:
    """Return the indices of so many of ``count`` places at ``most``, both ends among them."""
    return np.linspace(0, count - 1, min(most, count)).round().astype(np.intp)
