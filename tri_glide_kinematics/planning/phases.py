"""One coordinate under piecewise constant jerk, seen at knots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.planning.plans import CubicPlan, FloatArray


class CoordinateLaw(NamedTuple):
    """A coordinate at knots in time; each array has the shape (k + 1,)."""

    times: FloatArray
    values: FloatArray
    rates: FloatArray
    accelerations: FloatArray


def shortest_piece(way: float, acceleration: float) -> float:
    """Return how short a phase must be to get no knot of its own [s].

    A quintic over a shorter piece would have rounding errors in its second derivative that an
    acceleration limit notices.

    Args:
        way: of the whole motion.
        acceleration: typical one.
    """
    return 1e-4 * math.sqrt(way / acceleration)


def knots(phases: Sequence[tuple[float, float]], pieces: int, shortest: float) -> list[float]:
    """Divide phases into exactly so many ``pieces``; return their ends, from 0 on [s].

    A piece never covers the end of a phase unless that phase is very short. Long phases get more
    of the pieces.

    Args:
        phases: (duration [s], jerk) one after the other.
        pieces: number of them, several times that of the phases.
        shortest: duration of phases that get no piece of their own [s].
    """
    total = sum(duration for duration, _ in phases)
    begins: list[float] = []
    time = 0.0
    for duration, _ in phases:
        if duration > shortest:
            begins.append(time)
        time += duration
    begins[0] = 0.0
    least = max(1, pieces // (2 * len(begins)))
    spare = pieces - least * len(begins)
    result: list[float] = []
    given = 0
    for begin, end in zip(begins, [*begins[1:], total]):
        share = round(spare * end / total) - given
        given += share
        step = (end - begin) / (least + share)
        result += [begin + step * index for index in range(least + share)]
    result.append(total)
    return result


def rest_until(phases: list[tuple[float, float]], end: float) -> None:
    """Add a rest to ``phases`` if they are over before ``end`` [s]."""
    duration = sum(time for time, _ in phases)
    if end > duration:
        phases.append((end - duration, 0.0))


def knots_with_blend(
    phases: list[tuple[float, float]], pieces: int, shortest: float, blend: CubicPlan | None
) -> FloatArray:
    """Return knots like ``knots``, for a motion that is not over before its ``blend``.

    The ``phases`` get a rest at their end if they are shorter.
    """
    if blend is None:
        return np.array(knots(phases, pieces, shortest))
    rest_until(phases, blend.duration)
    return np.array(with_knots_of(knots(phases, pieces, shortest), blend, shortest))


def with_knots_of(times: list[float], blend: CubicPlan, shortest: float) -> list[float]:
    """Return ``times`` and the times at which ``blend`` changes its jerk, none too close [s]."""
    return merged(times, [*blend.starts.tolist(), blend.duration], shortest)


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


def after_phase(
    state: tuple[float, float, float], duration: float, jerk: float
) -> tuple[float, float, float]:
    """Return value, rate and acceleration after a phase of constant jerk."""
    value, rate, acceleration = state
    return (
        value + duration * (rate + duration * (acceleration / 2.0 + duration * jerk / 6.0)),
        rate + duration * (acceleration + duration * jerk / 2.0),
        acceleration + duration * jerk,
    )


def evaluate(
    phases: Sequence[tuple[float, float]], initial: tuple[float, float, float], times: FloatArray
) -> CoordinateLaw:
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
            state = after_phase(state, duration, jerk)
    table = np.array(rows)
    index = np.searchsorted(table[:, 0], times, side="right") - 1
    begins, values, rates, accelerations, jerks = table[index].T
    t = times - begins
    gain = t * jerks
    return CoordinateLaw(
        times,
        values + t * (rates + t * (accelerations / 2.0 + gain / 6.0)),
        rates + t * (accelerations + gain / 2.0),
        accelerations + gain,
    )
