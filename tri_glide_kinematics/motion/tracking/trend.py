r"""How a vector goes on that is told now and then.

Of a velocity without noise each report is taken as it is, and the last three of them tell the rate
at which it changes, and the rate of that. Noise shows in what a report is off the foreseen: it goes
to and fro, where a real change stays on one side. So the mean of these errors over the mean of
their sizes is near 1 or well below (Trigg and Leach). As it gets less, more of what is known is
kept: with a fading memory $\theta$ the value takes $1 - \theta^3$ of an error $e$, the rate
$\tfrac32 (1 - \theta)^2 (1 + \theta)$ of $e/T$, its rate $(1 - \theta)^3$ of $e/T^2$ (Morrison).
So none of them is late while the change goes on. An error that is much larger than those before is
no noise but something new: the report is taken as it is.
"""

from __future__ import annotations

from math import hypot, inf
from typing import NamedTuple

from tri_glide_kinematics.vectors import Vector3, combined, dot, minus, scaled

ZERO: Vector3 = (0.0, 0.0, 0.0)

# What an error counts in the means.
NEWEST = 0.2

# The longest memory, and that of what a hand makes. Errors are noise where the size of their mean
# is no more than this part of the mean of their sizes, and none where it is more than that: it is
# 0.36 for white noise, and 0.73 on a circle that is told thirty times in a turn.
LONGEST_MEMORY, MEMORY_OF_HANDS = 0.8, 0.6
NOISE, NO_NOISE = 0.4, 0.7

# An error that is so much larger than the mean is something new, unless the one before was, too.
SURPRISE = 4.0

# What is smaller is rounding, and nothing new however small it was before [m], [m/s]; of velocities
# that no hand makes, neither is this [m/s].
ROUNDING, HARDLY_NEW = 1e-9, 3e-4

# A rate is led as far as what it changes from one report to the next stands out of the noise: not
# at all at this many times the mean error, and wholly at twice that: with a long memory it is far
# less wrong than one error.
STANDS_OUT = 0.5

# Changes of the slope that make more than this in an interval are no noise, but a quick motion of
# which there are few reports [m/s].
LARGEST_NOISE = 0.02

# After so many reports without a surprise they are noise in any case. Then the memory reaches back
# as long as this: what bends in less time is no noise [s].
EXPERIENCE = 12
LOOKED_BACK = 0.04

# Reports that are farther apart say at which rate a vector changes, and no more; of what a hand
# makes not even that [s].
LONGEST_BEND = 0.04


class Noise:
    """What some vectors are like that should be small, of late.

    Attributes:
        size: mean of their sizes.
    """

    def __init__(self, newest: float = NEWEST, surprising: float = ROUNDING) -> None:
        """Begin without any.

        Args:
            newest: what the newest vector counts for in the means.
            surprising: a vector of this size is nothing new, however small they were before.
        """
        self._newest, self._surprising = newest, surprising
        self.size = 0.0
        self._mean = ZERO
        self._was_surprised = False

    def surprises(self, vector: Vector3) -> bool:
        """Return whether a ``vector`` is something new; else take it in."""
        is_large = hypot(*vector) > max(SURPRISE * self.size, self._surprising)
        self._was_surprised = is_large and not self._was_surprised
        if not self._was_surprised:
            self.take(vector)
        return self._was_surprised

    def take(self, vector: Vector3) -> None:
        """Take in a ``vector``."""
        self._mean = combined(1.0, self._mean, self._newest, minus(vector, self._mean))
        self.size += self._newest * (hypot(*vector) - self.size)

    @property
    def noise(self) -> float:
        """Mean of the sizes of what goes to and fro."""
        return self.memory(1.0) * self.size

    def memory(self, longest: float = LONGEST_MEMORY) -> float:
        """Return what part of what is known to keep: the more, the less they stay on one side."""
        if not self.size > 0.0:
            return 0.0
        apart = (NO_NOISE - hypot(*self._mean) / self.size) / (NO_NOISE - NOISE)
        return longest * min(max(apart, 0.0), 1.0)


class Course(NamedTuple):
    """A vector at one instant, and how it goes on.

    Attributes:
        value: Shape (3,).
        rate: of the value. Shape (3,) [1/s].
        bend: rate of that. Shape (3,) [1/s^2].
    """

    value: Vector3
    rate: Vector3 = ZERO
    bend: Vector3 = ZERO

    def after(self, time: float) -> Course:
        """Return the vector some ``time`` later [s]."""
        value, rate, bend = self
        middle = combined(1.0, rate, 0.5 * time, bend)
        return Course(combined(1.0, value, time, middle), combined(1.0, rate, time, bend), bend)

    def in_turn(self, interval: float) -> Course:
        """Return the course at the last of three reports of a turn, which tell this one.

        The parabola through them keeps its bend. In a turn that changes against the rate, so at the
        last report, an ``interval`` from the middle one [s], both are others.
        """
        value, rate, bend = self
        turned = turned_by(self, interval)
        rate = scaled(rate, 1.0 - turned / 3.0)
        return Course(value, rate, combined(1.0, bend, -turned / interval, rate))


