"""A path of the platform, put together segment by segment, or out of flat arrays of numbers.

Messages and programs carry such arrays: they are checked at once, and the path is made in pieces.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.checks import array_of_shape, finite, finite_array
from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.interruptible import Interruptible, Kept, at_once, blocks
from tri_glide_kinematics.motion.errors import (
    EmptyPathError,
    PathError,
    SegmentError,
)
from tri_glide_kinematics.motion.path.driven_path import DrivenPath
from tri_glide_kinematics.motion.path.segments import (
    LARGEST_ANGLE,
    LARGEST_PLACE,
    LARGEST_SPEED,
    LEAST_SPEED,
    SHORTEST,
    Segment,
    Segments,
    arc_about,
    arc_through,
    check_coordinates,
    check_count,
    check_joined,
    collected,
    coordinate_of,
    joined,
    line,
    place_of,
    points_of,
    polyline,
    speed_of,
    tolerance_of,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import vector_text

# Number of segments, added one by one, that are put into arrays together.
ADDED_TOGETHER = 300


@dataclass(eq=False, repr=False)
class PlatformPath:
    """Lines, arcs and helices, one after the other, and how they are driven.

    A path never changes: what adds a segment returns a new path, which shares all others. Each
    segment has a tolerance, which belongs to the joint at its end: nowhere around it is the path
    as driven farther from the path as programmed. With the tolerance 0 the platform stops there,
    unless the joint is smooth; it also stops in corners that turn back. (docs/paths.md)

    Use ``start``, ``through`` and what adds a segment to make one.

    Attributes:
        end: where the path ends. Shape (3,) [m].
        count: number of segments.
    """

    end: Vector3
    count: int
    _previous: PlatformPath | None = None
    _part: Segment | Segments | None = None

    def __repr__(self) -> str:
        """Return how many segments it has and where it ends."""
        return f"<PlatformPath, {self.count} segments, end {vector_text(self.end)} m>"

    @classmethod
    def start(cls, position: Iterable[float]) -> PlatformPath:
        """Return a path without segments, from a ``position`` on. Shape (3,) [m].

        Raises:
            WrongShapeError: if it has not three numbers.
            NotFiniteError: if one of them is NaN or infinite.
            OutOfBoundsError: if one of them is larger than 100 m.
        """
        return cls(place_of("start", position), 0)

    @classmethod
    def through(
        cls, points: ArrayLike, tolerance: float = 0.0, speed: float | None = None
    ) -> PlatformPath:
        """Return the polyline through ``points``.

        Args:
            points: two at least. Shape (n, 3) [m].
            tolerance: of all joints [m].
            speed: largest one of the platform [m/s].

        Raises:
            WrongShapeError: if there are fewer than two points, or they have not three numbers.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a number is larger than 100 m, the tolerance negative or the speed
                not greater than zero.
            RepeatedPointError: if two points, one after the other, are the same.
        """
        places = points_of(points)
        part = polyline(places, tolerance_of(0, tolerance), speed_of(0, speed))
        first, last = places[0].tolist(), places[-1].tolist()
        return cls(tuple(last), len(part), cls(tuple(first), 0), part)

    @classmethod
    def of_segments(cls, segments: Segments) -> PlatformPath:
        """Return the path of ``segments`` that are checked and follow one another."""
        first, last = segments.points[0].tolist(), segments.points[-1].tolist()
        return cls(tuple(last), len(segments), cls(tuple(first), 0), segments)

    @classmethod
    def of_parts(cls, parts: Iterable[Segments]) -> Interruptible[PlatformPath]:
        """Return the path of small ``parts``, each made when it is its turn, interruptibly."""
        return cls.of_segments((yield from joined(parts)))

    def line_to(
        self, position: Iterable[float], tolerance: float = 0.0, speed: float | None = None
    ) -> PlatformPath:
        """Return this path with a line added.

        Args:
            position: where it ends. Shape (3,) [m].
            tolerance: of the joint there [m].
            speed: largest one of the platform on it, if it has one of its own [m/s].

        Raises:
            KinematicsError: if a number is not one, or too large, or the line has no length.
        """
        number = self.count
        end = place_of(f"end of segment {number + 1}", position)
        added = line(
            number, self.end, end, tolerance_of(number, tolerance), speed_of(number, speed)
        )
        return self._with(added)

    def arc_to(
        self,
        via: Iterable[float],
        end: Iterable[float],
        tolerance: float = 0.0,
        speed: float | None = None,
    ) -> PlatformPath:
        """Return this path with an arc added, through one point to another.

        Args:
            via: a point of the arc. Shape (3,) [m].
            end: where it ends. Shape (3,) [m].
            tolerance: of the joint there [m].
            speed: largest one of the platform on it, if it has one of its own [m/s].

        Raises:
            KinematicsError: if a number is not one, or too large, or the three points lie on one
                line or coincide.
        """
        number = self.count
        between = place_of(f"via of segment {number + 1}", via)
        last = place_of(f"end of segment {number + 1}", end)
        bounds = tolerance_of(number, tolerance), speed_of(number, speed)
        return self._with(arc_through(number, self.end, between, last, *bounds))

    def arc_about(
        self,
        centre: Iterable[float],
        axis: Iterable[float],
        angle: float,
        tolerance: float = 0.0,
        speed: float | None = None,
        rise: float = 0.0,
    ) -> PlatformPath:
        """Return this path with an arc about an axis added, a full circle, several, or a helix.

        Args:
            centre: a point of the axis. Shape (3,) [m].
            axis: its direction; its length does not matter. Shape (3,).
            angle: right-handed about the axis, of any size but zero [rad].
            tolerance: of the joint at its end [m].
            speed: largest one of the platform on it, if it has one of its own [m/s].
            rise: how far it leads along the axis while it turns; other than 0 makes a helix [m].

        Raises:
            KinematicsError: if a number is not one, or too large, the axis or the angle is zero, or
                the path ends on the axis.
        """
        number = self.count
        middle = place_of(f"centre of segment {number + 1}", centre)
        direction = place_of(f"axis of segment {number + 1}", axis)
        turn = finite(f"angle of segment {number + 1}", angle, LARGEST_ANGLE)
        bounds = tolerance_of(number, tolerance), speed_of(number, speed)
        along = coordinate_of(f"rise of segment {number + 1}", rise)
        return self._with(arc_about(number, self.end, middle, direction, turn, *bounds, along))

    def then(self, other: PlatformPath) -> PlatformPath:
        """Return this path with another added, which begins where this one ends.

        The joint between has the tolerance of this path's last segment.

        Raises:
            ApartError: if it begins elsewhere.
            EmptyPathError: if one of them has no segment.
        """
        before, after = self.segments, other.segments
        check_joined(before, after)
        return PlatformPath.of_segments(at_once(joined((before, after))))

    def reversed(self) -> PlatformPath:
        """Return the same path, driven from its end to its start.

        Raises:
            EmptyPathError: if it has no segment.
        """
        return PlatformPath.of_segments(self.segments.reversed())

    @Kept
    def segments(self) -> Interruptible[Segments]:
        """All segments, in arrays.

        Raises:
            EmptyPathError: if there is none.
        """
        return joined(self._parts(), backwards=True)

    @Kept
    def driven(self) -> Interruptible[DrivenPath]:
        """The path as driven.

        Raises:
            EmptyPathError: if the path has no segment.
        """
        segments = yield from PlatformPath.segments.in_pieces(self)
        yield
        return (yield from DrivenPath.of(segments))

    def driven_in_pieces(self) -> Interruptible[DrivenPath]:
        """Return the path as driven, interruptibly.

        Raises:
            EmptyPathError: if the path has no segment.
        """
        return PlatformPath.driven.in_pieces(self)

    @property
    def length(self) -> float:
        """Length of the path as driven [m]."""
        return self.driven.arc_length.total

    def position(self, way: ArrayLike) -> FloatArray:
        """Return where the platform is after a ``way`` driven [m].

        Args:
            way: one number, or n of them with shape (n,); beyond an end, the end counts [m].

        Returns:
            Shape (3,), or (n, 3) for n ways [m].

        Raises:
            WrongShapeError: if the ways have another shape.
            NotANumberError: if one of them is no number.
        """
        return self._derivative(way, 0)

    def tangent(self, way: ArrayLike) -> FloatArray:
        """Return the direction in which the platform moves after a ``way`` driven [m].

        Args:
            way: one number, or n of them with shape (n,); in a corner where the platform stops,
                the direction after it.

        Returns:
            Unit vectors. Shape (3,), or (n, 3) for n ways.

        Raises:
            WrongShapeError: if the ways have another shape.
            NotANumberError: if one of them is no number.
        """
        vectors = self._derivative(way, 1)
        return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))

    def _derivative(self, way: ArrayLike, order: int) -> FloatArray:
        is_one = not hasattr(way, "__len__") or (isinstance(way, np.ndarray) and not way.ndim)
        ways = array_of_shape("way", np.reshape(way, 1) if is_one else way, (None,))
        rows = self.driven.derivatives(self.driven.place_of(ways), order)[order]
        return np.asarray(rows[0]) if is_one else rows

    def _with(self, segment: Segment) -> PlatformPath:
        return PlatformPath(segment.end, self.count + 1, self, segment)

    def _parts(self) -> Iterator[Segments]:
        """Yield all segments in arrays, the last ones first; without recursion."""
        added: list[Segment] = []
        here = self
        while here._previous is not None:
            if isinstance(here._part, Segment):
                added.append(here._part)
            elif here._part is not None:
                yield here._part
            here = here._previous
            if added and (len(added) >= ADDED_TOGETHER or not isinstance(here._part, Segment)):
                yield collected(here.end, added[::-1])
                added = []
        if not self.count:
            raise EmptyPathError(self.end)


# Shorter runs of lines are made one by one.
SHORTEST_RUN = 16

# Number of lines, and of points, that are worked on together.
LINES_TOGETHER = 2000

# Number of segments, made one by one, that are put into arrays together.
SINGLES_TOGETHER = 32


class SegmentKind(IntEnum):
    """What the numbers of a segment mean."""

    LINE = 0
    ARC_THROUGH = 1
    ARC_ABOUT = 2
    HELIX_ABOUT = 3


# How many numbers each takes: an end; a point between and an end; a centre, an axis and an angle;
# these and a rise along the axis.
SIZES = np.array((3, 6, 7, 8))
PLACE_OF_ANGLE = 6


@dataclass(frozen=True, eq=False)
class FlatPath:
    """Segments as numbers.

    Attributes:
        kinds: Shape (n,).
        numbers: of all segments, one after the other [m], [rad].
        offsets: of the first number of each segment. Shape (n,).
        tolerances: Shape (n,) [m].
        speeds: infinite for none. Shape (n,) [m/s].
    """

    kinds: NDArray[np.uint8]
    numbers: FloatArray
    offsets: NDArray[np.int64]
    tolerances: FloatArray
    speeds: FloatArray

    @classmethod
    def of(
        cls,
        kinds: ArrayLike,
        numbers: ArrayLike,
        tolerances: ArrayLike,
        speeds: ArrayLike,
        default_tolerance: float,
    ) -> FlatPath:
        """Return the segments, if their numbers can be those of a path.

        Args:
            kinds: of ``SegmentKind``. Shape (n,).
            numbers: as many as the kinds need [m], [rad].
            tolerances: of the joints at the ends; one for each segment, one for all, or none [m].
            speeds: of the platform; one for each segment, one for all, or none; 0 is none [m/s].
            default_tolerance: where none is given [m].

        Raises:
            PathError: if there is no segment, or one of a kind that is unknown, or too many.
            WrongShapeError: if there are too many or too few numbers.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a number is too large, or a tolerance or a speed negative.
        """
        codes = np.asarray(kinds, dtype=np.uint8)
        count = len(codes)
        if not count:
            raise PathError("the path has 0 segments, at least 1")
        check_count(count)
        if codes.max() >= len(SIZES):
            index = int((codes >= len(SIZES)).argmax())
            raise SegmentError(index, f"has kind {codes[index]}, at most {len(SIZES) - 1}")
        offsets = np.zeros(count + 1, dtype=np.int64)
        np.cumsum(SIZES[codes], out=offsets[1:])
        values = np.asarray(numbers, dtype=np.float64)
        if len(values) != offsets[-1]:
            shape = f"({offsets[-1]},) for the kinds of {count} segments"
            raise WrongShapeError("numbers", values.shape, shape)
        _check_numbers(codes, values, offsets)
        given_speeds = _checked("speeds", speeds, count, LARGEST_SPEED, "m/s")
        slow = (given_speeds > 0.0) & (given_speeds < LEAST_SPEED)
        if slow.any():
            index = int(slow.argmax())
            bound = f"0, or at least {LEAST_SPEED:g}"
            raise OutOfBoundsError(f"speeds[{index}]", float(given_speeds[index]), bound, "m/s")
        given_tolerances = _checked("tolerances", tolerances, count, LARGEST_PLACE, "m")
        return cls(
            codes,
            values,
            offsets[:-1],
            _of_each(given_tolerances, count, default_tolerance),
            _of_each(np.where(given_speeds > 0.0, given_speeds, math.inf), count, math.inf),
        )

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.kinds)

    def part(self, first: int, end: int) -> FlatPath:
        """Return the segments from ``first`` on, up to the one before ``end``."""
        begin = int(self.offsets[first])
        stop = int(self.offsets[end]) if end < len(self) else len(self.numbers)
        return FlatPath(
            self.kinds[first:end],
            self.numbers[begin:stop],
            self.offsets[first:end] - begin,
            self.tolerances[first:end],
            self.speeds[first:end],
        )

    def start_of(self, segment: int, start: Vector3) -> Vector3:
        """Return where a ``segment`` begins [m], if the path begins at ``start`` [m].

        Raises:
            SegmentError: if an arc before it is none.
        """
        # An arc or helix about an axis does not name its end, all others do.
        known = segment
        while known and self.kinds[known - 1] >= SegmentKind.ARC_ABOUT:
            known -= 1
        here = start
        if known:
            end = int(self.offsets[known - 1] + SIZES[self.kinds[known - 1]])
            here = _vector(self.numbers[end - 3 : end])
        for number in range(known, segment):
            here = self._single(number, here).end
        return here

    def path_from(self, start: Vector3) -> Interruptible[PlatformPath]:
        """Return the path that begins at ``start`` [m].

        Raises:
            SegmentError: if a segment has no length, or its numbers determine no arc.
        """
        is_line = len(self) > 1 and self.kinds[0] == SegmentKind.LINE
        if is_line and math.dist(start, _vector(self.numbers[:3])) < SHORTEST:
            # A first point taken from a measurement is a little beside the setpoint.
            return self.part(1, len(self)).path_from(_vector(self.numbers[:3]))
        return PlatformPath.of_parts(self._parts(start))

    def _parts(self, start: Vector3) -> Iterator[Segments]:
        """Yield some segments after the other."""
        turns = np.flatnonzero(np.diff(self.kinds != SegmentKind.LINE)) + 1
        bounds = [0, *turns.tolist(), len(self)]
        singles: list[Segment] = []
        begin = here = start
        for first, last in itertools.pairwise(bounds):
            if self.kinds[first] == SegmentKind.LINE and last - first >= SHORTEST_RUN:
                if singles:
                    yield collected(begin, singles)
                    singles = []
                for some in blocks(last - first, LINES_TOGETHER):
                    lines = self._lines(first + some.start, first + some.stop, here)
                    begin = here = _vector(lines.points[-1])
                    yield lines
                continue
            for number in range(first, last):
                singles.append(self._single(number, here))
                here = singles[-1].end
                if len(singles) == SINGLES_TOGETHER:
                    yield collected(begin, singles)
                    singles, begin = [], here
        if singles:
            yield collected(begin, singles)

    def _lines(self, first: int, last: int, start: Vector3) -> Segments:
        """Return segments that are all lines."""
        offset = int(self.offsets[first])
        ends = self.numbers[offset : offset + 3 * (last - first)].reshape(-1, 3)
        points = np.concatenate((np.array([start]), ends))
        return polyline(points, self.tolerances[first:last], self.speeds[first:last], first)

    def _single(self, number: int, start: Vector3) -> Segment:
        kind = int(self.kinds[number])
        offset = int(self.offsets[number])
        given = self.numbers[offset : offset + int(SIZES[kind])].tolist()
        bounds = float(self.tolerances[number]), float(self.speeds[number])
        first = _vector(given[:3])
        if kind == SegmentKind.LINE:
            return line(number, start, first, *bounds)
        second = _vector(given[3:6])
        if kind == SegmentKind.ARC_THROUGH:
            return arc_through(number, start, first, second, *bounds)
        angle, *rise = given[PLACE_OF_ANGLE:]
        return arc_about(number, start, first, second, angle, *bounds, *rise)


def polyline_from(
    start: Vector3, points: FloatArray, tolerance: float
) -> Interruptible[PlatformPath]:
    """Return the polyline from ``start`` [m] through ``points``; repeated ones count once.

    Args:
        start: Shape (3,) [m].
        points: Shape (n, 3) [m].
        tolerance: of all joints [m].

    Raises:
        PathError: if all points are at the start.
        NotFiniteError: if a number is NaN or infinite.
        OutOfBoundsError: if a number is too large.
        ShortSegmentError: if points are the same though none is that of the one before it.
        TooManySegmentsError: if there are too many points.
    """
    return PlatformPath.of_parts(_lines_through(start, points, tolerance))


def _lines_through(start: Vector3, points: FloatArray, tolerance: float) -> Iterator[Segments]:
    """Yield the lines from ``start`` through some ``points`` after the other."""
    check_count(len(points))
    end = before = np.array([place_of("start", start)])
    limit = tolerance_of(0, tolerance)
    count = 0
    for some in blocks(len(points), LINES_TOGETHER):
        places = points[some]
        check_coordinates(places, some.start)
        steps = np.diff(places, axis=0, prepend=before)
        before = places[-1:]
        new = np.concatenate(
            (
                end,
                places[np.einsum("ij,ij->i", steps, steps) >= SHORTEST * SHORTEST],
            )
        )
        if len(new) > 1:
            yield polyline(new, limit, number=count)
            count += len(new) - 1
            end = new[-1:]
    if not count:
        raise PathError("the path has 0 segments, at least 1: all its points are where it begins")


def _check_numbers(
    kinds: NDArray[np.uint8], numbers: FloatArray, offsets: NDArray[np.int64]
) -> None:
    """Check that all numbers are finite and not too large.

    It goes from block to block, as fresh memory for a million segments takes longer than the check.

    Args:
        kinds: Shape (n,).
        numbers: of all segments.
        offsets: of the first number of each segment, and of the end. Shape (n + 1,).
    """
    for some in blocks(len(kinds)):
        firsts = offsets[some]
        begin, end = int(firsts[0]), int(offsets[some.stop])
        part = numbers[begin:end]
        largest = np.full(len(part), LARGEST_PLACE)
        angles = firsts[kinds[some] >= SegmentKind.ARC_ABOUT] + PLACE_OF_ANGLE
        largest[angles - begin] = LARGEST_ANGLE
        bad = ~(np.abs(part) <= largest)
        if bad.any():
            index = int(bad.argmax())
            segment = int(np.searchsorted(offsets, begin + index, side="right"))
            place = begin + index - int(offsets[segment - 1])
            name = f"number {place + 1} of segment {segment}"
            value = float(part[index])
            if not math.isfinite(value):
                raise NotFiniteError(name, value)
            raise OutOfBoundsError(name, value, f"at most {largest[index]:g} in absolute value")


def _checked(name: str, values: ArrayLike, count: int, largest: float, unit: str) -> FloatArray:
    """Return a number for each of ``count`` segments, one for all of them, or none."""
    given = finite_array(name, values, (None,))
    if len(given) not in (0, 1, count):
        shapes = "(1,) or (0,)" if count == 1 else f"({count},), (1,) or (0,)"
        raise WrongShapeError(name, given.shape, shapes)
    bad = ~((given >= 0.0) & (given <= largest))
    if bad.any():
        index = int(bad.argmax())
        bound = f"at least 0 and at most {largest:g}"
        raise OutOfBoundsError(f"{name}[{index}]", float(given[index]), bound, unit)
    return given


def _of_each(given: FloatArray, count: int, default: float) -> FloatArray:
    """Return one number for each segment; one for all of them takes no memory."""
    if len(given) == count:
        return given.copy()
    return np.broadcast_to(given[0] if len(given) else default, count)


def _vector(values: FloatArray | Sequence[float]) -> Vector3:
    x, y, z = map(float, values)
    return x, y, z
