"""Tells whether a machine that was led to a target is measured to be there. No ROS in here."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from tri_glide_kinematics.wording import number_text


@dataclass(frozen=True)
class InPositionBounds:
    """When a target is reached.

    Attributes:
        tolerance: largest distance from the target of a platform that is there [m].
        settling_time: how long it has to stay within the tolerance [s].
        timeout: after the last setpoint of a motion, time in which the target is reached [s].
        error_limit: a platform that is farther away after that time is a fault [m].
    """

    tolerance: float
    settling_time: float
    timeout: float
    error_limit: float


class Arrival(Enum):
    """What has become of a target."""

    SETTLING = "settling"
    REACHED = "reached"
    NOT_REACHED = "not reached"
    TOO_FAR = "too far away"


class InPosition:
    """Judges the distances from a target that are measured after the setpoints are at rest.

    Attributes:
        bounds: when the target is reached.
        distance: the latest one [m]; NaN before the first.
    """

    def __init__(self, bounds: InPositionBounds, now: float) -> None:
        """Begin ``now`` [s]."""
        self.bounds = bounds
        self.distance = math.nan
        self._began = now
        self._within_since = math.inf

    def measured(self, distance: float, now: float) -> None:
        """Take in a ``distance`` [m] that was measured ``now`` [s]."""
        self.distance = distance
        if not distance <= self.bounds.tolerance:
            self._within_since = math.inf
        elif self._within_since == math.inf:
            self._within_since = now

    def arrival(self, now: float) -> Arrival:
        """Return what has become of the target by ``now`` [s]."""
        bounds = self.bounds
        if now - self._within_since >= bounds.settling_time:
            return Arrival.REACHED
        settles = now - self._began < bounds.timeout or self._within_since < math.inf
        if settles or math.isnan(self.distance):
            return Arrival.SETTLING
        return Arrival.TOO_FAR if self.distance > bounds.error_limit else Arrival.NOT_REACHED

    def text(self, arrival: Arrival, target: str) -> str:
        """Return an ``arrival`` at a ``target`` in words; not for one that still settles."""
        away = f"measured {number_text(self.distance, 2)} m away"
        if arrival is Arrival.REACHED:
            return f"{target} is reached, {away}"
        far = arrival is Arrival.TOO_FAR
        limit = self.bounds.error_limit if far else self.bounds.tolerance
        return (
            f"{target} is {'not' if far else 'NOT'} reached, {away}, "
            f"more than {number_text(limit, 3)} m"
        )
