"""Errors of a tri-glide, its poses and its heights."""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.wording import number_text, unit_question, vector_text


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

    refusal = Refusal.UNREACHABLE

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
            f"distance {number_text(distance)} m, arm length {number_text(arm_length)} m"
            f"{unit_question(distance, arm_length)}",
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


class NoPoseError(KinematicsError):
    """Slider heights to which no pose of the platform below the sliders belongs."""

    refusal = Refusal.UNREACHABLE

    def __init__(self, message: str, heights: Sequence[float]) -> None:
        """Store the slider ``heights`` [m] that the ``message`` is about."""
        super().__init__(message)
        self.heights = tuple(heights)


class SpheresDoNotMeetError(NoPoseError):
    """The sphere about each carriage with its arm as radius: all three have no common point."""

    def __init__(self, heights: Sequence[float], discriminant: float, longest_arm: float) -> None:
        """Store what does not meet.

        Args:
            heights: of the sliders [m].
            discriminant: not positive [m^2].
            longest_arm: [m].
        """
        apart = max(heights) - min(heights)
        super().__init__(
            f"slider heights {vector_text(heights)} m are too far apart: the arms do not "
            f"meet (discriminant {number_text(discriminant, 3)} m^2)"
            f"{unit_question(apart, longest_arm)}",
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
