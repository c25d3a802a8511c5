"""A target of which only places are told, as a camera does: how it moves, by the last three."""

from __future__ import annotations

from math import hypot

from tri_glide_kinematics.motion.tracking.moving_target import (
    LARGEST_ACCELERATION,
    LONGEST_INTERVAL,
    SHORTEST_INTERVAL,
    ZERO,
)
from tri_glide_kinematics.vectors import Vector3, combined, minus, scaled

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
        self._start: Vector3 | None = None
        # Mean velocity from the place before, and what it is at the last place.
        self._mean: Vector3 | None = None
        self._velocity = ZERO

    def forget(self) -> None:
        """Know no place any more."""
        self.place = self._start = self._mean = None
        self.interval = 0.0

    def report(self, place: Vector3, time: float) -> Vector3 | None:
        """Return the velocity at a ``place`` where the target was at a ``time`` [m/s].

        It is that of the parabola through the last three places. After a jump it is zero: how the
        target goes on is not known. Places that are told within less than ``SHORTEST_INTERVAL`` say
        nothing about it.

        Args:
            place: of the target. Shape (3,) [m].
            time: on any clock [s].

        Returns:
            Shape (3,); None for the first place, and after more than ``LONGEST_INTERVAL``.
        """
        interval = time - self._time
        self.place = place
        if self._start is None or not 0.0 <= interval <= LONGEST_INTERVAL:
            self.forget()
            self.place = self._start = place
            self._time, self._velocity = time, ZERO
            return None
        if interval < SHORTEST_INTERVAL:
            return self._velocity
        mean = scaled(minus(place, self._start), 1.0 / interval)
        before, last = self._mean, self.interval
        self._time, self._start, self._mean, self.interval = time, place, mean, interval
        change = mean if before is None else minus(mean, before)
        between = interval if before is None else 0.5 * (interval + last)
        largest = max(LARGEST_CHANGE, LARGEST_ACCELERATION * between)
        if hypot(*change) > (FASTEST if before is None else largest):
            self._mean, self._velocity = None, ZERO
        elif before is None:
            self._velocity = mean
        else:
            self._velocity = combined(1.0, mean, 0.5 * interval / between, change)
        return self._velocity
