"""One slider on phases of constant jerk: where it ends and what it passes, exactly."""

from __future__ import annotations

from collections.abc import Iterable
from math import copysign, sqrt
from typing import NamedTuple

from tri_glide_kinematics.motion.tracking.velocity_phases import Phase


class Excursion(NamedTuple):
    """What a slider does on phases of constant jerk.

    Attributes:
        lowest: of the displacement, at most 0 [m].
        highest: of the displacement, at least 0 [m].
        speed: largest absolute velocity [m/s].
        acceleration: largest absolute one [m/s^2].
        jerk: largest absolute one [m/s^3].
        duration: of all phases [s].
        displacement: at the end [m].
        end_velocity: [m/s].
        end_acceleration: [m/s^2].
    """

    lowest: float
    highest: float
    speed: float
    acceleration: float
    jerk: float
    duration: float
    displacement: float
    end_velocity: float
    end_acceleration: float


def excursion(velocity: float, acceleration: float, phases: Iterable[Phase]) -> Excursion:
    """Return what a slider does from a velocity [m/s] and an acceleration [m/s^2] on.

    The extremes of a cubic are at its ends or where its rate is zero; each is calculated.
    """
    v, a = velocity, acceleration
    x = lowest = highest = time = most_jerk = 0.0
    speed, most = abs(v), abs(a)
    for length, jerk in phases:
        if length <= 0.0:
            continue
        b = a + length * jerk
        w = v + 0.5 * length * (a + b)
        y = x + length * (v + length * (2.0 * a + b) / 6.0)
        turns = v * w < 0.0
        if a * b < 0.0:
            # The velocity has its own extreme inside.
            turning = v - a * a / (2.0 * jerk)
            speed = max(speed, abs(turning))
            turns = turns or turning * v < 0.0 or turning * w < 0.0
        if turns:
            for root in _roots(v, a, jerk):
                if 0.0 < root < length:
                    turn = x + root * (v + root * (0.5 * a + root * jerk / 6.0))
                    lowest, highest = min(lowest, turn), max(highest, turn)
        x, v, a = y, w, b
        # Comparisons, as they take half the time of calls of min and max; and so that NaN stays.
        if not x >= lowest:
            lowest = x
        if not x <= highest:
            highest = x
        size = abs(v)
        if not size <= speed:
            speed = size
        size = abs(a)
        if not size <= most:
            most = size
        size = abs(jerk)
        if not size <= most_jerk:
            most_jerk = size
        time += length
    return Excursion(lowest, highest, speed, most, most_jerk, time, x, v, a)


def _roots(velocity: float, acceleration: float, jerk: float) -> tuple[float, ...]:
    """Return the times at which the velocity is zero [s]."""
    squared = acceleration * acceleration - 2.0 * jerk * velocity
    if squared < 0.0:
        return ()
    total = -(acceleration + copysign(sqrt(squared), acceleration))
    first = (total / jerk,) if jerk != 0.0 else ()
    return (*first, 2.0 * velocity / total) if total != 0.0 else first
