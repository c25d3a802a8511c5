"""Why a motion is refused, and what can be wrong with a path."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType

from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.wording import number_text, vector_text


class MotionError(KinematicsError):
    """A motion is refused; what moves goes on as it was."""

    refusal = Refusal.NO_PLAN


class NotStartedError(MotionError):
    """A command came before the engine knew the heights that the sliders have."""

    refusal = Refusal.WAITING

    def __init__(self) -> None:
        """Store the fixed text."""
        super().__init__("the motion has not been started from measured slider heights")


class PlanningError(MotionError):
    """No trajectory was found."""

    def __init__(self, reason: str) -> None:
        """Store the ``reason``."""
        super().__init__(f"no trajectory found: {reason}")
        self.reason = reason


class PlanTooLongError(PlanningError):
    """A plan takes more work than is done for one."""

    def __init__(self, pieces: int, causes: Sequence[str]) -> None:
        """Store how many ``pieces`` of work it may take, and in words what makes it long."""
        text = f"it takes more than {pieces} pieces of work"
        super().__init__(f"{text}; it is long with {' and '.join(causes)}" if causes else text)
        self.pieces = pieces
        self.causes = tuple(causes)


class CutBendError(MotionError):
    """A shaper would cut a bend of a path by more than its tolerance leaves."""

    def __init__(self, segment: int, cut: float | None = None) -> None:
        """Store where, and by how much more.

        Args:
            segment: index of the segment that bends.
            cut: as part of what is left of the tolerance; None if nothing is left.
        """
        bend = f"segment {segment + 1} of the path bends"
        reason = (
            f"{bend} and has the tolerance 0: a shaper cuts bends; give it a tolerance, or set no "
            "shaper"
            if cut is None
            else f"{bend}: the shaper would cut it by {number_text(cut, 4)} times what is left of "
            "its tolerance"
        )
        super().__init__(reason)
        self.segment = segment
        self.cut = cut


class LimitError(MotionError):
    """A trajectory would exceed a limit: of a slider, or one that is added to these.

    Attributes:
        quantity: that is limited, in words.
        value: largest one on the trajectory; NaN if it is not known.
        limit: that it breaks.
        unit: of both.
        time: when on the trajectory, if that is known [s].
    """

    def __init__(
        self, text: str, quantity: str, value: float, limit: float, unit: str, time: float | None
    ) -> None:
        """Store all of it, and the ``text``."""
        super().__init__(text)
        self.quantity = quantity
        self.value = value
        self.limit = limit
        self.unit = unit
        self.time = time


class SliderLimitError(LimitError):
    """A trajectory would ask more of a slider than its limit."""

    def __init__(
        self,
        quantity: str,
        slider: int,
        value: float,
        limit: float,
        unit: str,
        time: float | None = None,
    ) -> None:
        """Store which limit.

        Args:
            quantity: ``velocity``, ``acceleration`` or ``jerk``.
            slider: index, 0 to 2 (the text counts from 1).
            value: largest absolute value on the trajectory.
            limit: the bound that it breaks.
            unit: of both.
            time: when on the trajectory, if that is known [s].
        """
        text = (
            f"{quantity} of slider {slider + 1} would be {number_text(value)} {unit}, its limit "
            f"is {number_text(limit)} {unit}"
        )
        super().__init__(text, quantity, value, limit, unit, time)
        self.slider = slider

    @property
    def slowdown(self) -> float:
        """By which factor the motion would have to be slower to keep the limit."""
        order = ("velocity", "acceleration", "jerk").index(self.quantity) + 1
        return float((self.value / self.limit) ** (1.0 / order))


class AddedBoundError(LimitError):
    """A trajectory would exceed a bound that is added to the limits of the sliders."""

    def __init__(self, quantity: str, value: float, limit: float, unit: str, time: float) -> None:
        """Store which bound; its arguments are those of a ``LimitError``."""
        reached = f"would be {number_text(value)} {unit}" if value == value else "is not known"
        text = f"{quantity} {reached.rstrip()}, its limit is {number_text(limit)} {unit}"
        super().__init__(text.rstrip(), quantity, value, limit, unit, time)


class SliderTravelError(MotionError):
    """A trajectory would leave the travel of a slider."""

    def __init__(self, slider: int, height: float, bound: float) -> None:
        """Store the index of the ``slider``, its ``height`` and the ``bound`` it passes, in [m]."""
        super().__init__(
            f"slider {slider + 1} would pass the end of its travel at {number_text(bound)} m "
            f"and reach {number_text(height)} m"
        )
        self.slider = slider
        self.height = height
        self.bound = bound


class NoRoomError(MotionError):
    """The platform is at the edge of the workspace in the direction in which it is to move."""

    refusal = Refusal.NO_ROOM

    def __init__(self, position: Sequence[float], direction: Sequence[float], reason: str) -> None:
        """Store the ``position`` [m], the unit vector ``direction`` and the ``reason`` in words."""
        super().__init__(
            f"no room to move from {vector_text(position)} m in the direction "
            f"{vector_text(direction, 6)}: {reason}"
        )
        self.position = tuple(position)
        self.direction = tuple(direction)
        self.reason = reason


class NoPathError(MotionError):
    """No path is followed."""

    refusal = Refusal.NO_PATH

    def __init__(self, purpose: str) -> None:
        """Store for what ``purpose`` there has to be one, in words."""
        super().__init__(f"no path {purpose}: none is followed")
        self.purpose = purpose


class NewerGoalError(MotionError):
    """A goal is being planned that takes the place of the one that this is about."""

    refusal = Refusal.NEWER_COMMAND

    def __init__(self) -> None:
        """Store the fixed text."""
        super().__init__("a newer goal is being planned; once it is begun this can be asked again")


class PathTimingError(PlanningError):
    """No motion along a path was found."""

    def __init__(self, segment: int, place: float, reason: str) -> None:
        """Store the index of the ``segment``, the ``place`` [m] and the ``reason`` in words."""
        super().__init__(f"segment {segment + 1} of the path, {place:.6g} m along it: {reason}")
        self.segment = segment
        self.place = place


class _Sound:
    """A context in which absurd numbers are an error of planning."""

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        _: TracebackType | None,
    ) -> None:
        """Raise a ``PlanningError`` in place of what absurd numbers raise."""
        if isinstance(error, (ArithmeticError, ValueError, IndexError)) and not isinstance(
            error, KinematicsError
        ):
            text = f"the numbers of the motion lead nowhere: {error}"
            raise PlanningError(text) from error


SOUND = _Sound()


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
