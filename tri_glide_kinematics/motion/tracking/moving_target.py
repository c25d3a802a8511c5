"""What is to be followed: a velocity of the platform, or a target that moves."""

from __future__ import annotations

from math import dist, hypot
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


# More is not an acceleration that a machine would follow, but a jump of the velocity [m/s^2].
LARGEST_ACCELERATION = 5.0

# Reports that are farther apart say nothing about the acceleration now; between reports that are
# nearer together, what is wrong in the velocities is most of their difference [s].
LONGEST_INTERVAL = 0.25
SHORTEST_INTERVAL = 0.002

# A target that is farther from where two velocities lead, as a part of their way, has jumped.
JUMP = 0.1

NO_ACCELERATION: Vector3 = (0.0, 0.0, 0.0)


class TargetMotion:
    """A target as it was reported last, and how it goes on."""

    def __init__(self, first: MovingTarget, time: float) -> None:
        """Begin with a ``first`` report, of a ``time`` on any clock [s]."""
        self._last = first
        self._time = time
        self._lasts = 0.0

    @property
    def time(self) -> float:
        """When the target was where it was reported last [s]."""
        return self._time

    def report(self, target: MovingTarget, time: float) -> None:
        """Take the next report, of a ``time`` on the same clock [s]; an earlier one starts anew."""
        interval = time - self._time
        acceleration = _acceleration(self._last, target, interval)
        self._lasts = interval if any(acceleration) else 0.0
        self._last = MovingTarget(target.position, target.velocity, acceleration)
        self._time = time

    def at(self, time: float, foreseen: float = 0.0) -> MovingTarget:
        """Return where the target is at a ``time`` [s].

        Args:
            time: on the clock of the reports [s].
            foreseen: how far that is ahead of now; an acceleration lasts so much longer [s].
        """
        past = time - self._time
        lasts = self._lasts + foreseen if self._lasts else 0.0
        if past <= lasts:
            return self._last.after(past)
        position, velocity, _ = self._last.after(lasts)
        return MovingTarget(position, velocity).after(past - lasts)


def _acceleration(first: MovingTarget, second: MovingTarget, interval: float) -> Vector3:
    """Return the acceleration between two reports [m/s^2], zero where they do not tell it."""
    if not SHORTEST_INTERVAL <= interval <= LONGEST_INTERVAL:
        return NO_ACCELERATION
    (x, y, z), (dx, dy, dz), _ = first
    (vx, vy, vz) = second.velocity
    half = 0.5 * interval
    foreseen = x + half * (dx + vx), y + half * (dy + vy), z + half * (dz + vz)
    way = half * (hypot(dx, dy, dz) + hypot(vx, vy, vz))
    if not dist(foreseen, second.position) <= JUMP * way:
        return NO_ACCELERATION
    change = (vx - dx) / interval, (vy - dy) / interval, (vz - dz) / interval
    return change if hypot(*change) <= LARGEST_ACCELERATION else NO_ACCELERATION
