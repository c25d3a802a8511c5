"""Where the platform of a simulated machine truly is, and what it touches. No ROS in here."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.tri_glide.kinematics import TriGlide
from tri_glide_kinematics.vectors import Vector3


@dataclass(frozen=True)
class SimulatedPlate:
    """A plane that stops nothing: the platform goes on into it, as a probe with a spring does.

    Attributes:
        height: on the z axis [m].
        slope_x: by how much it rises along x [m/m].
        slope_y: by how much it rises along y [m/m].
    """

    height: float
    slope_x: float
    slope_y: float

    def is_touched(self, position: Vector3) -> bool:
        """Tell whether the platform's centre is on the plate or below it."""
        x, y, z = position
        return z <= self.height + self.slope_x * x + self.slope_y * y


@dataclass(frozen=True)
class TrueMachine:
    """What a machine is, whatever those who lead it know of it.

    Attributes:
        machine: its geometry.
        offsets: true height of each slider minus the one that its drive reports. Shape (3,) [m].
    """

    machine: TriGlide
    offsets: Vector3

    def position(self, heights: Vector3) -> Vector3:
        """Return where the platform is at ``heights``, as the drives report them. Shape (3,) [m].

        Raises:
            KinematicsError: if the arms do not meet.
        """
        (h1, h2, h3), (offset1, offset2, offset3) = heights, self.offsets
        return self.machine.forward((h1 + offset1, h2 + offset2, h3 + offset3))
