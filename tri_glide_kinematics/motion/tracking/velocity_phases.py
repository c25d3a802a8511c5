r"""One slider: the shortest change of its velocity, so the shortest way to rest, in closed form.

The jerk has one size $J$, so the acceleration goes to a peak and back to zero in a straight line
each, with a steady part at the peak if a limit cuts it. From velocity $v$ and acceleration $a$ to
zero, in the direction in which the peak $b$ is positive,

$$v + \frac{b^2 - a^2}{2J} + \frac{b^2}{2J} = 0, \quad b = \sqrt{a^2/2 - J v}.$$

The direction is that against $v + a|a|/2J$, the velocity that is left if the acceleration is taken
back at once: the slider passes no velocity beyond the larger of this and its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt

Phase = tuple[float, float]


def to_zero(
    velocity: float, acceleration: float, lowest: float, highest: float, jerk: float
) -> tuple[Phase, Phase, Phase]:
    """Return the phases that end with neither velocity nor acceleration, as soon as possible.

    Seen from a frame that moves, this is the way to the velocity of the frame.

    Args:
        velocity: at the start [m/s].
        acceleration: at the start; beyond its limits by rounding at most [m/s^2].
        lowest: limit of the acceleration, below zero [m/s^2].
        highest: limit of the acceleration, above zero [m/s^2].
        jerk: its limit in both directions [m/s^3].

    Returns:
        (duration [s], jerk [m/s^3]) of three phases; each may take no time.
    """
    if stopping_velocity(velocity, acceleration, jerk) > 0.0:
        velocity, acceleration, top, signed = -velocity, -acceleration, -lowest, -jerk
    else:
        top, signed = highest, jerk
    # A rounding error above the limit is kept, never added to.
    top = max(top, acceleration)
    squared = 0.5 * acceleration * acceleration - jerk * velocity
    steady = 0.0
    if squared > top * top:
        peak = top
        half_squares = top * top - 0.5 * acceleration * acceleration
        steady = max(-(velocity + half_squares / jerk) / top, 0.0)
    else:
        peak = sqrt(max(squared, 0.0))
    rise = max((peak - acceleration) / jerk, 0.0)
    return (rise, signed), (steady, 0.0), (peak / jerk, -signed)


def stopping_velocity(velocity: float, acceleration: float, jerk: float) -> float:
    """Return the velocity that is left when the acceleration is taken back at once [m/s]."""
    return velocity + acceleration * abs(acceleration) / (2.0 * jerk)


def cut_to(phases: Iterable[Phase], duration: float) -> list[Phase]:
    """Return the first part of ``phases``, filled up with no jerk, that takes ``duration`` [s]."""
    kept: list[Phase] = []
    left = duration
    for length, jerk in phases:
        if length >= left:
            kept.append((left, jerk))
            return kept
        if length > 0.0:
            kept.append((length, jerk))
            left -= length
    kept.append((left, 0.0))
    return kept


def within(value: float, bound: float) -> float:
    """Return the number from ``-bound`` to ``bound`` that is nearest to ``value``."""
    return bound if value > bound else -bound if value < -bound else value
