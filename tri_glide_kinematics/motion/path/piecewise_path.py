"""A path in spans: on each of them a polynomial, and an arc that it is added to.

On each span p(s) is a polynomial of the way from its begin; where the path as programmed is an
arc or a helix, that is added to it. For whoever draws a path, it becomes points on it.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.interruptible import Interruptible, column_of
from tri_glide_kinematics.motion.path.corners import lengths_of
from tri_glide_kinematics.motion.path.segments import Segments
from tri_glide_kinematics.vectors import FloatArray, Indices


class SpanBounds(NamedTuple):
    """Upper bounds in spans of a path.

    Attributes:
        starts: |p'| where a span begins, without an arc. Shape (k,).
        changes: by how much p' changes, without an arc. Shape (k,).
        angles: of the arc, 0 for a line, whose p' is in the numbers before. Shape (k,) [rad].
        bends: |p''|. Shape (k,) [1/m].
        thirds: |p'''|. Shape (k,) [1/m^2].
    """

    starts: FloatArray
    changes: FloatArray
    angles: FloatArray
    bends: FloatArray
    thirds: FloatArray

    @property
    def rates(self) -> FloatArray:
        """Upper bounds of |p'|. Shape (k,)."""
        return np.asarray(self.starts + self.changes + (self.angles > 0.0))

    @property
    def least_rates(self) -> FloatArray:
        """Lower bounds of |p'|. Shape (k,)."""
        return np.asarray(np.abs(self.starts - (self.angles > 0.0)) - self.changes)

    @property
    def turns(self) -> FloatArray:
        """Upper bounds of the change of p', 0 where it has the length 1. Shape (k,)."""
        rounded = (self.changes > 0.0) | ((self.angles > 0.0) & (self.starts > 0.0))
        return np.where(rounded, self.changes + self.angles, 0.0)


@dataclass(eq=False, repr=False)
class PiecewisePath:
    """Position of the platform over the programmed way s, with derivatives.

    Attributes:
        segments: the path as programmed.
        joints: ways at which segments begin and end. Shape (n + 1,) [m].
        breaks: ascending ways at which the third derivative may jump or a segment ends; between
            them, p is smooth. Shape (k + 1,) [m].
        table: coefficients of ascending powers of the way from each break; for arcs, what is
            added to the arc. Shape (k, degree + 1, 3).
        segment: index of the segment of each span. Shape (k,).
    """

    segments: Segments
    breaks: FloatArray
    table: FloatArray
    segment: Indices

    def __post_init__(self) -> None:
        """Take what is asked for in each cycle."""
        self.joints = self.segments.joints
        self._breaks_view = self.breaks.data

    @property
    def length(self) -> float:
        """Length of the path as programmed [m]."""
        return float(self.joints[-1])

    def spans_of(self, ways: ArrayLike) -> Indices:
        """Return the index of the span that each way lies on, of two the later. Shape (n,)."""
        spans = np.searchsorted(self.breaks, ways, "right") - 1
        return np.asarray(np.clip(spans, 0, len(self.segment) - 1))

    def derivatives(self, ways: ArrayLike, highest: int = 3) -> FloatArray:
        """Return positions, and their derivatives by the programmed way.

        At a break they are those of the span that begins there, save at the very end.

        Args:
            ways: programmed. Shape (n,) [m].
            highest: order of the highest derivative, 5 at most.

        Returns:
            Shape (highest + 1, n, 3) [m, 1, 1/m, ...].
        """
        places = np.asarray(ways, dtype=np.float64)
        return self.derivatives_on(self.spans_of(places), places, highest)

    def derivatives_on(self, spans: Indices, ways: FloatArray, highest: int = 3) -> FloatArray:
        """Return the same as ``derivatives``, on ``spans`` that are known. Shape (n,)."""
        x = ways - self.breaks[spans]
        # Long rows, not short ones, are what numpy is quick with: x, y and z are three of them.
        coefficients = np.ascontiguousarray(self.table[spans].transpose(1, 2, 0))
        result = np.zeros((highest + 1, 3, len(ways)))
        for order in range(min(highest + 1, len(coefficients))):
            if order:
                powers = np.arange(1.0, len(coefficients))[:, np.newaxis, np.newaxis]
                coefficients = coefficients[1:] * powers
            total = result[order]
            total += coefficients[-1]
            for coefficient in coefficients[-2::-1]:
                total *= x
                total += coefficient
        by_place = result.transpose(0, 2, 1)
        if self.segments.is_curved:
            self._add_arcs(by_place, spans, ways)
        return by_place

    def _add_arcs(self, result: FloatArray, spans: Indices, ways: FloatArray) -> None:
        """Add the arcs as programmed to what ``derivatives_on`` returns."""
        on_arcs = np.flatnonzero(self.segments.curvatures[self.segment[spans]])
        if not len(on_arcs):
            return
        segment = self.segment[spans[on_arcs]]
        curvature = self.segments.curvatures[segment][:, np.newaxis]
        angle = curvature * (ways[on_arcs] - self.joints[segment])[:, np.newaxis]
        sine, cosine = np.sin(angle), np.cos(angle)
        half = np.sin(0.5 * angle)
        tangent, normal = self.segments.tangents[segment], self.segments.normals[segment]
        if self.segments.is_helical:
            rise = self.segments.rises[segment]
            tangent = tangent - rise
            result[0, on_arcs] += rise * (ways[on_arcs] - self.joints[segment])[:, np.newaxis]
            result[1:2, on_arcs] += rise
        result[0, on_arcs] += (sine * tangent + 2.0 * half * half * normal) / curvature
        ahead, inwards = cosine * tangent + sine * normal, cosine * normal - sine * tangent
        factor = np.ones_like(curvature)
        for order in range(1, len(result)):
            result[order, on_arcs] += factor * ahead
            factor = factor * curvature
            ahead, inwards = inwards, -ahead

    def state(self, way: float) -> tuple[float, ...]:
        """Return position, first and second derivative at one programmed way [m].

        Returns:
            Nine plain numbers: x, y, z, then their first and their second derivatives.
        """
        span = min(max(bisect_right(self._breaks_view, way) - 1, 0), len(self._breaks_view) - 2)
        x = way - self._breaks_view[span]
        rows = self.table[span].tolist()
        if len(rows) == 4:
            (ax, ay, az), (bx, by, bz), (cx, cy, cz), (dx, dy, dz) = rows
            ex = ey = ez = 0.0
        else:
            (ax, ay, az), (bx, by, bz), (cx, cy, cz), (dx, dy, dz), (ex, ey, ez) = rows
        values = (
            ax + x * (bx + x * (cx + x * (dx + x * ex))),
            ay + x * (by + x * (cy + x * (dy + x * ey))),
            az + x * (bz + x * (cz + x * (dz + x * ez))),
            bx + x * (2.0 * cx + x * (3.0 * dx + x * 4.0 * ex)),
            by + x * (2.0 * cy + x * (3.0 * dy + x * 4.0 * ey)),
            bz + x * (2.0 * cz + x * (3.0 * dz + x * 4.0 * ez)),
            2.0 * cx + x * (6.0 * dx + x * 12.0 * ex),
            2.0 * cy + x * (6.0 * dy + x * 12.0 * ey),
            2.0 * cz + x * (6.0 * dz + x * 12.0 * ez),
        )
        if self.segments.is_curved:
            segment = int(self.segment[span])
            if self.segments.curvatures[segment]:
                return self._with_arc(values, segment, way)
        return values

    def _with_arc(self, values: tuple[float, ...], segment: int, way: float) -> tuple[float, ...]:
        """Return what ``state`` returns, with the arc as programmed added to it."""
        curvature = float(self.segments.curvatures[segment])
        tx, ty, tz = self.segments.tangents[segment].tolist()
        nx, ny, nz = self.segments.normals[segment].tolist()
        ahead = way - float(self.joints[segment])
        px, py, pz, qx, qy, qz, rx, ry, rz = values
        if self.segments.is_helical:
            ux, uy, uz = self.segments.rises[segment].tolist()
            tx, ty, tz = tx - ux, ty - uy, tz - uz
            px, py, pz = px + ahead * ux, py + ahead * uy, pz + ahead * uz
            qx, qy, qz = qx + ux, qy + uy, qz + uz
        angle = curvature * ahead
        sine, cosine, half = sin(angle), cos(angle), sin(0.5 * angle)
        ahead, aside = sine / curvature, 2.0 * half * half / curvature
        bent, bent_back = curvature * cosine, -curvature * sine
        return (
            px + ahead * tx + aside * nx,
            py + ahead * ty + aside * ny,
            pz + ahead * tz + aside * nz,
            qx + cosine * tx + sine * nx,
            qy + cosine * ty + sine * ny,
            qz + cosine * tz + sine * nz,
            rx + bent_back * tx + bent * nx,
            ry + bent_back * ty + bent * ny,
            rz + bent_back * tz + bent * nz,
        )

    def rates(self, spans: Indices, ways: FloatArray) -> FloatArray:
        """Return |p'| on ``spans``. Shape (n,)."""
        x = (ways - self.breaks[spans])[:, np.newaxis]
        highest = self.table.shape[1] - 1
        total = highest * self.table[spans, highest]
        for power in range(highest - 1, 0, -1):
            total *= x
            total += power * self.table[spans, power]
        if self.segments.is_curved:
            on_arcs = np.flatnonzero(self.segments.curvatures[self.segment[spans]])
            segment = self.segment[spans[on_arcs]]
            angle = self.segments.curvatures[segment] * (ways[on_arcs] - self.joints[segment])
            tangent, normal = self.segments.tangents[segment], self.segments.normals[segment]
            if self.segments.is_helical:
                rise = self.segments.rises[segment]
                tangent = tangent - rise
                total[on_arcs] += rise
            total[on_arcs] += np.cos(angle)[:, np.newaxis] * tangent
            total[on_arcs] += np.sin(angle)[:, np.newaxis] * normal
        return lengths_of(total)

    def slow_ways(self, spans: Indices, least: float, samples: int) -> FloatArray:
        """Return ways at which |p'| is less than ``least``, of so many ``samples`` in each span.

        Args:
            spans: indices of those that are looked at. Shape (n,).
            least: the bound.
            samples: number of places, evenly from the begin to the end of a span.

        Returns:
            Shape (m,) [m].
        """
        repeated = np.repeat(spans, samples)
        starts = self.breaks[repeated]
        parts = np.tile(np.linspace(0.0, 1.0, samples), len(spans))
        ways = starts + parts * (self.breaks[repeated + 1] - starts)
        return np.asarray(ways[self.rates(repeated, ways) < least])

    def bounds_on(self, spans: slice) -> SpanBounds:
        """Return upper bounds in each of some ``spans``."""
        steps = np.diff(self.breaks[:-1][spans], append=self.breaks[1:][spans][-1:])
        table = self.table[spans, 1:]
        x, y, z = np.moveaxis(table, 2, 0)
        sizes = np.sqrt(x * x + y * y + z * z)
        changes, bends = np.zeros(len(steps)), np.zeros(len(steps))
        power_of_step = np.ones(len(steps))
        for power in range(2, self.table.shape[1]):
            bends += power * (power - 1) * power_of_step * sizes[:, power - 1]
            power_of_step *= steps
            changes += power * power_of_step * sizes[:, power - 1]
        thirds = 6.0 * sizes[:, 2]
        if sizes.shape[1] == 4:
            thirds += 24.0 * sizes[:, 3] * steps
        curvatures = self.segments.curvatures[self.segment[spans]]
        angles = curvatures * steps
        return SpanBounds(
            sizes[:, 0], changes, angles, bends + curvatures, thirds + curvatures * curvatures
        )

    def sharpness_on(self, spans: slice) -> FloatArray:
        """Return upper bounds of |p''| where some ``spans`` begin and where they end.

        Between, the straight line from one to the other is an upper bound, too. Shape (2, k) [1/m].
        """
        steps = np.diff(self.breaks[spans.start : spans.stop + 1])
        table = self.table[spans]
        at_begin, by_way = 2.0 * table[:, 2], 6.0 * table[:, 3]
        at_end = at_begin + by_way * steps[:, np.newaxis]
        # A straight line of vectors is nowhere longer than that between its ends' lengths.
        more = self.segments.curvatures[self.segment[spans]]
        if table.shape[1] == 5:
            square = 12.0 * table[:, 4] * np.square(steps)[:, np.newaxis]
            at_end += square
            more = more + 0.25 * lengths_of(square)
        return np.array((lengths_of(at_begin) + more, lengths_of(at_end) + more))


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


def polylines_of(driven: PiecewisePath, most: int = MOST_POINTS) -> Interruptible[PathPolylines]:
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


def _evenly(count: int, most: int) -> Indices:
    """Return the indices of so many of ``count`` places at ``most``, both ends among them."""
    return np.linspace(0, count - 1, min(most, count)).round().astype(np.intp)
