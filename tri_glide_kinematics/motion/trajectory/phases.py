"""One coordinate in phases of constant jerk: its cubic, its profiles, and their knots in time.

The cubic is written here alone; ``CubicPlan.at`` and ``StraightPlan.at``, which run in each
control cycle, have it unrolled. Between two knots the jerk does not change, and a motion along a
curve is a quintic.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from tri_glide_kinematics.equal_numbers import SAME_PART
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


def cut_to(phases: Phases, duration: float) -> Phases:
    """Return the first part of ``phases``, filled up with no jerk, that takes ``duration`` [s]."""
    kept: list[tuple[float, float]] = []
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


def shortest_piece(way: float, acceleration: float) -> float:
    """Return how short a phase must be to get no knot of its own [s].

    A quintic over a shorter piece would have rounding errors in its second derivative that an
    acceleration limit notices.

    Args:
        way: of the whole motion.
        acceleration: typical one.
    """
    return 1e-4 * math.sqrt(way / acceleration)


def knots(phases: Phases, pieces: int, shortest: float) -> list[float]:
    """Divide phases into exactly so many ``pieces``; return their ends, from 0 on [s].

    A piece never covers the end of a phase unless that phase is very short. Long phases get more
    of the pieces.

    Args:
        phases: (duration [s], jerk) one after the other.
        pieces: number of them, several times that of the phases.
        shortest: duration of phases that get no piece of their own [s].
    """
    total = total_duration(phases)
    begins: list[float] = []
    time = 0.0
    for duration, _ in phases:
        if duration > shortest:
            begins.append(time)
        time += duration
    begins[0] = 0.0
    result: list[float] = []
    for begin, end, count in zip(begins, [*begins[1:], total], _counts(begins, total, pieces)):
        step = (end - begin) / count
        result += [begin + step * index for index in range(count)]
    result.append(total)
    return result


def _counts(begins: list[float], total: float, pieces: int) -> list[int]:
    """Return how many of the ``pieces`` each of the phases gets that begin at ``begins`` [s]."""
    least = max(1, pieces // (2 * len(begins)))
    spare = (pieces - least * len(begins)) / total
    # Symmetric phases meet at a half: it is rounded down whatever the last bits are.
    given = [round(spare * end - SAME_PART) for end in (*begins[1:], total)]
    return [least + until - before for before, until in zip([0, *given], given)]


def merged(times: list[float], inserted: list[float], shortest: float) -> list[float]:
    """Return ascending ``times`` with others ``inserted``, each at least ``shortest`` apart [s].

    Of two that are too close the inserted one is kept, but for the first and the last time.
    """
    last = times[-1]
    kept: list[float] = []
    for time in inserted:
        if shortest < time < last - shortest and (not kept or time - kept[-1] > shortest):
            kept.append(time)
    result = [times[0]]
    position = 0
    for time in times[1:-1]:
        while position < len(kept) and kept[position] < time - shortest:
            result.append(kept[position])
            position += 1
        if position == len(kept) or kept[position] > time + shortest:
            result.append(time)
    return [*result, *kept[position:], last]
