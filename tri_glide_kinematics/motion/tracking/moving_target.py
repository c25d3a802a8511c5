"""What is to be followed: a velocity of the platform, or a target that moves, as it is told."""

from __future__ import annotations

from collections import deque
from math import dist, hypot, inf, sqrt
from typing import NamedTuple

from tri_glide_kinematics.motion.tracking.trend import (
    LONGEST_BEND,
    ROUNDING,
    SURPRISE,
    ZERO,
    Course,
    Noise,
    Trend,
    bend_of_turn,
    between,
    turned_by,
)
from tri_glide_kinematics.vectors import Vector3, combined, cross, dot, minus, plus, scaled

# How far ahead of a step its aim is, and at most [s].
FOLLOW_HORIZON = 0.045
LONGEST_HORIZON = 0.1


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

# What was foreseen goes on for so many intervals if no further report comes, as that may be late;
# that of a target, as it may be lost.
LASTS, TARGET_LASTS = 1.5, 2.25

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

# Velocities that are wrong by the same part, or turned by the same angle, again and again are
# corrected: from the first part of them on in part, from the second on wholly. So they are where
# that explains so much of what is wrong, which noise and curves do not. A report counts for less by
# a factor after each further one; one that is wrong by more is a jump.
CORRECTED, EXPLAINED = (0.002, 0.01), (0.2, 0.5)
REMEMBERED, LARGEST_PART = 0.95, 2.0

# Of so many reports nothing can be told, as anything explains them.
FITTED = 2.0

# How a target goes on is foreseen for so long; then it shows how much of that was right [s]. What a
# forecast missed counts for so much in the mean, and as so much at most [m]. A rate of change is
# led wholly where forecasts with it have missed less than the first part of those without it, and
# not at all from the second on.
FORECAST = 0.045
NEWEST_MISS, LARGEST_MISS = 0.06, 0.1
HELPS, MISLEADS = 0.8, 1.1

# A target has turned if its velocity has less than this part of it in the direction of before.
TURNED = 0.5


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


class WrongVelocities:
    r"""What velocities are to be multiplied and turned by to lead from one position to the next.

    Where $v$ is told and $v + e$ seen, the least squares of $e - (p v + w \times v)$ in a plane are
    at $p = \sum v e / \sum v^2$ and $w = \sum v \times e / \sum v^2$.
    """

    def __init__(self) -> None:
        """Trust what is told, until it turns out wrong."""
        self._part, self._turn = 0.0, ZERO
        self._count = self._told = self._wrong = self._along = 0.0
        self._across = ZERO

    def report(self, told: Vector3, seen: Vector3) -> None:
        """Compare a velocity as ``told`` with the one that was ``seen`` meanwhile [m/s]."""
        wrong = minus(seen, told)
        # Written so that NaN counts nothing; neither does a jump, nor rest.
        if not ROUNDING < hypot(*told) >= hypot(*wrong) / LARGEST_PART:
            return
        self._count = REMEMBERED * self._count + 1.0
        self._told = REMEMBERED * self._told + dot(told, told)
        self._wrong = REMEMBERED * self._wrong + dot(wrong, wrong)
        self._along = REMEMBERED * self._along + dot(told, wrong)
        self._across = combined(REMEMBERED, self._across, 1.0, cross(told, wrong))
        size, free = hypot(self._along, *self._across), self._count - FITTED
        if free > 0.0:
            # Less is rounding, and its square may be no number in full.
            least = max(self._wrong, ROUNDING * ROUNDING)
            left = (1.0 - size * size / (self._told * least)) * self._count / free
            explained = between(1.0 - left, *EXPLAINED)
            part = explained * between(size / self._told, *CORRECTED) / self._told
            self._part, self._turn = part * self._along, scaled(self._across, part)

    def corrected(self, velocity: Vector3) -> Vector3:
        """Return what a ``velocity`` is likely to be [m/s]; as it is told where it is not wrong."""
        if not (self._part or any(self._turn)):
            return velocity
        return combined(1.0 + self._part, velocity, 1.0, cross(self._turn, velocity))


