"""Time scaling: the way along a line or a path over time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.trajectory import quintics
from tri_glide_kinematics.vectors import FloatArray


class TimeScaling(NamedTuple):
    """Way along a line over time, at knots between which it is quintic.

    Attributes:
        times: ascending from 0. Shape (k + 1,) [s].
        ways: Shape (k + 1,) [m].
        speeds: Shape (k + 1,) [m/s].
        accelerations: Shape (k + 1,) [m/s^2].
    """

    times: FloatArray
    ways: FloatArray
    speeds: FloatArray
    accelerations: FloatArray

    def slower(self, factor: float) -> TimeScaling:
        """Return the same way in ``factor`` times the time."""
        return TimeScaling(
            self.times * factor,
            self.ways,
            self.speeds / factor,
            self.accelerations / (factor * factor),
        )

    def with_ends(self, start: tuple[float, float, float], length: float) -> TimeScaling:
        """Return it with exact values at the start, and at rest at ``length`` [m]."""
        for values, first, last in zip(self[1:], start, (length, 0.0, 0.0)):
            values[0], values[-1] = first, last
        return self

    def delayed(self, delay: float) -> TimeScaling:
        """Return the same motion after ``delay`` seconds of rest where it begins."""
        if delay == 0.0:
            return self
        zero = np.zeros(1)
        return TimeScaling(
            np.concatenate((zero, self.times + delay)),
            np.concatenate((self.ways[:1], self.ways)),
            np.concatenate((zero, self.speeds)),
            np.concatenate((zero, self.accelerations)),
        )

    @classmethod
    def joined(cls, parts: Sequence[TimeScaling]) -> TimeScaling:
        """Return motions one after the other, each of which begins as the one before ends."""
        begins = accumulate((float(part.times[-1]) for part in parts), initial=0.0)
        moved = [part._replace(times=part.times + begin) for part, begin in zip(parts, begins)]
        rests = [[each[1:] for each in part] for part in moved[1:]]
        return cls(*map(np.concatenate, zip(moved[0], *rests)))

    def since(self, time: float) -> TimeScaling:
        """Return the pieces that do not end before ``time`` [s]; times are not shifted."""
        first = min(int(np.searchsorted(self.times, time, side="right")), len(self.times) - 1) - 1
        return TimeScaling(*(values[max(first, 0) :] for values in self))

    def until(self, time: float) -> TimeScaling:
        """Return the pieces that begin before ``time`` [s]."""
        last = int(np.searchsorted(self.times, time))
        return TimeScaling(*(values[: last + 1] for values in self))

    def with_knots(self, times: FloatArray) -> TimeScaling:
        """Return the same motion with knots at other ``times``, which hold all those of this."""
        return TimeScaling(times, *self.evaluate(times))

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return ways, speeds and accelerations at ``times`` [s]; outside, those of the ends."""
        inside = np.maximum(np.minimum(times, self.times[-1]), self.times[0])
        index = np.searchsorted(self.times, inside, side="right") - 1
        index = np.clip(index, 0, len(self.times) - 2)
        t = inside - self.times[index]
        way, speed, acceleration = quintics.evaluate(self.coefficients()[:, index], t)
        ended = times >= self.times[-1]
        for values, final in zip((way, speed, acceleration), self[1:]):
            values[ended] = final[-1]
        return way, speed, acceleration

    def coefficients(self) -> FloatArray:
        """Return the coefficients of 1, t, ... t^5 of each piece. Shape (6, k)."""
        times, ways, speeds, accelerations = self
        dt = times[1:] - times[:-1]
        result = quintics.coefficients(dt, ways, speeds, accelerations)
        power = np.ones_like(dt)
        for row in result[1:]:
            power *= dt
            row /= power
        return result


class PathStart(NamedTuple):
    """Where on a path a motion begins.

    Attributes:
        place: programmed way [m].
        speed: of the place [m/s].
        acceleration: of the place [m/s^2].
    """

    place: float
    speed: float
    acceleration: float
