"""What is to be followed: a velocity of the platform, or a target that moves."""

from __future__ import annotations

from math import dist, hypot, inf
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
        lead: how far ahead of it a follower may aim that is to be there with its velocity [m].
    """

    position: Vector3
    velocity: Vector3
    acceleration: Vector3 = (0.0, 0.0, 0.0)
    lead: float = inf

    def after(self, time: float) -> MovingTarget:
        """Return the target some ``time`` later, or earlier if negative, if it goes on so [s]."""
        (x, y, z), (dx, dy, dz), (ax, ay, az), _ = self
        vx, vy, vz = dx + time * ax, dy + time * ay, dz + time * az
        half = 0.5 * time
        place = x + half * (dx + vx), y + half * (dy + vy), z + half * (dz + vz)
        return self._replace(position=place, velocity=(vx, vy, vz))


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

# How far ahead of a target its follower may aim [m], and what is added of the way that it has gone
# since it last rested or turned: that much farther the follower may go beyond a sudden end.
LEAST_LEAD = 5e-5
LEAD_OF_WAY = 0.01

# A target has turned if its velocity has less than this part of it in the direction of before.
TURNED = 0.5


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
        lead = _lead(self._last, target)
        self._last = MovingTarget(target.position, target.velocity, acceleration, lead)
        self._time = time

    def lose(self) -> None:
        """Forget its way so far: it is to be caught up with as soon as possible."""
        self._last = self._last._replace(lead=inf)

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
        last = self._last.after(lasts)
        return last._replace(acceleration=NO_ACCELERATION).after(past - lasts)


def _acceleration(first: MovingTarget, second: MovingTarget, interval: float) -> Vector3:
    """Return the acceleration between two reports [m/s^2], zero where they do not tell it."""
    if not SHORTEST_INTERVAL <= interval <= LONGEST_INTERVAL:
        return NO_ACCELERATION
    (x, y, z), (dx, dy, dz), _, _ = first
    (vx, vy, vz) = second.velocity
    half = 0.5 * interval
    foreseen = x + half * (dx + vx), y + half * (dy + vy), z + half * (dz + vz)
    way = half * (hypot(dx, dy, dz) + hypot(vx, vy, vz))
    if not dist(foreseen, second.position) <= JUMP * way:
        return NO_ACCELERATION
    change = (vx - dx) / interval, (vy - dy) / interval, (vz - dz) / interval
    return change if hypot(*change) <= LARGEST_ACCELERATION else NO_ACCELERATION


def _lead(first: MovingTarget, second: MovingTarget) -> float:
    """Return the lead after two reports [m]; the least one where the target rested or turned."""
    (dx, dy, dz), (vx, vy, vz) = first.velocity, second.velocity
    # Written so that NaN is a turn.
    if dx * vx + dy * vy + dz * vz > TURNED * hypot(dx, dy, dz) * hypot(vx, vy, vz):
        return first.lead + LEAD_OF_WAY * dist(first.position, second.position)
    return LEAST_LEAD
