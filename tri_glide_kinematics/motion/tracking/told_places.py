"""A target of which only places are told, as a camera does: how it moves, by the last three."""

from __future__ import annotations

from math import hypot, inf, sqrt

from tri_glide_kinematics.motion.tracking.moving_target import (
    LARGEST_ACCELERATION,
    LONGEST_INTERVAL,
    ZERO,
    bend_of_turn,
    turned_by,
)
from tri_glide_kinematics.vectors import Vector3, combined, minus, scaled

# Places that are told sooner after each other tell more of their noise than of the velocity [s].
SOON = 0.0165

# Places that are so far apart that no platform follows, or whose velocity changes by so much from
# one interval to the next, are a jump [m/s]. A change may be noise, 0.1 mm of it in 10 ms, as well.
FASTEST, LARGEST_CHANGE = 2.0, 0.3


class ToldPlaces:
    """The velocity of a target, from the places where it was.

    Attributes:
        place: where it was told last; None before the first. Shape (3,) [m].
        interval: to that from the place before; 0 without one [s].
    """

    def __init__(self) -> None:
        """Know no place yet."""
        self.place: Vector3 | None = None
        self.interval = 0.0
        self._time = 0.0
        # Mean velocity from the place before.
        self._mean: Vector3 | None = None

    def forget(self) -> None:
        """Know no place any more."""
        self.place = self._mean = None
        self.interval = 0.0

    def is_late(self, time: float) -> bool:
        """Return whether a place of a ``time`` [s] is older than the last one of the stream."""
        return self.place is not None and 0.0 < self._time - time <= LONGEST_INTERVAL

    def is_soon(self, time: float) -> bool:
        """Return whether a place of a ``time`` [s] comes too soon to tell a velocity."""
        return self.place is not None and 0.0 <= time - self._time < SOON

    def report(self, place: Vector3, time: float) -> Vector3 | None:
        """Return the velocity at a ``place`` where the target was at a ``time`` [m/s].

        It is that of the parabola through the last three places, or of a turn there. After a jump
        it is zero: how the target goes on is not known.

        Args:
            place: of the target. Shape (3,) [m].
            time: on any clock, neither late nor soon [s].

        Returns:
            Shape (3,); None for the first place, and after more than ``LONGEST_INTERVAL``.
        """
        interval = time - self._time
        start, before, last = self.place, self._mean, self.interval
        self.place, self._time = place, time
        if start is None or not 0.0 < interval <= LONGEST_INTERVAL:
            self._mean, self.interval = None, 0.0
            return None
        mean = scaled(minus(place, start), 1.0 / interval)
        self._mean, self.interval = mean, interval
        if before is None:
            between, change, fastest = inf, mean, FASTEST
        else:
            between, change = 0.5 * (interval + last), minus(mean, before)
            fastest = max(LARGEST_CHANGE, LARGEST_ACCELERATION * between)
        if hypot(*change) > fastest:
            self._mean = None
            return ZERO
        rate = scaled(change, 1.0 / between)
        velocity = combined(1.0, mean, 0.5 * interval, rate)
        turn = bend_of_turn(velocity, rate)
        turned = turned_by(velocity, turn, sqrt(interval * between))
        return scaled(velocity, 1.0 - turned / 3.0)
