"""A path of the platform, put together segment by segment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import dist

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import array_of_shape, finite
from tri_glide_kinematics.interruptible import Interruptible, Kept, at_once
from tri_glide_kinematics.motion.path.driven_path import DrivenPath
from tri_glide_kinematics.motion.path.errors import ApartError, EmptyPathError
from tri_glide_kinematics.motion.path.segments import (
    JOINED_WITHIN,
    LARGEST_ANGLE,
    Segment,
    Segments,
    arc_about,
    arc_through,
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


class PlatformPath:
    """Lines, arcs and helices, one after the other, and how they are driven.

    A path never changes: what adds a segment returns a new path, which shares all others. Each
    segment has a tolerance, which belongs to the joint at its end: nowhere around it is the path
    as driven farther from the path as programmed. With the tolerance 0 the platform stops there,
    unless the joint is smooth; it also stops in corners that turn back. (docs/paths.md)

    Attributes:
        end: where the path ends. Shape (3,) [m].
        count: number of segments.
    """

    def __init__(
        self,
        end: Vector3,
        count: int,
        previous: PlatformPath | None = None,
        part: Segment | Segments | None = None,
    ) -> None:
        """Use ``start``, ``through`` and what adds a segment instead."""
        self.end = end
        self.count = count
        self._previous = previous
        self._part = part

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
        start = after.points[0].tolist()
        distance = dist(self.end, start)
        if not distance <= JOINED_WITHIN:
            raise ApartError(self.end, start, distance, JOINED_WITHIN)
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
