"""Every error that this package raises on purpose; each carries the data that explains it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tri_glide_kinematics.wording import number_text, vector_text

if TYPE_CHECKING:
    from tri_glide_kinematics.workspace.limits import WorkspaceLimit


class KinematicsError(ValueError):
    """Base of all errors of this package.

    The text of a subclass names the offending number and the bound that it breaks, so that it can
    be read in a log without the code beside it.
    """


class NotFiniteError(KinematicsError):
    """A number is NaN or infinite where only finite ones have a meaning."""

    def __init__(self, name: str, value: float) -> None:
        """Store the ``name`` of the quantity and its ``value``."""
        super().__init__(f"{name} = {value} is not a finite number")
        self.name = name
        self.value = value


class OutOfBoundsError(KinematicsError):
    """A number lies outside the interval in which it is allowed."""

    def __init__(self, name: str, value: float, bound: str, unit: str = "") -> None:
        """Store what was checked.

        Args:
            name: what the number is, for example ``arm_lengths[1]``.
            value: the offending number.
            bound: the bound in words, for example ``greater than 0``.
            unit: unit of both, for example ``m``.
        """
        suffix = f" {unit}" if unit else ""
        # However small: that may be what is wrong with it.
        text = number_text(value, scale=0.0)
        super().__init__(f"{name} = {text}{suffix} must be {bound}{suffix}")
        self.name = name
        self.value = value
        self.bound = bound
        self.unit = unit


class WrongShapeError(KinematicsError):
    """An array has not the shape that its meaning demands."""

    def __init__(self, name: str, shape: tuple[int, ...], expected: str) -> None:
        """Store the ``name`` of the array, its ``shape`` and the ``expected`` one in words."""
        super().__init__(f"{name} has shape {shape}, expected {expected}")
        self.name = name
        self.shape = shape
        self.expected = expected


class GeometryError(KinematicsError):
    """Lengths and places from which no working tri-glide can be built."""


class CoincidentAnchorsError(GeometryError):
    """Two anchors lie at the same place, so that two arms do the work of one."""

    def __init__(self, arms: tuple[int, int], place: Sequence[float], distance: float) -> None:
        """Store the indices of both ``arms``, the ``place`` [m] and the ``distance`` [m]."""
        super().__init__(
            f"anchors of arms {arms[0] + 1} and {arms[1] + 1} coincide at "
            f"{vector_text(place)} m, {number_text(distance, 3)} m apart"
        )
        self.arms = arms
        self.place = tuple(place)
        self.distance = distance


class CollinearAnchorsError(GeometryError):
    """The anchors lie on one line, so that nothing holds the platform across it."""

    def __init__(self, anchors: Sequence[Sequence[float]], height: float) -> None:
        """Store the ``anchors`` [m] and the least ``height`` of their triangle [m]."""
        places = ", ".join(map(vector_text, anchors))
        super().__init__(
            f"anchors {places} m lie on one line: their triangle is {number_text(height, 3)} m high"
        )
        self.anchors = tuple(tuple(anchor) for anchor in anchors)
        self.height = height


class ArmsNeverMeetError(GeometryError):
    """The arms are too short for their anchors: no place lies within reach of all three."""

    def __init__(self, anchors: Sequence[Sequence[float]], arm_lengths: Sequence[float]) -> None:
        """Store the ``anchors`` [m] and the ``arm_lengths`` [m]."""
        places = ", ".join(map(vector_text, anchors))
        lengths = ", ".join(map(number_text, arm_lengths))
        super().__init__(
            f"arms of {lengths} m at anchors {places} m never meet: no place is within reach of all"
        )
        self.anchors = tuple(tuple(anchor) for anchor in anchors)
        self.arm_lengths = tuple(arm_lengths)


class UnreachableError(KinematicsError):
    """The platform cannot be held at a position."""

    def __init__(self, message: str, position: Sequence[float]) -> None:
        """Store the ``position`` [m] that the ``message`` is about."""
        super().__init__(message)
        self.position = tuple(position)


class ArmTooShortError(UnreachableError):
    """An arm does not span the horizontal distance to its tower."""

    def __init__(
        self, position: Sequence[float], arm: int, distance: float, arm_length: float
    ) -> None:
        """Store what is too far.

        Args:
            position: of the platform [m].
            arm: index of the arm, 0 to 2 (the text counts from 1).
            distance: horizontal distance from the platform to the arm's anchor [m].
            arm_length: [m].
        """
        super().__init__(
            f"position {vector_text(position)} m is out of reach of arm {arm + 1}: horizontal "
            f"distance {number_text(distance)} m, arm length {number_text(arm_length)} m",
            position,
        )
        self.arm = arm
        self.distance = distance
        self.arm_length = arm_length


class WrongAssemblyModeError(UnreachableError):
    """The platform would have to be above, or in, the plane through the three carriages."""

    def __init__(self, position: Sequence[float], plane_height: float) -> None:
        """Store the ``position`` [m] and the ``plane_height`` [m].

        Args:
            position: of the platform [m].
            plane_height: of the carriages' plane over the platform [m]; negative if below it.
        """
        super().__init__(
            f"position {vector_text(position)} m belongs to the other assembly mode: the plane "
            f"of the carriages is {number_text(plane_height, 3)} m above it, not more than 0 m",
            position,
        )
        self.plane_height = plane_height


class OutsideWorkspaceError(KinematicsError):
    """A place breaks a limit of the workspace."""

    def __init__(
        self,
        limit: WorkspaceLimit,
        arm: int | None,
        position: Sequence[float],
        value: float,
        bound: float,
    ) -> None:
        """Store which limit is broken, and where.

        Args:
            limit: that is broken.
            arm: index of the arm (and slider), if the limit belongs to one.
            position: of the platform [m].
            value: of the limited quantity, in the limit's unit.
            bound: that it breaks.
        """
        of_arm = "" if arm is None else f" of arm {arm + 1}"
        unit = f" {limit.unit}" if limit.unit else ""
        super().__init__(
            f"outside the workspace at {vector_text(position)} m: {number_text(value)}{unit} "
            f"breaks the {limit.value}{of_arm}, {number_text(bound)}{unit}"
        )
        self.limit = limit
        self.arm = arm
        self.position = tuple(position)
        self.value = value
        self.bound = bound


class NoPoseError(KinematicsError):
    """Slider heights to which no pose of the platform below the sliders belongs."""

    def __init__(self, message: str, heights: Sequence[float]) -> None:
        """Store the slider ``heights`` [m] that the ``message`` is about."""
        super().__init__(message)
        self.heights = tuple(heights)


class SpheresDoNotMeetError(NoPoseError):
    """The sphere about each carriage with its arm as radius: all three have no common point."""

    def __init__(self, heights: Sequence[float], discriminant: float) -> None:
        """Store the slider ``heights`` [m] and the ``discriminant`` [m^2] (not positive)."""
        super().__init__(
            f"slider heights {vector_text(heights)} m are too far apart: the arms do not "
            f"meet (discriminant {number_text(discriminant, 3)} m^2)",
            heights,
        )
        self.discriminant = discriminant


class PlatformAboveSliderError(NoPoseError):
    """The arms meet, but one of them does not lead upwards to its slider."""

    def __init__(self, heights: Sequence[float], arm: int, rise: float) -> None:
        """Store the slider ``heights`` [m], the index of the ``arm`` and its ``rise`` [m]."""
        super().__init__(
            f"slider heights {vector_text(heights)} m put the platform above slider "
            f"{arm + 1}: arm {arm + 1} rises by {number_text(rise, 3)} m, not more than 0 m",
            heights,
        )
        self.arm = arm
        self.rise = rise


class MotionError(KinematicsError):
    """A motion is refused; what moves goes on as it was."""


class NotStartedError(MotionError):
    """A command came before the engine knew the heights that the sliders have."""

    def __init__(self) -> None:
        """Store the fixed text."""
        super().__init__("the motion has not been started from measured slider heights")


class PlanningError(MotionError):
    """No trajectory was found."""

    def __init__(self, reason: str) -> None:
        """Store the ``reason``."""
        super().__init__(f"no trajectory found: {reason}")
        self.reason = reason


class SliderLimitError(MotionError):
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
        super().__init__(
            f"{quantity} of slider {slider + 1} would be {number_text(value)} {unit}, its limit "
            f"is {number_text(limit)} {unit}"
        )
        self.quantity = quantity
        self.slider = slider
        self.value = value
        self.limit = limit
        self.unit = unit
        self.time = time

    @property
    def slowdown(self) -> float:
        """By which factor the motion would have to be slower to keep the limit."""
        order = ("velocity", "acceleration", "jerk").index(self.quantity) + 1
        return float((self.value / self.limit) ** (1.0 / order))


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

    def __init__(self, position: Sequence[float], direction: Sequence[float], reason: str) -> None:
        """Store the ``position`` [m], the unit vector ``direction`` and the ``reason`` in words."""
        super().__init__(
            f"no room to move from {vector_text(position)} m in the direction "
            f"{vector_text(direction, 6)}: {reason}"
        )
        self.position = tuple(position)
        self.direction = tuple(direction)
        self.reason = reason


class NotAssemblableError(KinematicsError):
    """Four links cannot be joined to a linkage that moves: one is too long for the others."""

    def __init__(self, link: str, length: float, rest: float) -> None:
        """Store the too long ``link``, its ``length`` and the ``rest`` of the links, in [m]."""
        super().__init__(
            f"{link} = {number_text(length, scale=0.0)} m must be shorter than the other three "
            f"links together, which are {number_text(rest, scale=0.0)} m"
        )
        self.link = link
        self.length = length
        self.rest = rest


class CrankLimitError(KinematicsError):
    """A crank angle at which the linkage cannot be closed."""

    def __init__(self, crank_angle: float, ranges: tuple[tuple[float, float], ...]) -> None:
        """Store the ``crank_angle`` and the ``ranges`` that the crank can reach, in [rad]."""
        reach = " or ".join(
            f"from {number_text(low)} to {number_text(high)} rad" for low, high in ranges
        )
        super().__init__(
            f"crank_angle = {number_text(crank_angle)} rad is beyond the crank's limits: it "
            f"reaches {reach}"
        )
        self.crank_angle = crank_angle
        self.ranges = ranges


class SelfMotionError(KinematicsError):
    """The platform can move while all cranks stand still, so that it has no definite positions."""

    def __init__(self, crank_angle: float) -> None:
        """Store the ``crank_angle`` [rad] at which this happens."""
        super().__init__(
            f"crank_angle = {number_text(crank_angle)} rad: the platform can move while the cranks "
            "stand still (self-motion), so it has no finite number of positions"
        )
        self.crank_angle = crank_angle


class DegenerateLinkageError(KinematicsError):
    """Points or lengths of a mechanism leave a part of it undetermined at every crank angle."""

    def __init__(self, reason: str) -> None:
        """Store the ``reason`` in words."""
        super().__init__(reason)
        self.reason = reason


class NotAPoseError(KinematicsError):
    """A pose does not belong to the mechanism at the given crank angle."""

    def __init__(self, crank_angle: float, gap: float) -> None:
        """Store the ``crank_angle`` [rad] and the rod length ``gap`` [m] that is left there."""
        super().__init__(
            f"pose is not a position of this mechanism at crank_angle = "
            f"{number_text(crank_angle)} rad: a rod length is wrong by {number_text(gap, 3)} m"
        )
        self.crank_angle = crank_angle
        self.gap = gap


class MechanismFileError(KinematicsError):
    """A file that should describe a mechanism does not."""

    def __init__(self, path: str, key: str, reason: str) -> None:
        """Store the ``path``, the ``key`` in it that is wrong (or nothing), and the ``reason``."""
        super().__init__(f"{path}: {key}: {reason}" if key else f"{path}: {reason}")
        self.path = path
        self.key = key
        self.reason = reason


class DrawingError(KinematicsError):
    """A picture was asked for that a mechanism does not have."""
