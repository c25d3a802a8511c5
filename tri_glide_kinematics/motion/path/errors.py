"""What can be wrong with a path."""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.wording import number_text, vector_text


class PathError(KinematicsError):
    """There is no such path, or it cannot be driven."""

    refusal = Refusal.PATH


class EmptyPathError(PathError):
    """A path has a start but no segment."""

    def __init__(self, position: Sequence[float]) -> None:
        """Store the ``position`` of the start [m]."""
        super().__init__(f"the path from {vector_text(position)} m has 0 segments, at least 1")
        self.position = tuple(position)


class TooManySegmentsError(PathError):
    """A path has more segments than are taken.

    Attributes:
        count: how many it has.
        most: how many it may have.
    """

    def __init__(self, count: int, most: int) -> None:
        """Store how many there are, and how many there may be at ``most``."""
        super().__init__(f"the path has {count} segments, at most {most}")
        self.count = count
        self.most = most


class SegmentError(PathError):
    """A segment of a path is none.

    Attributes:
        segment: its index; the text counts from 1.
    """

    def __init__(self, segment: int, text: str) -> None:
        """Store the index of the ``segment`` and what the ``text`` says of it."""
        super().__init__(f"segment {segment + 1} {text}")
        self.segment = segment


class ShortSegmentError(SegmentError):
    """A segment ends where it begins."""

    def __init__(
        self, segment: int, position: Sequence[float], length: float, shortest: float
    ) -> None:
        """Store the index of the ``segment``, its ``position``, its ``length`` and a bound [m]."""
        super().__init__(
            segment,
            f"ends where it begins, at {vector_text(position)} m: it is "
            f"{number_text(length, 3, 0.0)} m long, at least {number_text(shortest, 3, 0.0)} m",
        )
        self.position = tuple(position)
        self.length = length
        self.shortest = shortest


class RepeatedPointError(ShortSegmentError):
    """Two points of a polyline, one after the other, are the same."""

    def __init__(
        self, segment: int, point: int, position: Sequence[float], length: float, shortest: float
    ) -> None:
        """Store the indices of the ``segment`` and of the first ``point``, and what is short."""
        super().__init__(segment, position, length, shortest)
        self.args = (
            f"points[{point}] and points[{point + 1}], the ends of segment {segment + 1}, are the "
            f"same, {vector_text(position)} m: {number_text(length, 3, 0.0)} m apart, at least "
            f"{number_text(shortest, 3, 0.0)} m",
        )
        self.point = point


class NoArcError(SegmentError):
    """The numbers given for an arc determine none."""

    def __init__(
        self, segment: int, reason: str, value: float, bound: float, above: bool, unit: str = "m"
    ) -> None:
        """Store what is wrong.

        Args:
            segment: its index.
            reason: in words, ending with what the number is.
            value: the number.
            bound: that it breaks.
            above: whether it is above the bound, which is the largest then.
            unit: of both.
        """
        side = "at most" if above else "at least"
        super().__init__(
            segment,
            f"is no arc: {reason} = {number_text(value, 6, 0.0)} {unit} must be {side} "
            f"{number_text(bound, 6, 0.0)} {unit}",
        )
        self.reason = reason
        self.value = value
        self.bound = bound


class ApartError(PathError):
    """A path does not begin where the one before it ends."""

    def __init__(
        self, end: Sequence[float], start: Sequence[float], distance: float, largest: float
    ) -> None:
        """Store both places [m], their ``distance`` [m] and the ``largest`` one [m]."""
        super().__init__(
            f"the path begins at {vector_text(start)} m, {number_text(distance, 3, 0.0)} m from "
            f"the end of the one before at {vector_text(end)} m, at most "
            f"{number_text(largest, 3, 0.0)} m"
        )
        self.end = tuple(end)
        self.start = tuple(start)
        self.distance = distance
        self.largest = largest


class PathPlaceError(PathError):
    """The platform cannot be at a place of a path.

    Attributes:
        segment: index of the segment (the text counts from 1).
        position: of the platform [m].
        reason: in words, which name the place.
    """

    refusal = Refusal.OUTSIDE_WORKSPACE

    def __init__(self, segment: int, position: Sequence[float], reason: str) -> None:
        """Store the index of the ``segment``, the ``position`` [m] and the ``reason``."""
        super().__init__(f"segment {segment + 1} of the path: {reason}")
        self.segment = segment
        self.position = tuple(position)
        self.reason = reason
