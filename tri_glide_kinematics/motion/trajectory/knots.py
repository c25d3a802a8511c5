"""Knots of a motion in time: between two of them its jerk does not change, and it is a quintic."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from tri_glide_kinematics.equal_numbers import SAME_PART
from tri_glide_kinematics.motion.trajectory.phases import Phases, total_duration
from tri_glide_kinematics.vectors import FloatArray

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan


def ascending(times: FloatArray) -> FloatArray:
    """Return ``times``, of any shape, in ascending order and each once. Shape (n,) [s].

    The function of numpy for this loads a module when it is first called, for 30 ms.
    """
    ordered = np.sort(times, axis=None)
    is_new = np.ones(len(ordered), dtype=bool)
    np.greater(ordered[1:], ordered[:-1], out=is_new[1:])
    return np.asarray(ordered[is_new])


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


def lasting(phases: Phases, blend: CubicPlan | None) -> Phases:
    """Return ``phases`` that end no sooner than the ``blend``, by standing still at the end."""
    missing = blend.duration - total_duration(phases) if blend else 0.0
    return [*phases, (missing, 0.0)] if missing > 0.0 else phases


def knots_with_blend(
    phases: Phases, pieces: int, shortest: float, blend: CubicPlan | None
) -> FloatArray:
    """Return the knots of ``phases``, and those of the ``blend`` if there is one [s]."""
    times = knots(phases, pieces, shortest)
    return np.array(times if blend is None else with_knots_of(times, blend, shortest))


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
