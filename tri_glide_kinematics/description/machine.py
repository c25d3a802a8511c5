"""All that the files of other programs say about a machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

from tri_glide_kinematics.description.parts import Parts
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text

Names3 = tuple[str, str, str]


@dataclass(frozen=True)
class MachineDescription:
    """A machine with its names.

    The value of a slider's joint is the height that its drive reports, as in ``joint_states``; the
    true height is that plus its offset.

    Attributes:
        machine: its kinematics.
        parts: how it is drawn.
        joint_names: of the sliders. Shape (3,).
        base_frame: name of the part that does not move.
        platform_frame: name of the platform.
        lower_heights: lower ends of the travel, as the drives report them. Shape (3,) [m].
        upper_heights: upper ends. Shape (3,) [m].
        height_offsets: true heights minus those that the drives report. Shape (3,) [m].
        velocities: largest ones of the sliders. Shape (3,) [m/s].
        forces: largest ones of the sliders. Shape (3,) [N].
    """

    machine: TriGlide
    parts: Parts
    joint_names: Names3
    base_frame: str
    platform_frame: str
    lower_heights: Vector3
    upper_heights: Vector3
    height_offsets: Vector3
    velocities: Vector3
    forces: Vector3

    def true_heights(self, reported: Vector3) -> Vector3:
        """Return the true heights that belong to what the drives report. Shapes (3,) [m]."""
        first, second, third = (a + b for a, b in zip(reported, self.height_offsets))
        return first, second, third

    @property
    def middle(self) -> Vector3:
        """Middle of the travel, as the drives report it. Shape (3,) [m]."""
        first, second, third = (
            0.5 * (low + high) for low, high in zip(self.lower_heights, self.upper_heights)
        )
        return first, second, third

    def column_ends(self, arm: int) -> tuple[float, float]:
        """Return the true heights between which the column of a tower is drawn [m]."""
        offset, over = self.height_offsets[arm], 2.0 * self.parts.size
        return self.lower_heights[arm] + offset - over, self.upper_heights[arm] + offset + over

    @property
    def reach(self) -> tuple[Vector3, Vector3]:
        """Corners of a box that the centre of the platform cannot leave. Shapes (3,) [m]."""
        lengths = self.machine.geometry.arm_lengths
        (x1, y1), (x2, y2), (x3, y3) = self.machine.geometry.anchors
        xs, ys = tuple(zip((x1, x2, x3), lengths)), tuple(zip((y1, y2, y3), lengths))
        lower, upper = self.true_heights(self.lower_heights), self.true_heights(self.upper_heights)
        bottom = max(height - length for height, length in zip(lower, lengths))
        return (
            (max(x - length for x, length in xs), max(y - length for y, length in ys), bottom),
            (min(x + length for x, length in xs), min(y + length for y, length in ys), min(upper)),
        )


def add(parent: Element, tag: str, /, **attributes: str | float | Sequence[float]) -> Element:
    """Add an element in XML and return it; numbers are written with all digits that matter."""
    return SubElement(parent, tag, {name: _text(value) for name, value in attributes.items()})


def _text(value: str | float | Sequence[float]) -> str:
    if isinstance(value, str):
        return value
    numbers = (value,) if isinstance(value, float | int) else value
    return " ".join(number_text(number, 15, 0.0) for number in numbers)
