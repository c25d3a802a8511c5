"""One coordinate in phases of constant jerk: its cubic, and profiles made of such phases.

The cubic is written here alone; ``CubicPlan.at`` and ``StraightPlan.at``, which run in each
control cycle, have it unrolled.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from tri_glide_kinematics.vectors import FloatArray

# (duration [s], jerk) of one phase after the other.
Phases = Sequence[tuple[float, float]]

_Values = TypeVar("_Values", float, FloatArray)


class CoordinateProfile(NamedTuple):
    """A coordinate over time, by its values at knots; each array has the shape (k + 1,)."""

    times: FloatArray
    values: FloatArray
    rates: FloatArray
    accelerations: FloatArray


def after(
    time: _Values, value: _Values, rate: _Values, acceleration: _Values, jerk: _Values
) -> tuple[_Values, _Values, _Values]:
    """Return value, rate and acceleration after some ``time`` [s] of constant ``jerk``.

    Args:
        time: Any shape [s].
        value: where that time begins.
        rate: its first derivative there.
        acceleration: its second derivative there.
        jerk: its third derivative.
    """
    change = time * jerk
    return (
        value + time * (rate + time * (acceleration / 2.0 + change / 6.0)),
        rate + time * (acceleration + change / 2.0),
        acceleration + change,
    )


def first_of(phases: Phases, until: float) -> Phases:
    """Return the phases up to a time [s]."""
    first = []
    for duration, jerk in phases:
        first.append((min(duration, until), jerk))
        until -= duration
        if until <= 0.0:
            break
    return first


def total_duration(phases: Phases) -> float:
    """Return how long all ``phases`` take [s]."""
    return sum(duration for duration, _ in phases)


def rest_to_rest(
    way: float, speed: float, acceleration: float, jerks: tuple[float, float]
) -> Phases:
    """Return the phases of the shortest motion from rest to rest that is its own mirror in time.

    Ruckig has one limit of the jerk; here are two.

    Args:
        way: of the whole motion.
        speed: largest one.
        acceleration: largest one.
        jerks: largest ones next to rest, and next to the top speed.

    Returns:
        (duration [s], jerk) of seven phases. Steady acceleration and speed may take no time.
    """
    at_rest, at_top = jerks
    # In three phases of a / at_rest, t and a / at_top the speed rises by a (t + a rise), and the
    # way is a (t^2 / 2 + a middle t + a^2 short).
    rise = 0.5 / at_rest + 0.5 / at_top
    middle = 0.5 / at_rest + 1.0 / at_top
    short = ((0.5 / at_rest + 1.5 / at_top) / at_rest + 1.0 / (at_top * at_top)) / 3.0
    half = 0.5 * way
    a = min(acceleration, math.sqrt(speed / rise))
    steady = max(speed / a - a * rise, 0.0)
    ramp = a * (steady * (0.5 * steady + a * middle) + a * a * short)
    if ramp > half:
        # The top speed is not reached.
        a = min(acceleration, (half / short) ** (1.0 / 3.0))
        squared = a * a * (middle * middle - 2.0 * short) + 2.0 * half / a
        steady = max(math.sqrt(squared) - a * middle, 0.0)
        ramp = half
    first, last = (a / at_rest, at_rest), (a / at_top, -at_top)
    cruise = (way - 2.0 * ramp) / speed
    return [first, (steady, 0.0), last, (cruise, 0.0), last, (steady, 0.0), first]


def evaluate(
    phases: Phases, initial: tuple[float, float, float], times: FloatArray
) -> CoordinateProfile:
    """Return the coordinate at ``times``, not after the end of the last phase.

    Args:
        phases: (duration [s], jerk) one after the other.
        initial: value, rate and acceleration at time 0.
        times: ascending. Shape (k + 1,) [s].
    """
    rows = []
    time = 0.0
    state = initial
    for duration, jerk in phases:
        if duration > 0.0:
            rows.append((time, *state, jerk))
            time += duration
            state = after(duration, *state, jerk)
    table = np.array(rows).T
    index = table[0, 1:].searchsorted(times, side="right")
    begins, values, rates, accelerations, jerks = table[:, index]
    return CoordinateProfile(times, *after(times - begins, values, rates, accelerations, jerks))
