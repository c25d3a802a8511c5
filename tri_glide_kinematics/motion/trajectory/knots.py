"""Knots of a motion in time: between two of them its jerk does not change, and it is a quintic."""

from __future__ import annotations

import math

from tri_glide_kinematics.equal_numbers import SAME_PART
from tri_glide_kinematics.motion.trajectory.phases import Phases, total_duration


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