class TargetMotion:
    """A target as it was reported last, and how it goes on."""

    def __init__(self, first: MovingTarget, time: float) -> None:
        """Begin with a ``first`` report, of a ``time`` on any clock [s]."""
        self._told = self._last = first
        self._velocity, self._errors = Trend(first.velocity), Noise()
        # What is wrong in the velocities as told, and in those that positions tell.
        self._told_errors, self._differences = Noise(PATIENT), Noise(PATIENT)
        self._apart = Noise(PATIENT)
        self._wrong = WrongVelocities()
        # Mean velocity between the last two reports, and how far they were apart.
        self._mean: tuple[Vector3, float] | None = None
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
        interval, foreseen = time - self._learned, self.at(time)
        told, self._told = self._told, target._replace(lead=_lead(self._told, target))
        self._time, since = time, time - self._time
        if 0.0 < interval < SHORTEST_INTERVAL:
            _, rate, bend = self._course.after(since)
            velocity = self._wrong.corrected(target.velocity)
            self._position, self._course = target.position, Course(velocity, rate, bend)
            return False
        self._learned = time
        last, self._last = self._last, target
        self._lasts = 0.0
        self._noise = 0.0, 0.0
        # One that is told to rest has come to its end, as a rule, and does not turn there.
        rests = not any(target.velocity)
        if SHORTEST_INTERVAL <= interval <= LONGEST_INTERVAL and not rests:
            before = self._velocity.now
            both = scaled(plus(last.velocity, target.velocity), 0.5)
            seen = scaled(minus(target.position, last.position), 1.0 / interval)
            bent = combined(1.0, both, -interval * interval / 12.0, before.bend)
            self._wrong.report(bent, seen)
            target, last = (
                each._replace(velocity=self._wrong.corrected(each.velocity))
                for each in (target, last)
            )
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
                intervals = 1.0 if interval > LONGEST_BEND else TARGET_LASTS
                self._lasts = intervals * interval + min(max(age, 0.0), LONGEST_BEND)
                self._start = self._position = combined(1.0, target.position, -kept, error)
                if is_new:
                    self._forecasts.restart()
                self._forecasts.report(time, self._position, now)
                helps = self._forecasts
                value, rate, bend = now.in_turn(interval)
                self._course = Course(value, scaled(rate, helps.rate), scaled(bend, helps.bend))
                if not is_new:
                    self._noise = self._errors.noise, self._velocity.noise
                # However often it was something else of late, steps may have been made for it.
                missed = dist(foreseen.position, self._position)
                missed += interval * dist(foreseen.velocity, value)
                return is_new or missed > foreseen.lead
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
        last, self._mean = self._mean, (mean, interval)
        error = minus(target.velocity, combined(1.0, value, interval, rate))
        is_new = hypot(*error) > NEW * self._told_errors.size
        self._told_errors.take(error)
        both = scaled(plus(target.velocity, before.velocity), 0.5)
        self._apart.take(combined(1.0, minus(mean, both), interval * interval / 12.0, bend))
        if last is None:
            return target.velocity
        apart = 0.5 * (last[1] + interval)
        self._differences.take(minus(mean, combined(1.0, last[0], apart, rate)))
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
        turned = turned_by(self._course, changing)
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


# A twist is led by this part of itself at most: what turns more from one to the next is no turn.
LARGEST_LED = 0.5

# The next twist is due after this part of the time for which the last one is led: just before an
# interval is over.
DUE = 0.6


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

        The same velocity again says nothing here, as it may be sent more often than it is made; for
        how long the last one is led shows in how often it changed.

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

    def repeat(self, time: float) -> None:
        """Take the same velocity again: where another one is due, it changes no more."""
        if time - self._learned >= DUE * self._lasts:
            self._lasts = 0.0

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
            apart, change, fastest = inf, mean, FASTEST
        else:
            apart, change = 0.5 * (interval + last), minus(mean, before)
            fastest = max(LARGEST_CHANGE, LARGEST_ACCELERATION * apart)
        if hypot(*change) > fastest:
            self._mean = None
            return ZERO
        rate = scaled(change, 1.0 / apart)
        velocity = combined(1.0, mean, 0.5 * interval, rate)
        turn = bend_of_turn(velocity, rate)
        turned = turned_by(Course(velocity, rate, turn), sqrt(interval * apart))
        return scaled(velocity, 1.0 - turned / 3.0)
