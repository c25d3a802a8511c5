"""Time scalings along a path, near the shortest that the limits allow, in windows.

A window begins in some state on the path and ends at rest: at the next stop of the path, or where
as far as may be is looked ahead. It is continued before it brakes for an end that is none.

Nothing is returned that the bounds do not certify. From rest to rest what they still ask for is
stretched away.
"""

from __future__ import annotations

from math import inf

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.path_timing.grid import (
    FIRST_PIECES,
    TimingGrid,
    pieces_ahead,
    timing_grid,
)
from tri_glide_kinematics.motion.path_timing.search import COMMITTED, TimingSearch, slowdown
from tri_glide_kinematics.motion.trajectory import (
    RELATIVE_ROUNDING,
    PathHeights,
    PathScaling,
    PathStart,
    PathTimingError,
    PlanningError,
    SliderLimits,
    TimeScaling,
    bounds_in_pieces,
)
from tri_glide_kinematics.vectors import FloatArray

# A plan from rest is stretched to keep the limits if that costs less than this part of its time.
_STRETCH = 0.001

# What is stretched is stretched by this factor more, as the bounds have rounding errors.
_ABOVE_ROUNDING = 1.0 + 1e-7

# How often cells are divided or their limits tightened where the bounds find them exceeded.
_ROUNDS = 9

# Number of cells at the begin of a window that are those of the held motion.
_SAME_CELLS = 40


def plan_window(
    curve: PathHeights,
    start: PathStart,
    limits: SliderLimits,
    held: TimeScaling | None = None,
    until: float = inf,
) -> Interruptible[PathScaling]:
    """Return a motion to rest at the next stop, or as far as is looked ahead.

    Args:
        curve: the path.
        start: where the motion begins; at rest, or inside all limits.
        limits: of the sliders.
        held: a motion from there to rest that keeps the limits, if one is known: it makes it more
            likely that one is found, and sooner. Its times may begin anywhere.
        until: place at which it has to rest at the latest [m].

    Raises:
        PathTimingError: if none is found.
        PlanningError: if the start is at the end of the path.
    """
    if not start.place < min(curve.driven.length, until):
        raise PlanningError("the path is at its end")
    if start.speed > 0.0:
        if held is not None:
            # What is held is one of the motions that are looked for, as long as cells are the same.
            places = held.ways[1 : 1 + _SAME_CELLS]
            most = pieces_ahead(curve, start.place, float(held.ways[-1]))
            grid = yield from timing_grid(
                curve,
                start.place,
                start.speed,
                limits,
                first_places=places,
                until=until,
                most_pieces=most,
            )
            yield
            try:
                return (yield from _in_motion(curve, grid, start, limits, held))
            except PathTimingError:
                # Another guess may lead to one.
                yield
        grid = yield from timing_grid(curve, start.place, start.speed, limits, until=until)
        yield
        return (yield from _in_motion(curve, grid, start, limits, None))
    grid = yield from timing_grid(
        curve, start.place, 0.0, limits, until=until, most_pieces=FIRST_PIECES
    )
    yield
    return (yield from _from_rest(curve, grid, start, limits))


def _from_rest(
    curve: PathHeights, grid: TimingGrid, start: PathStart, limits: SliderLimits
) -> Interruptible[PathScaling]:
    """Return a motion from rest, stretched until it keeps all limits."""
    best: TimeScaling | None = None
    best_parts = np.zeros((3, 1))
    shortest = inf
    search = TimingSearch(curve, grid, start, limits, None)
    for _ in range(_ROUNDS):
        yield from search.improve()
        if search.scaling is None:
            break
        slower = search.slower
        duration = slower * float(search.scaling.times[-1])
        if duration < shortest:
            shortest, best_parts = duration, search.parts
            best = search.scaling.slower(slower * _ABOVE_ROUNDING)
        if slower <= 1.0 + _STRETCH or not search.converged:
            break
    if best is None:
        # A b that is the same everywhere needs no solver.
        search = TimingSearch(curve, grid, start, limits, None)
        yield from search.go_steadily()
        if search.scaling is None:
            raise search.error()
        best = search.scaling.slower(search.slower * _ABOVE_ROUNDING)
        best_parts = search.parts
    best = yield from _certified(curve, best, limits)
    return PathScaling(best, _continuation(best, best_parts, grid.is_cut))


def _certified(
    curve: PathHeights, scaling: TimeScaling, limits: SliderLimits
) -> Interruptible[TimeScaling]:
    """Return a motion from rest that was stretched, a little slower where rounding asks for it.

    Raises:
        PlanningError: if its knots are too close to be more than rounding.
    """
    for _ in range(_ROUNDS):
        bounds = yield from bounds_in_pieces(curve, scaling)
        slower = slowdown(bounds.parts(limits))
        if slower <= 1.0 + RELATIVE_ROUNDING:
            return scaling
        scaling = scaling.slower(slower * _ABOVE_ROUNDING)
    raise PlanningError("the knots of the motion are too close")


def _in_motion(
    curve: PathHeights,
    grid: TimingGrid,
    start: PathStart,
    limits: SliderLimits,
    held: TimeScaling | None,
) -> Interruptible[PathScaling]:
    """Return a motion that goes on; it cannot be stretched."""
    search = TimingSearch(curve, grid, start, limits, held)
    for _ in range(_ROUNDS):
        yield from search.improve()
        if search.scaling is not None and search.slower <= 1.0:
            scaling = search.scaling
            return PathScaling(scaling, _continuation(scaling, search.parts, grid.is_cut))
        if not search.converged:
            break
    raise search.error()


def _continuation(scaling: TimeScaling, parts: FloatArray, is_cut: bool) -> float:
    """Return when a continuation is to begin: where little is asked for, and nothing brakes [s]."""
    if not is_cut:
        return inf
    count = len(scaling.times)
    first, last = (int(part * count) for part in COMMITTED)
    near = np.maximum(parts[1, first - 1 : last - 1], parts[1, first:last])
    braking = scaling.accelerations[first:last] < 0.0
    return float(scaling.times[first + int((near + braking).argmin())])
