"""The measured heights of the last seconds."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.vectors import Vector3, combined, minus
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


class _Sample(NamedTuple):
    """Measured heights, with their times by our own clock and by that of the machine."""

    received: float
    stamp: float
    heights: Vector3


class HeightRecord:
    """Measured heights with their times, by the clock of the machine and by our own."""

    def __init__(self) -> None:
        """Hold nothing yet."""
        self._samples: deque[_Sample] = deque()

    def add(self, heights: Vector3, stamp: float, now: float) -> None:
        """Take in a measurement.

        Args:
            heights: as reported; some that are not finite are left out. Shape (3,) [m].
            stamp: when they were measured, by the clock of the machine [s].
            now: when they came in, by a steady clock [s].
        """
        if not all(map(math.isfinite, heights)):
            return
        samples = self._samples
        if samples and stamp <= samples[-1].stamp:
            # The clock was set back: what was before has no place in time any more.
            samples.clear()
        samples.append(_Sample(now, stamp, heights))
        while samples[0].received < now - KEPT:
            samples.popleft()

    def resting(self, now: float) -> Vector3:
        """Return the mean heights of the last moments, in which nothing moved. Shape (3,) [m].

        Raises:
            RecordingError: if there are no measurements, or the sliders move.
        """
        begin = now - RESTING_TIME
        recent = [each.heights for each in reversed(self._samples) if each.received > begin]
        if len(recent) < FEWEST or self._samples[0].received > begin:
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
        samples = self._samples
        if not samples or not samples[0].stamp <= stamp <= samples[-1].stamp:
            raise RecordingError(
                "no measured heights from before and after the contact: are the clocks of the "
                "drives and of the switch the same?"
            )
        # From the newest on, as a contact is not long ago.
        index = len(samples) - 1
        while index > 1 and samples[index - 1].stamp > stamp:
            index -= 1
        (_, begin, low), (_, end, high) = samples[index - 1], samples[index]
        part = (stamp - begin) / (end - begin) if end > begin else 1.0
        return combined(1.0, low, part, minus(high, low))
