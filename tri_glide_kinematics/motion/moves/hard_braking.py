r"""The hardest braking along a curve that the sliders allow, step by step.

With $\dot h = h' \dot s$ and so on (docs/motion.md, section 4), each slider leaves an interval of
accelerations $\ddot s$ and of jerks $s^{(3)}$ at each place and speed. In each step the
acceleration goes as far down as all of them allow, here and a little ahead, until the jerk that
leads back to zero has to begin. What comes out keeps the limits at the ends of the steps only; it
is for the caller to verify it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite, sqrt

import numpy as np

from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.trajectory import Curve, TimeScaling, after

# Parts of the limits of acceleration and jerk that are used: the rest is for what lies between the
# ends of the steps.
ACCELERATION_PART = 0.985
JERK_PART = 0.95

# A slider that accelerates towards its largest velocity may need more to take that back in time.
TAKING_BACK_PART = 0.998

# So much more than it needs here, as the curve bends on the way.
BEND_MARGIN = 1.06

# The jerk that ends the braking is a little less than there is.
LANDING_PART = 0.97

# Factor by which a limit may be exceeded between places that are looked at.
BEYOND = 1.05

# Steps of a braking, about; pieces of its landing; and so many steps ahead the acceleration has to
# be possible, too.
STEPS = 18
LANDING_PIECES = 5
AHEAD = 3.0

# Places at which the curve is looked at, up to so many times the way that is expected.
LOOKED_AT = 48
FARTHEST = 2.0

# A slope that is less is none.
LEVEL = 1e-9

# A landing that is shorter needs no pieces [s].
NO_TIME = 1e-6


def hardest_braking(
    along: Curve,
    start: tuple[float, float, float],
    limits: SliderLimits,
    *,
    fraction: float = 1.0,
    until: float = inf,
    longest: float = inf,
) -> TimeScaling:
    """Return a braking along a curve, not verified.

    Args:
        along: the curve; the heights of the sliders are NaN out of reach.
        start: place [m], speed [m/s], greater than zero, and acceleration [m/s^2].
        limits: of the sliders.
        fraction: of acceleration and jerk that is used.
        until: place at which the platform has to rest at the latest [m].
        longest: time that it may take [s].

    Raises:
        PlanningError: if none is found.
    """
    place, speed, acceleration = start
    if not speed > 0.0:
        raise PlanningError("the platform hardly moves")
    accelerations = [ACCELERATION_PART * fraction * most for most in limits.acceleration]
    jerks = [JERK_PART * fraction * most for most in limits.jerk]
    slopes, bends, _ = along.derivatives(np.array([place])).heights[1:, :, 0].tolist()
    needed = JERK_PART
    for slope, bend, velocity, most in zip(slopes, bends, limits.velocity, limits.jerk):
        rate = slope * acceleration + bend * speed * speed
        room = velocity - abs(slope) * speed
        if rate * slope > 0.0 and room > 0.0:
            needed = max(needed, BEND_MARGIN * rate * rate / (2.0 * room * most))
    taking_back = [min(needed, TAKING_BACK_PART) * fraction * most for most in limits.jerk]
    slopes = [abs(slope) for slope in slopes]
    hardest = min(most / max(slope, LEVEL) for most, slope in zip(accelerations, slopes))
    sharpest = min(most / max(slope, LEVEL) for most, slope in zip(jerks, slopes))
    time = _time_to_rest(speed, acceleration, hardest, sharpest)
    if not isfinite(time):
        raise PlanningError("the curve begins out of reach")
    farthest = min(speed * (FARTHEST * time + abs(acceleration) / sharpest), until - place)
    curve = _Curve(along, place, farthest)
    landing = LANDING_PART * curve.least_of(jerks)
    scaling = _stepped(
        curve, start, (accelerations, jerks, taking_back, landing), time / STEPS, longest
    )
    curve.check(scaling, limits)
    return scaling


def _time_to_rest(speed: float, acceleration: float, most: float, jerk: float) -> float:
    """Return about how long a braking takes with limits that stay as they are [s]."""
    rise = max(acceleration, 0.0) / jerk
    speed += 0.5 * rise * max(acceleration, 0.0)
    if speed * jerk > most * most:
        return rise + speed / most + most / jerk
    return rise + 2.0 * sqrt(speed / jerk)


class _Curve:
    """Derivatives of the heights along a curve, read between places at equal distances."""

    def __init__(self, along: Curve, start: float, length: float) -> None:
        """Look at a ``length`` [m] from a ``start`` [m] on, as far as all arms reach.

        Raises:
            PlanningError: if there is no way.
        """
        if not length > 0.0:
            raise PlanningError("there is no way to brake on")
        with np.errstate(invalid="ignore"):
            table = along.derivatives(np.linspace(start, start + length, LOOKED_AT)).heights[1:]
        rows = table.transpose(2, 0, 1).reshape(LOOKED_AT, 9)
        within = np.isfinite(rows).all(axis=1)
        count = LOOKED_AT if within.all() else int(within.argmin())
        if count < 2:
            raise PlanningError("the braking would lead out of reach")
        # The way that is expected, not that which is looked at to be sure.
        self._slopes = np.abs(table[0, :, : min(count, int(LOOKED_AT / FARTHEST))])
        self._table = rows[:count]
        self._rows: list[list[float]] = self._table.tolist()
        self._start = start
        self._density = (LOOKED_AT - 1) / length

    def least_of(self, bounds: Sequence[float]) -> float:
        """Return what the ``bounds`` of the sliders leave along all of the expected way."""
        return float((np.array(bounds) / np.maximum(self._slopes, LEVEL).max(axis=1)).min())

    def at(self, place: float) -> list[float]:
        """Return slopes, bends and twists of the three heights at a ``place`` [m].

        Raises:
            PlanningError: if it is beyond the end.
        """
        position = (place - self._start) * self._density
        # Written so that NaN does not pass.
        if not 0.0 <= position <= len(self._rows) - 1 + 1e-6:
            raise PlanningError("the braking would lead too far")
        index = min(int(position), len(self._rows) - 2)
        part = position - index
        return [
            one + part * (next_one - one)
            for one, next_one in zip(self._rows[index], self._rows[index + 1])
        ]

    def check(self, scaling: TimeScaling, limits: SliderLimits) -> None:
        """Look at accelerations and jerks at the knots: the bounds that verify take much longer.

        Raises:
            PlanningError: if a slider exceeds one by far.
        """
        times, places, speeds, rates = scaling
        positions = (places[:-1] - self._start) * self._density
        indices = np.minimum(positions.astype(np.intp), len(self._rows) - 2)
        parts = (positions - indices)[:, np.newaxis]
        rows = self._table[indices] * (1.0 - parts) + self._table[indices + 1] * parts
        slopes, bends, twists = rows[:, :3], rows[:, 3:6], rows[:, 6:]
        jerks = (np.diff(rates) / np.diff(times))[:, np.newaxis]
        speed, rate = speeds[:-1, np.newaxis], rates[:-1, np.newaxis]
        squared = speed * speed
        accelerations = np.abs(slopes * rate + bends * squared).max(axis=0)
        jerks = np.abs(slopes * jerks + (3.0 * bends) * (speed * rate) + twists * (speed * squared))
        if not (
            (accelerations <= BEYOND * limits.table[1]).all()
            and (jerks.max(axis=0) <= BEYOND * limits.table[2]).all()
        ):
            raise PlanningError("the curve bends too much for a braking on it")


def _stepped(
    curve: _Curve,
    start: tuple[float, float, float],
    bounds: tuple[Sequence[float], Sequence[float], Sequence[float], float],
    step: float,
    longest: float,
) -> TimeScaling:
    """Return the braking in steps.

    Args:
        curve: along which.
        start: place, speed and acceleration.
        bounds: accelerations and jerks of the sliders, jerks as long as the platform accelerates,
            and the jerk along the curve that ends it.
        step: of time [s].
        longest: time that all may take [s].

    Raises:
        PlanningError: if it takes longer, or leads nowhere.
    """
    accelerations, jerks, taking_back, landing = bounds
    place, speed, acceleration = start
    time = 0.0
    knots = [(time, place, speed, acceleration)]
    row = curve.at(place)
    while not (acceleration < 0.0 and acceleration * acceleration >= 1.998 * landing * speed):
        next_place, next_speed, _ = after(step, place, speed, acceleration, 0.0)
        next_speed = max(next_speed, 0.0)
        next_row = curve.at(next_place)
        allowed = jerks if acceleration <= 0.0 else taking_back
        gentlest, sharpest = _jerks(row, speed, acceleration, 0.0, allowed)
        low, high = _jerks(next_row, next_speed, acceleration, step, allowed)
        gentlest, sharpest = max(gentlest, low), min(sharpest, high)
        least, most = _accelerations(next_row, next_speed, accelerations)
        later_place, later_speed, _ = after(AHEAD * step, place, speed, acceleration, 0.0)
        if later_speed > 0.0:
            low, high = _accelerations(curve.at(later_place), later_speed, accelerations)
            least, most = max(least, low), min(most, high)
        # So much that the jerk of the landing still leads to rest.
        change = landing * step
        left = max(speed + 0.5 * step * acceleration, 0.0)
        wanted = 0.5 * (change - sqrt(change * change + 8.0 * landing * left))
        jerk = (_inside(wanted, least, most) - acceleration) / step
        jerk = _inside(jerk, gentlest, sharpest)
        place, speed, acceleration = after(step, place, speed, acceleration, jerk)
        time += step
        if not speed > 0.0 or time > longest:
            raise PlanningError("the braking along the curve would take too long")
        knots.append((time, place, speed, acceleration))
        # The row is that of the new place, but for what the jerk has changed.
        row = next_row
    duration = -2.0 * speed / acceleration
    if time + duration > longest:
        raise PlanningError("the braking along the curve would take too long")
    if duration > NO_TIME:
        jerk = -acceleration / duration
        for piece in range(1, LANDING_PIECES + 1):
            passed = duration * piece / LANDING_PIECES
            knots.append((time + passed, *after(passed, place, speed, acceleration, jerk)))
    times, places, speeds, rates = np.array(knots).T
    speeds[-1] = rates[-1] = 0.0
    return TimeScaling(times, places, speeds, rates)


def _jerks(
    row: list[float], speed: float, acceleration: float, step: float, bounds: Sequence[float]
) -> tuple[float, float]:
    """Return the jerks along the curve that the sliders allow, ``step`` seconds after it began."""
    low, high = -inf, inf
    bending = 3.0 * speed
    cubed = speed * speed * speed
    for slope, bend, twist, bound in zip(row[:3], row[3:6], row[6:], bounds):
        bend *= bending
        taken = bend * acceleration + twist * cubed
        slope += bend * step
        if slope < 0.0:
            slope, taken = -slope, -taken
        if slope < LEVEL:
            slope = LEVEL
        bottom, top = (-bound - taken) / slope, (bound - taken) / slope
        if bottom > low:
            low = bottom
        if top < high:
            high = top
    return low, high


def _accelerations(row: list[float], speed: float, bounds: Sequence[float]) -> tuple[float, float]:
    """Return the accelerations along the curve that the sliders allow."""
    low, high = -inf, inf
    squared = speed * speed
    for slope, bend, bound in zip(row[:3], row[3:6], bounds):
        taken = bend * squared
        if slope < 0.0:
            slope, taken = -slope, -taken
        if slope < LEVEL:
            slope = LEVEL
        bottom, top = (-bound - taken) / slope, (bound - taken) / slope
        if bottom > low:
            low = bottom
        if top < high:
            high = top
    return low, high


def _inside(value: float, low: float, high: float) -> float:
    """Return what is nearest to ``value`` in an interval, or its middle if it is none."""
    if low > high:
        return 0.5 * (low + high)
    return min(max(value, low), high)
