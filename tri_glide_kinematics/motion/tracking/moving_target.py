"""What is to be followed: a velocity of the platform, or a target that moves."""

from __future__ import annotations

from typing import NamedTuple

from tri_glide_kinematics.vectors import Vector3


class WantedVelocity(NamedTuple):
    """The platform is to move at this velocity.

    Attributes:
        velocity: Shape (3,) [m/s].
    """

    velocity: Vector3


class MovingTarget(NamedTuple):
    """Where a target is at one instant, and how it goes on.

    Attributes:
        position: Shape (3,) [m].
        velocity: Shape (3,) [m/s].
        acceleration: zero if it is not known. Shape (3,) [m/s^2].
    """

    position: Vector3
    velocity: Vector3
    acceleration: Vector3 = (0.0, 0.0, 0.0)

    def after(self, time: float) -> MovingTarget:
        """Return the target some ``time`` later, or earlier if negative, if it goes on so [s]."""
        (x, y, z), (dx, dy, dz), (ax, ay, az) = self
        vx, vy, vz = dx + time * ax, dy + time * ay, dz + time * az
        half = 0.5 * time
        return MovingTarget(
            (x + half * (dx + vx), y + half * (dy + vy), z + half * (dz + vz)),
            (vx, vy, vz),
            self.acceleration,
        )


Wanted = WantedVelocity | MovingTarget
