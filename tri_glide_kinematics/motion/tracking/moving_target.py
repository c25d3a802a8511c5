r"""What is to be followed: a velocity of the platform, or a target that moves, as it is told.

A vector is told now and then: what it is, how it changes, and what of that is noise.
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

from collections import deque
from math import dist, hypot, inf
from typing import NamedTuple

from tri_glide_kinematics.vectors import Vector3, combined, dot, minus, plus, scaled

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

# What is smaller is rounding, and nothing new however small it was before [m], [m/s].
ROUNDING = 1e-9

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

    def __init__(self, newest: float = NEWEST) -> None:
        """Begin without any; a ``newest`` vector counts for so much in the means."""
        self._newest = newest
        self.size = 0.0
        self._mean = ZERO
        self._was_surprised = False

    def surprises(self, vector: Vector3) -> bool:
        """Return whether a ``vector`` is something new; else take it in."""
        is_large = hypot(*vector) > max(SURPRISE * self.size, ROUNDING)
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
        turned = turned_by(value, bend, interval)
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
        self._errors, self._bends = Noise(), Noise()
        self._count = 0
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
        is_new = self._errors.surprises(error)
        if is_new:
            self._count = 0
        if is_new or interval > LONGEST_BEND:
            # From what went on otherwise to this is no slope, but a jump.
            jumps, self._went_on = is_new and self._went_on, True
            self.restart(value, ZERO if jumps or self._by_hand else slope)
            return is_new
        if self._slope is not None:
            # Of what is told itself, as the errors depend on what was kept.
            self._bends.take(minus(slope, self._slope))
        self._told, self._slope = value, slope
        memory = self._bends.memory(MEMORY_OF_HANDS if self._by_hand else LONGEST_MEMORY)
        self._count += 1
        sure = noise * self.sure
        quick = max(1.0 - interval * self._bends.size / LARGEST_NOISE, 0.0) * memory
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


class WantedVelocity(NamedTuple):
    """The platform is to move at this velocity.

    Attributes:
        velocity: Shape (3,) [m/s].
        acceleration: with which it changes, zero if that is not known. Shape (3,) [m/s^2].
    """

    velocity: Vector3
    acceleration: Vector3 = ZERO


class MovingTarget(NamedTuple):
    """Where a target is at one instant, and how it goes on.

    Attributes:
        position: Shape (3,) [m].
        velocity: Shape (3,) [m/s].
        acceleration: zero if it is not known. Shape (3,) [m/s^2].
        lead: how far ahead of it a follower may aim that is to be there with its velocity [m].
        noise: mean error of the position [m] and of the velocity [m/s], as told of late.
        jerk: with which the acceleration changes. Shape (3,) [m/s^3].
        sure: how sure it is, from 0 to 1, that the errors are noise.
    """

    position: Vector3
    velocity: Vector3
    acceleration: Vector3 = ZERO
    lead: float = inf
    noise: tuple[float, float] = (0.0, 0.0)
    jerk: Vector3 = ZERO
    sure: float = 0.0

    def after(self, time: float) -> MovingTarget:
        """Return the target some ``time`` later, or earlier if negative, if it goes on so [s]."""
        (x, y, z), (dx, dy, dz), (ax, ay, az), *_ = self
        vx, vy, vz = dx + time * ax, dy + time * ay, dz + time * az
        half = 0.5 * time
        place = x + half * (dx + vx), y + half * (dy + vy), z + half * (dz + vz)
        return self._replace(position=place, velocity=(vx, vy, vz))


Wanted = WantedVelocity | MovingTarget


# More is not an acceleration that a machine would follow, but a jump of the velocity [m/s^2].
LARGEST_ACCELERATION = 5.0

# Reports that are farther apart say nothing about the acceleration now; between reports that are
# nearer together, what is wrong in the velocities is most of their difference, and the rate stays
# the one that is known [s].
LONGEST_INTERVAL = 0.25
SHORTEST_INTERVAL = 0.0035

# A target that is farther from where two velocities lead, as a part of their way, has jumped.
JUMP = 0.1

# What was foreseen goes on for so many intervals if no further report comes, as that may be late.
LASTS = 1.5

# How far ahead of a target its follower may aim [m], and what is added of the way that it has gone
# since it last rested or turned: that much farther the follower may go beyond a sudden end.
LEAST_LEAD = 5e-5
LEAD_OF_WAY = 0.01

# The change from one mean velocity to the next is wrong by more than each of them, as they share a
# position: that is this part of it.
PART_OF_DIFFERENCE = 3.0**-0.5

# Velocities as told lead from one position to the next where they miss less than the first part of
# their errors, and are noise where they miss more than the second.
CONSISTENT, APART = 0.1, 0.2

# Likewise of what their slopes change in an interval, as parts of that.
NO_BENDS = 0.4, 0.5

# What an error counts in the means of the noise of velocities, and the multiple of the mean beyond
# which one is something new.
PATIENT, NEW = 0.08, 5.0

# How a target goes on is foreseen for so long; then it shows how much of that was right [s]. What a
# forecast missed counts for so much in the mean, and as so much at most [m]. A rate of change is
# led wholly where forecasts with it have missed less than the first part of those without it, and
# not at all from the second on.
FORECAST = 0.045
NEWEST_MISS, LARGEST_MISS = 0.06, 0.1
HELPS, MISLEADS = 0.8, 1.1

# A target has turned if its velocity has less than this part of it in the direction of before.
TURNED = 0.5


def between(value: float, low: float, high: float) -> float:
    """Return how far a ``value`` is on the way from ``low`` (0) to ``high`` (1)."""
    return min(max((value - low) / (high - low), 0.0), 1.0)


class Forecasts:
    """Whether it has helped of late to foresee more than that a target keeps its velocity.

    Attributes:
        rate: how much of the rate at which its velocity changes is to be led, from 0 to 1.
        bend: how much of the rate of that.
    """

    def __init__(self) -> None:
        """Trust all that is foreseen, until it turns out wrong."""
        self.rate = self.bend = 1.0
        self._made: deque[tuple[float, Vector3, Course]] = deque()
        self._missed = [0.0, 0.0, 0.0]

    def restart(self) -> None:
        """Forget all forecasts, as something new is done; what they were worth stays known."""
        self._made.clear()

    def report(self, time: float, position: Vector3, course: Course) -> None:
        """Look what was foreseen of this ``time`` [s], and foresee how it goes on from here.

        Args:
            time: of the report.
            position: of the target then [m].
            course: of its velocity from then on.
        """
        made = None
        while self._made and self._made[0][0] <= time - FORECAST:
            made = self._made.popleft()
        self._made.append((time, position, course))
        if made is None:
            return
        begun, place, (velocity, rate, bend) = made
        past = time - begun
        terms = (past, velocity), (past**2 / 2.0, rate), (past**3 / 6.0, bend)
        for kind, (factor, more) in enumerate(terms):
            place = combined(1.0, place, factor, more)
            # In this order a miss that is no number is the largest.
            missed = min(LARGEST_MISS, dist(place, position))
            self._missed[kind] += NEWEST_MISS * (missed - self._missed[kind])
        plain, bent, twisted = self._missed
        self.rate = 1.0 - between(min(bent, twisted) / max(plain, ROUNDING), HELPS, MISLEADS)
        least = max(min(plain, bent), ROUNDING)
        self.bend = self.rate * (1.0 - between(twisted / least, HELPS, MISLEADS))


class TargetMotion:
    """A target as it was reported last, and how it goes on."""

    def __init__(self, first: MovingTarget, time: float) -> None:
        """Begin with a ``first`` report, of a ``time`` on any clock [s]."""
        self._told = self._last = first
        self._velocity, self._errors = Trend(first.velocity), Noise()
        # What is wrong in the velocities as told, and in those that positions tell.
        self._told_errors, self._differences = Noise(PATIENT), Noise(PATIENT)
        self._apart = Noise(PATIENT)
        self._mean: Vector3 | None = None
        self._start = self._position = first.position
        self._course = self._velocity.now
        self._time = self._learned = time
        self._lasts = 0.0
        self._noise = 0.0, 0.0
        self._forecasts = Forecasts()

    @property
    def time(self) -> float:
        """When the target was where it was reported last [s]."""
        return self._time

    def report(self, target: MovingTarget, time: float, age: float = 0.0) -> bool:
        """Take the next report, of a ``time`` on the same clock; an earlier one starts anew.

        Args:
            target: as it was then.
            time: when it was so [s].
            age: how long ago that is [s].

        Returns:
            Whether the target does something else than was foreseen.
        """
        interval = time - self._learned
        told, self._told = self._told, target._replace(lead=_lead(self._told, target))
        self._time, since = time, time - self._time
        if 0.0 < interval < SHORTEST_INTERVAL:
            _, rate, bend = self._course.after(since)
            self._position, self._course = target.position, Course(target.velocity, rate, bend)
            return False
        self._learned = time
        last, self._last = self._last, target
        self._lasts = 0.0
        self._noise = 0.0, 0.0
        # One that is told to rest has come to its end, as a rule, and does not turn there.
        rests = not any(target.velocity)
        if SHORTEST_INTERVAL <= interval <= LONGEST_INTERVAL and not rests:
            before = self._velocity.now
            # What the velocities miss of the way, over what they are wrong by.
            changes = interval * interval * self._velocity.bends
            noise = between(self._errors.size / changes, *NO_BENDS) if changes > 0.0 else 0.0
            noise = max(noise, 1.0 - self._forecasts.bend)
            is_new = self._velocity.report(self._likely(target, last, interval), interval, noise)
            now = self._velocity.now
            both, bent = plus(before.value, now.value), minus(before.rate, now.rate)
            beside = minus(target.position, combined(1.0, self._start, 0.5 * interval, both))
            error = combined(1.0, beside, -interval * interval / 12.0, bent)
            largest = SURPRISE * self._errors.size
            kept = 0.0 if self._errors.surprises(error) else self._errors.memory()
            way = 0.5 * interval * (hypot(*told.velocity) + hypot(*target.velocity))
            # Where an acceleration changes so much, there is no saying how it goes on, either.
            jumped = not hypot(*beside) <= max(JUMP * way, largest)
            if not (jumped or hypot(*now.rate) > LARGEST_ACCELERATION):
                late = interval > LONGEST_BEND
                self._lasts = (1.0 if late else LASTS) * interval + min(max(age, 0.0), LONGEST_BEND)
                self._start = self._position = combined(1.0, target.position, -kept, error)
                if is_new:
                    self._forecasts.restart()
                self._forecasts.report(time, self._position, now)
                helps = self._forecasts
                value, rate, bend = now.in_turn(interval)
                self._course = Course(value, scaled(rate, helps.rate), scaled(bend, helps.bend))
                if not is_new:
                    self._noise = self._errors.noise, self._velocity.noise
                return is_new
        self._start = self._position = target.position
        self._mean = None
        self._forecasts.restart()
        self._velocity.restart(target.velocity)
        self._course = self._velocity.now
        return not (rests and not any(told.velocity))

    def _likely(self, target: MovingTarget, before: MovingTarget, interval: float) -> Vector3:
        """Return the likeliest velocity of a ``target``: as told, or as its positions tell [m/s].

        Args:
            target: as it is told.
            before: as it was told last.
            interval: between the two [s].
        """
        value, rate, bend = self._velocity.now
        mean = scaled(minus(target.position, before.position), 1.0 / interval)
        last, self._mean = self._mean, mean
        error = minus(target.velocity, combined(1.0, value, interval, rate))
        is_new = hypot(*error) > NEW * self._told_errors.size
        self._told_errors.take(error)
        both = scaled(plus(target.velocity, before.velocity), 0.5)
        self._apart.take(combined(1.0, minus(mean, both), interval * interval / 12.0, bend))
        if last is None:
            return target.velocity
        self._differences.take(minus(mean, combined(1.0, last, interval, rate)))
        told, seen = self._told_errors.noise, PART_OF_DIFFERENCE * self._differences.noise
        if is_new or not told > ROUNDING:
            return target.velocity
        apart = self._apart.size / self._told_errors.size
        part = told * told / (told * told + seen * seen)
        part *= between(apart, CONSISTENT, APART)
        now = combined(1.0, mean, 0.5 * interval, rate)
        return combined(1.0 - part, target.velocity, part, now)

    def lose(self) -> None:
        """Forget its way so far: it is to be caught up with as soon as possible."""
        self._told = self._told._replace(lead=inf)

    def at(self, time: float, foreseen: float = 0.0) -> MovingTarget:
        """Return where the target is at a ``time`` [s].

        Args:
            time: on the clock of the reports [s].
            foreseen: how far that is ahead of now; an acceleration lasts so much longer [s].
        """
        past = time - self._time
        lasts = self._lasts + foreseen if self._lasts else 0.0
        changing = min(past, lasts)
        value, rate, bend = self._course
        velocity, acceleration, jerk = self._course.after(changing)
        place = combined(1.0, self._position, changing, value)
        place = combined(1.0, place, 0.5 * changing * changing, rate)
        place = combined(1.0, place, changing**3 / 6.0, bend)
        turned = turned_by(value, bend, changing)
        if turned > 0.0:
            # It goes on to turn, or to swing: its bend changes against its rate.
            place = combined(1.0, place, -turned * changing * changing / 24.0, rate)
            velocity = combined(1.0, velocity, -turned * changing / 6.0, rate)
            acceleration = combined(1.0, acceleration, -turned / 2.0, rate)
            jerk = combined(1.0, jerk, -turned / changing, rate)
        if past > lasts:
            place = combined(1.0, place, past - lasts, velocity)
            acceleration = jerk = ZERO
        lead, sure = self._told.lead, self._velocity.sure
        return MovingTarget(place, velocity, acceleration, lead, self._noise, jerk, sure)


def turned_by(value: Vector3, bend: Vector3, time: float) -> float:
    """Return the square of the angle by which a vector with this ``bend`` turns in a ``time``.

    It is that of a radian at most: what bends more is no turn; 0 where it does not turn [rad^2].
    """
    against, squared = -dot(bend, value), dot(value, value)
    if not (against > 0.0 and squared > 0.0):
        return 0.0
    return between(time * time * against / squared, 0.0, 1.0)


# A twist is led by this part of itself at most: what turns more from one to the next is no turn.
LARGEST_LED = 0.5


class ToldVelocity:
    """A wanted velocity as it was told last, and how it goes on until the next one is due."""

    def __init__(self, velocity: Vector3, time: float) -> None:
        """Begin with a first report, of a ``time`` on any clock [s]."""
        self._trend = Trend(velocity, by_hand=True)
        self._told = self._value = velocity
        self._time = self._learned = time
        self._lasts = 0.0

    def report(self, velocity: Vector3, time: float) -> bool:
        """Take the next report, of a ``time`` on the same clock [s].

        The same velocity again says nothing, as it may be sent more often than it is made; for how
        long the last one is led shows in how often it changed.

        Returns:
            Whether it is another one than was foreseen.
        """
        if velocity == self._told:
            return False
        interval = time - self._learned
        self._told, self._time = velocity, time
        if 0.0 < interval < SHORTEST_INTERVAL:
            self._value = velocity
            return False
        self._learned = time
        self._lasts = 0.0
        is_new = True
        if SHORTEST_INTERVAL <= interval <= LONGEST_INTERVAL:
            is_new = self._trend.report(velocity, interval)
            if hypot(*self._trend.now.rate) <= LARGEST_ACCELERATION:
                self._lasts = LASTS * interval
        if not self._lasts > 0.0:
            self._trend.restart(velocity)
        self._value = self._trend.now.value
        return is_new

    def at(self, time: float, foreseen: float = 0.0) -> WantedVelocity:
        """Return what is wanted at a ``time``.

        Args:
            time: on the clock of the reports [s].
            foreseen: how far that is ahead of now; a rate lasts so much longer [s].
        """
        past, rate = time - self._time, self._trend.now.rate
        lasts = self._lasts + foreseen
        change = lasts * hypot(*rate)
        if not (self._lasts and past <= lasts and change > 0.0):
            return WantedVelocity(self._value)
        most = LARGEST_LED * hypot(*self._value) / change
        interval = self._lasts / LASTS
        rate = scaled(rate, min(self._trend.stands_out(interval), most))
        # It turns: a straight lead would make it faster. The rate is that of half an interval ago.
        bend = bend_of_turn(self._value, rate)
        led = Course(self._value, combined(1.0, rate, 0.5 * interval, bend), bend).after(past)
        return WantedVelocity(led.value, led.rate)


def _lead(first: MovingTarget, second: MovingTarget) -> float:
    """Return the lead after two reports [m]; the least one where the target rested or turned."""
    (dx, dy, dz), (vx, vy, vz) = first.velocity, second.velocity
    # Written so that NaN is a turn.
    if dx * vx + dy * vy + dz * vz > TURNED * hypot(dx, dy, dz) * hypot(vx, vy, vz):
        return first.lead + LEAD_OF_WAY * dist(first.position, second.position)
    return LEAST_LEAD
