r"""A machine as the files of other programs show it: its parts, its names and its travel.

Arm i is a parallelogram of two rods. Each rod hangs from its carriage on two joints: it *swings*
about the level axis *across* the arm, and *tilts* about the axis that is at a right angle to that
one and to the rod. In the frame of the carriage (x across the arm, y towards the axis of the
machine, z up), a rod that is swung by $\varphi$ and tilted by $\theta$ leads along

$$ R_x(\varphi) R_y(\theta) (0, 0, -1)
   = (-\sin\theta, \sin\varphi \cos\theta, -\cos\varphi \cos\theta). $$

Both rods of an arm have the same angles, as the platform does not turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot
from xml.etree.ElementTree import Element, SubElement

from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import Vector3, plus, scaled
from tri_glide_kinematics.wording import number_text

Place2 = tuple[float, float]

# The rods, arm by arm: as they are seen from outside, by who looks at the tower.
SIDES = ("left", "right")
RODS = tuple(f"rod_{arm}_{side}" for arm in (1, 2, 3) for side in SIDES)

# The joints that no drive moves, in the order of ``Parts.passive_values``.
PASSIVE_JOINTS = (
    *("platform_x", "platform_y", "platform_z"),
    *(f"{rod}_{joint}" for rod in RODS for joint in ("swing", "tilt")),
)

# Sizes of what is drawn, as parts of the longest arm.
SIZE = 0.03
# As parts of that size.
ROD_RADIUS, ROD_DISTANCE, COLUMN = 0.3, 2.4, 1.8


@dataclass(frozen=True)
class Parts:
    """The parts of a machine.

    The kinematics know the difference between tower joint and platform joint only, so where one
    of them is drawn is a choice. So is the distance of the two rods.

    Attributes:
        towers: horizontal places of the tower joints. Shape (3, 2) [m].
        platform_joints: from the centre of the platform. Shape (3, 2) [m].
        arm_lengths: Shape (3,) [m].
        across: horizontal direction of each arm's joints. Shape (3, 2).
        rod_distance: of the two rods of an arm [m].
    """

    towers: tuple[Place2, Place2, Place2]
    platform_joints: tuple[Place2, Place2, Place2]
    arm_lengths: Vector3
    across: tuple[Place2, Place2, Place2]
    rod_distance: float

    @classmethod
    def of(
        cls,
        geometry: TriGlideGeometry,
        platform_radius: float,
        rod_distance: float | None = None,
    ) -> Parts:
        """Return the parts of a machine.

        Args:
            geometry: of the machine.
            platform_radius: of the circle through the platform joints [m].
            rod_distance: of the two rods of an arm; None for one that looks well [m].
        """
        towers, joints, across = [], [], []
        for x, y in geometry.anchors:
            size = hypot(x, y)
            ux, uy = (x / size, y / size) if size > 0.0 else (0.0, 1.0)
            joints.append((platform_radius * ux, platform_radius * uy))
            towers.append((x + platform_radius * ux, y + platform_radius * uy))
            across.append((-uy, ux))
        if rod_distance is None:
            rod_distance = ROD_DISTANCE * SIZE * max(geometry.arm_lengths)
        lengths = geometry.arm_lengths
        return cls(_three(towers), _three(joints), lengths, _three(across), rod_distance)

    @property
    def size(self) -> float:
        """Size of what is drawn: of the platform's edge beyond its joints, for instance [m]."""
        return SIZE * max(self.arm_lengths)

    @property
    def rod_radius(self) -> float:
        """How thick the rods are drawn [m]."""
        return ROD_RADIUS * self.size

    @property
    def rod_places(self) -> tuple[float, float]:
        """Where the left and the right rod are, along the direction across the arm [m]."""
        return -0.5 * self.rod_distance, 0.5 * self.rod_distance

    @property
    def platform_radius(self) -> float:
        """Radius of the platform as it is drawn [m]."""
        return max(hypot(x, y) for x, y in self.platform_joints) + self.size

    def column(self, arm: int) -> Place2:
        """Return where the column of a tower stands: behind the carriage, which runs on it [m]."""
        (x, y), (ax, ay) = self.towers[arm], self.across[arm]
        return x + COLUMN * self.size * ay, y - COLUMN * self.size * ax

    def azimuth(self, arm: int) -> float:
        """Return by how much the frame of a carriage is turned about z [rad]."""
        x, y = self.across[arm]
        return atan2(y, x)

    def swing_and_tilt(self, arm: int, height: float, position: Vector3) -> tuple[float, float]:
        """Return the angles of both rods of an arm [rad].

        Args:
            arm: index, 0 to 2.
            height: true one of the carriage [m].
            position: of the platform. Shape (3,) [m].
        """
        (tx, ty), (px, py) = self.towers[arm], self.platform_joints[arm]
        x, y, z = position[0] + px - tx, position[1] + py - ty, position[2] - height
        ax, ay = self.across[arm]
        across, inwards = ax * x + ay * y, ax * y - ay * x
        return atan2(inwards, -z), atan2(-across, hypot(inwards, z))

    def passive_values(self, heights: Vector3, position: Vector3) -> tuple[float, ...]:
        """Return the values of all joints that no drive moves, as ``PASSIVE_JOINTS`` names them.

        Args:
            heights: true ones of the carriages. Shape (3,) [m].
            position: of the platform at these heights. Shape (3,) [m].

        Returns:
            The position of the platform [m], and two angles of each rod [rad]. Shape (15,).
        """
        values = list(position)
        for arm, height in enumerate(heights):
            values += len(SIDES) * self.swing_and_tilt(arm, height, position)
        return tuple(values)


def _three(places: list[Place2]) -> tuple[Place2, Place2, Place2]:
    first, second, third = places
    return first, second, third


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
        return plus(reported, self.height_offsets)

    @property
    def middle(self) -> Vector3:
        """Middle of the travel, as the drives report it. Shape (3,) [m]."""
        return scaled(plus(self.lower_heights, self.upper_heights), 0.5)

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
