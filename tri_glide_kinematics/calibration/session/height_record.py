"""The measured heights of the last seconds."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text


class RecordingError(KinematicsError):
    """There is nothing, or nothing steady, that could be noted."""


# How long measurements are kept: longer than a stop from the speed of a probe takes [s].
KEPT = 10.0
# The sliders rest if they stay within a range for a time [m], [s].
RESTING_RANGE = 2e-5
RESTING_TIME = 0.2
# No less than these make a mean value.
FEWEST = 3


class HeightRecord:
    """Measured heights with their times, by the clock of the machine and by our own."""

    def __init__(self) -> None:
        """Hold nothing yet."""
        self._received: deque[float] = deque()
        self._stamps: deque[float] = deque()
        self._heights: deque[Vector3] = deque()

    def add(self, heights: Vector3, stamp: float, now: float) -> None:
        """Take in a measurement.

        Args:
            heights: as reported; some that are not finite are left out. Shape (3,) [m].
            stamp: when they were measured, by the clock of the machine [s].
            now: when they came in, by a steady clock [s].
        """
        if not all(map(math.isfinite, heights)):
            return
        if self._stamps and stamp <= self._stamps[-1]:
            # The clock was set back: what was before has no place in time any more.
            self._received.clear()
            self._stamps.clear()
            self._heights.clear()
        self._received.append(now)
        self._stamps.append(stamp)
        self._heights.append(heights)
        while self._received[0] < now - KEPT:
            self._received.popleft()
            self._stamps.popleft()
            self._heights.popleft()

    def resting(self, now: float) -> Vector3:
        """Return the mean heights of the last moments, in which nothing moved. Shape (3,) [m].

        Raises:
            RecordingError: if there are no measurements, or the sliders move.
        """
        recent = [
            heights
            for heights, received in zip(reversed(self._heights), reversed(self._received))
            if received > now - RESTING_TIME
        ]
        if len(recent) < FEWEST or self._received[0] > now - RESTING_TIME:
            raise RecordingError(
                f"{len(recent)} measured heights in the last {RESTING_TIME:g} s, "
                f"at least {FEWEST} are needed"
            )
        for slider, heights in enumerate(zip(*recent)):
            moved = max(heights) - min(heights)
            if moved > RESTING_RANGE:
                raise RecordingError(
                    f"slider {slider + 1} moves: by {number_text(moved, 3)} m in the last "
                    f"{RESTING_TIME:g} s, more than {RESTING_RANGE:g} m"
                )
        h1, h2, h3 = (math.fsum(heights) / len(recent) for heights in zip(*recent))
        return h1, h2, h3

    def at(self, stamp: float) -> Vector3:
        """Return the heights at a time by the clock of the machine [s]. Shape (3,) [m].

        Raises:
            RecordingError: if no measurements from before and after that time are there.
        """
        if not self._stamps or not self._stamps[0] <= stamp <= self._stamps[-1]:
            raise RecordingError(
                "no measured heights from before and after the contact: are the clocks of the "
                "drives and of the switch the same?"
            )
        # From the newest on, as a contact is not long ago.
        index = len(self._stamps) - 1
        while index > 1 and self._stamps[index - 1] > stamp:
            index -= 1
        return _between(
            (self._stamps[index - 1], self._heights[index - 1]),
            (self._stamps[index], self._heights[index]),
            stamp,
        )


def _between(
    before: tuple[float, Sequence[float]], after: tuple[float, Sequence[float]], stamp: float
) -> Vector3:
    part = (stamp - before[0]) / (after[0] - before[0]) if after[0] > before[0] else 1.0
    h1, h2, h3 = (low + part * (high - low) for low, high in zip(before[1], after[1]))
    return h1, h2, h3