class Trend:
    """A vector as it was told last, and how it goes on.

    Attributes:
        now: as of the last report.
    """

    def __init__(self, value: Vector3, *, by_hand: bool = False) -> None:
        """Begin with a first report.

        Args:
            value: as it is told first. Shape (3,).
            by_hand: whether a hand makes it, in steps: then no more than a rate is known of it, and
                something new has none.
        """
        self._by_hand = by_hand
        self._errors = Noise(surprising=ROUNDING if by_hand else HARDLY_NEW)
        self._bends = Noise()
        self._count = 0
        self._interval = inf
        # Whether it has gone on so for a while: so has what rests.
        self._went_on = not any(value)
        self.restart(value)

    def restart(self, value: Vector3, rate: Vector3 = ZERO) -> None:
        """Go on from a ``value`` with no more than a ``rate``; what noise is like stays known."""
        self.now = Course(value, rate)
        self._told = value
        self._slope: Vector3 | None = None
        self._is_new = True

    def report(self, value: Vector3, interval: float, noise: float = 0.0) -> bool:
        """Take the next report, a ``value`` told an ``interval`` after the last one [s].

        Args:
            value: as it is told. Shape (3,).
            interval: since the last report [s].
            noise: how sure it is, from 0 to 1, that bends between reports are noise.

        Returns:
            Whether it is something new.
        """
        foreseen = self.now.after(interval)
        error = minus(value, foreseen.value)
        slope = scaled(minus(value, self._told), 1.0 / interval)
        # Where reports are lost, more may be wrong.
        lost = 1.0 if self._by_hand else max(round(interval / self._interval), 1)
        self._interval = interval
        is_new = self._errors.surprises(scaled(error, 1.0 / (lost * lost)))
        if is_new:
            self._count = 0
        if is_new or interval > lost * LONGEST_BEND:
            # From what went on otherwise to this is no slope, but a jump.
            jumps, self._went_on = is_new and self._went_on, True
            self.restart(value, ZERO if jumps or self._by_hand else slope)
            return is_new
        if self._slope is not None:
            # Of what is told itself, as the errors depend on what was kept.
            self._bends.take(minus(slope, self._slope))
        self._told, self._slope = value, slope
        longest = MEMORY_OF_HANDS if self._by_hand else LONGEST_MEMORY
        memory = self._bends.memory(longest)
        self._count += 1
        sure = noise * self.sure
        # Where a target turns back, its bends change their sign as well, but what it is off does
        # not.
        quick = min(memory, self._errors.memory(longest))
        quick *= max(1.0 - interval * self._bends.size / LARGEST_NOISE, 0.0)
        memory = max(quick, sure * min(memory, LOOKED_BACK / (LOOKED_BACK + interval)))
        new = 1.0 - memory
        if self._is_new or self._by_hand:
            takes = 1.0 - memory * memory, new * new, 0.0
        else:
            takes = 1.0 - memory**3, 1.5 * new * new * (1.0 + memory), new**3
        self.now = Course(
            combined(1.0, foreseen.value, takes[0], error),
            combined(1.0, foreseen.rate, takes[1] / interval, error),
            combined(1.0, foreseen.bend, takes[2] / (interval * interval), error),
        )
        self._is_new = False
        self._went_on = True
        return False

    @property
    def sure(self) -> float:
        """How sure it is, from 0 to 1, that what the reports are off is noise."""
        return min(self._count / EXPERIENCE, 1.0)

    @property
    def noise(self) -> float:
        """Mean size of what goes to and fro in the reports."""
        return self._errors.noise

    @property
    def bends(self) -> float:
        """Mean size of the changes of the slope from one report to the next."""
        return self._bends.size

    def stands_out(self, interval: float) -> float:
        """Return how much of the rate stands out of the noise, from 0 to 1, over an interval."""
        noise = STANDS_OUT * self._errors.size
        change = interval * hypot(*self.now.rate)
        return min(max(change / noise - 1.0, 0.0), 1.0) if noise > 0.0 else 1.0


def bend_of_turn(value: Vector3, rate: Vector3) -> Vector3:
    """Return how the ``rate`` of a vector changes that turns and has this ``value``. Shape (3,)."""
    squared = dot(value, value)
    if not squared > 0.0:
        return ZERO
    across = combined(1.0, rate, -dot(value, rate) / squared, value)
    return scaled(value, -(hypot(*across) ** 2) / squared)


def between(value: float, low: float, high: float) -> float:
    """Return how far a ``value`` is on the way from ``low`` (0) to ``high`` (1)."""
    return min(max((value - low) / (high - low), 0.0), 1.0)


def turned_by(course: Course, time: float) -> float:
    """Return the square of the angle by which a vector turns in a ``time`` that goes on like this.

    It is that of a radian at most: what bends more is no turn; 0 where it does not turn [rad^2].
    """
    value, rate, bend = course
    # What goes to and fro bends little for its rate where it turns back, but not for its value.
    against, squared = -dot(bend, value), max(dot(value, value), time * time * dot(rate, rate))
    if not (against > 0.0 and squared > 0.0):
        return 0.0
    return between(time * time * against / squared, 0.0, 1.0)
