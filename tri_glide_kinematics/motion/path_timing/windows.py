"""Windows: time scalings along a path, near the shortest that the limits allow.

A window begins in some state on the path and ends at rest: at the next stop of the path, or where
as far as may be is looked ahead. It is continued before it brakes for an end that is none.

A window is solved, bounded, and solved again where the bounds are not kept. What the solver finds
keeps the limits at the ends of cells. The bounds (``curve_bounds.py``) say by how much they are
exceeded between: cells that are too coarse are divided, in others what is allowed is made a little
less, and the problem is solved again from there.

Nothing is returned that the bounds do not certify. From rest to rest what they still ask for is
stretched away.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import PathTimingError, PlanningError
from tri_glide_kinematics.motion.limits import RELATIVE_ROUNDING, PathRows, SliderLimits
from tri_glide_kinematics.motion.path_timing.grid import (
    FIRST_PIECES,
    Cells,
    Extent,
    TimingGrid,
    cell_ends,
    cells_of,
    extent,
    extreme_thirds,
    pieces_ahead,
    timing_grid,
)
from tri_glide_kinematics.motion.path_timing.interior_point import solutions
from tri_glide_kinematics.motion.path_timing.problem import (
    CellLimits,
    SplineRows,
    divided,
    feasible_constant,
    spline_rows,
    timing_problem,
)
from tri_glide_kinematics.motion.path_timing.speed_estimate import LEAST_CELLS, estimated
from tri_glide_kinematics.motion.trajectory import (
    NO_BACKWARD_SPEED,
    Bounds,
    PathHeights,
    PathPlan,
    PathStart,
    RuckigPlanner,
    TimeScaling,
    blocks,
    bounds_of,
    evaluate,
    smooth_parts,
    with_added,
)
from tri_glide_kinematics.vectors import FloatArray

# Places in a cell, from -1 to 1, and weights of the quadrature by Gauss for its duration.
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def time_scaling(
    spans: FloatArray, rows: SplineRows, ways: FloatArray, coefficients: FloatArray
) -> TimeScaling | None:
    """Return the time scaling with a knot at each end of a cell, or None if it stands still.

    Args:
        spans: lengths of the cells in u. Shape (n,) [m].
        rows: of the spline.
        ways: at the ends of the cells, and two derivatives by u. Shape (3 or more, n + 1).
        coefficients: of the spline. Shape (n + 2,).
    """
    c0, middle, c2 = coefficients[:-2], coefficients[1:-1], coefficients[2:]

    def applied(row: FloatArray) -> FloatArray:
        return np.asarray(row[0] * c0 + row[1] * middle + row[2] * c2)

    left, right = applied(rows.left), applied(rows.right)
    x = (0.5 + 0.5 * _PLACES)[:, np.newaxis]
    y = 1.0 - x
    inside = y * y * left + 2.0 * x * y * middle + x * x * right
    if not (inside.min() > 0.0 and left.min() > 0.0 and right.min() > 0.0):
        return None
    dt = spans * ((0.5 * _WEIGHTS) @ (1.0 / np.sqrt(inside)))
    squares = np.append(left, right[-1])
    slopes = np.append(applied(rows.left_slope), applied(rows.right_slope)[-1])
    return TimeScaling(
        np.concatenate(((0.0,), np.cumsum(dt))),
        ways[0].copy(),
        ways[1] * np.sqrt(squares),
        0.5 * ways[1] * slopes + ways[2] * squares,
    )


# Parts of the limits of velocity, acceleration and jerk that cells are planned with at first; and
# those behind the place where a window is to be continued. So what goes on from there has more
# room than what led to it, and is found.
_MARGINS = np.array(((0.9995,), (0.997,), (0.98,)))
_LATER_MARGINS = np.array(((0.9992,), (0.977,), (0.95,)))

# Cells in which a bound exceeds its limit by more than this are divided; and, where this many turns
# were not enough, by more than that.
_COARSE = 1.02
_LATER_COARSE = 1.0005
_PATIENCE = 4

# They are tightened by this much more than they were exceeded: velocity, acceleration, jerk.
_BEYOND = np.array(((5e-4,), (2e-3,), (1e-2,)))

# In a hurry they are tightened by this power of the excess: the motion takes a thousandth longer,
# and is found up to two turns earlier.
_HURRIED = 2.0

# A window that is cut is continued between these parts of its cells.
COMMITTED = (0.4, 0.65)


@dataclass(eq=False, repr=False)
class TimingSearch:
    """One window while its cells and their limits are changed; it is given as to ``plan_window``.

    Attributes:
        scaling: what was found last; None if nothing, or nothing that bounds exist for.
        parts: of the limits that the bounds of it are, for each cell. Shape (3, n).
        slower: by which factor it has to be slower to keep all limits.
        converged: whether the solver found the optimum.
    """

    _curve: PathHeights
    _grid: TimingGrid
    _begin: PathStart
    _limits: SliderLimits
    _held: TimeScaling | None
    _excess_power: float = 1.0
    _guess: FloatArray | None = None
    _turn: int = 0
    scaling: TimeScaling | None = None
    slower: float = inf
    converged: bool = True

    def __post_init__(self) -> None:
        """Begin the search."""
        self._own = _margins(self._grid, self._begin.speed > 0.0)
        self.parts = np.zeros_like(self._own)

    def improve(self) -> Interruptible[None]:
        """Solve the problem once, and prepare the next one."""
        grid, moving = self._grid, self._begin.speed > 0.0
        guess, is_near = self._guess, self._guess is not None
        if guess is None:
            guess = first_guess(self._curve, grid, self._begin, self._limits, self._held)
            yield
        spans = np.diff(grid.cells.parameters)
        rows = spline_rows(spans, not moving)
        state = _state(grid, self._begin) if moving else None
        allowed = _tightened(grid.limits, self._own)
        problem = timing_problem(rows, spans, grid.heights, allowed, state)
        yield
        for each in solutions(problem, guess, is_near):
            yield
            solution = each
        self.converged = solution.converged
        yield from self._take(spans, rows, solution.coefficients)
        if self.scaling is None:
            return
        parts = self.parts
        yield
        self._turn += 1
        coarse = parts[1:].max(axis=0) > (_COARSE if self._turn < _PATIENCE else _LATER_COARSE)
        own = np.where(coarse, self._own, _narrowed(self._own, parts, self._excess_power))
        self._own = np.repeat(own, 1 + coarse, axis=1)
        self._guess = solution.coefficients
        if coarse.any():
            self._grid = yield from _grid(self._curve, grid.cells.divided(coarse))
            self._guess = divided(self._guess, rows, coarse)

    def go_steadily(self) -> Interruptible[None]:
        """Take a b that is the same everywhere; from rest only."""
        spans = np.diff(self._grid.cells.parameters)
        steady = feasible_constant(self._grid.heights, self._grid.limits)
        rows = spline_rows(spans, True)
        yield from self._take(spans, rows, np.full(len(spans) + 2, steady))

    def _take(
        self, spans: FloatArray, rows: SplineRows, coefficients: FloatArray
    ) -> Interruptible[None]:
        """Look at the motion that ``coefficients`` of the spline describe."""
        self.scaling = time_scaling(spans, rows, self._grid.cells.ways, coefficients)
        if self.scaling is None:
            self.converged = False
            return
        self.scaling = self.scaling.with_ends(self._begin, self._grid.cells.rest_map.end)
        yield
        bounds = yield from _bounds(self._curve, self.scaling, self._limits)
        self.parts = bounds.parts(self._limits)
        self.slower = float(bounds.slowdown(self._limits).max())
        if not bounds.backwards <= NO_BACKWARD_SPEED or not np.isfinite(self.slower):
            self.scaling = None
            self.converged = False

    def error(self) -> PathTimingError:
        """Return the error that says that nothing was found."""
        worst = int(np.nan_to_num(self.parts, nan=inf).max(axis=0).argmax())
        place = float(self._grid.cells.ways[0, worst])
        return self._curve.timing_error(place, "no motion keeps the limits")


def _state(grid: TimingGrid, start: PathStart) -> tuple[float, float]:
    """Return b and its slope where a motion goes on."""
    s1, s2 = grid.cells.ways[1:3, 0].tolist()
    b = (start.speed / s1) ** 2
    return b, 2.0 * (start.acceleration - s2 * b) / s1


def _margins(grid: TimingGrid, moving: bool) -> FloatArray:
    """Return the parts of the limits that cells are planned with. Shape (3, n)."""
    count = len(grid.cells.parameters) - 1
    result = _MARGINS * np.ones(count)
    if grid.cells.is_cut:
        later = np.minimum(np.arange(count) / (COMMITTED[0] * count), 1.0)
        result += (_LATER_MARGINS - _MARGINS) * later
    if moving:
        # Nothing can be changed where it begins, and it keeps the limits there.
        result[:2, 0] *= 2.0
    return result


def _tightened(limits: CellLimits, own: FloatArray) -> CellLimits:
    """Return ``limits`` of the cells, times parts of them of their own. Shape (3, n)."""
    added = PathRows(*(rows / own[1] for rows in limits.added))
    return CellLimits(
        limits.squared_speed * own[0] ** 2,
        limits.acceleration * own[1],
        limits.jerk * own[2],
        added,
    )


def _narrowed(own: FloatArray, parts: FloatArray, power: float) -> FloatArray:
    """Return smaller parts of the limits where the bounds exceed them."""
    factor = np.where(parts > 1.0, (1.0 - _BEYOND) / np.maximum(parts, 1.0) ** power, 1.0)
    around = factor.copy()
    around[:, 1:] = np.minimum(around[:, 1:], np.sqrt(factor[:, :-1]))
    around[:, :-1] = np.minimum(around[:, :-1], np.sqrt(factor[:, 1:]))
    return np.asarray(own * np.maximum(around, 0.5))


# Part of the limits with which a motion is made slower in a guess.
_GENTLE = 0.3

# Part of the accelerations with which a guess gets faster and slower from place to place.
_FLAT = 0.1

# Steps of Newton's method from times between knots.
_NEWTON_STEPS = 4

# Next to the rest at the end of a window, where the way hardly depends on the parameter, a guess is
# no larger than this multiple of the largest, and found with this slope at least.
_MOST = 2.0
_LEAST_SLOPE = 1e-6


def first_guess(
    curve: PathHeights,
    grid: TimingGrid,
    start: tuple[float, float, float],
    limits: SliderLimits,
    held: TimeScaling | None,
) -> FloatArray:
    """Return coefficients of a spline that is rather slow: near what steady speeds allow.

    A motion that goes on becomes so slow first: as a held one does, or gently.

    Args:
        curve: the path.
        grid: cells of the window.
        start: place [m], speed [m/s] and acceleration [m/s^2].
        limits: of the sliders.
        held: a motion from the start to rest that keeps the limits, if there is one.
    """
    slow = _steady(grid)
    count = len(grid.cells.parameters) - 1
    if start[1] == 0.0:
        return np.concatenate((slow[:1], slow, slow[-1:]))
    slow = np.minimum(slow, start[1] ** 2)
    if held is None:
        held = _slowing(curve, start, float(slow.min()) ** 0.5, limits)
    if held is None:
        return np.concatenate((slow[:1], slow, slow[-1:]))
    parameters = grid.cells.parameters
    middles = grid.cells.rest_map.derivatives(0.5 * (parameters[1:] + parameters[:-1]))
    slopes = np.concatenate((grid.cells.ways[1], middles[1]))
    ways = np.concatenate((grid.cells.ways[0], middles[0]))
    speeds = np.where(ways < held.ways[-1], _speeds(held, ways), 0.0)
    fastest = _MOST * float(held.speeds.max()) ** 2
    values = np.square(speeds / np.maximum(slopes, _LEAST_SLOPE))
    floor = np.concatenate((slow, slow[-1:], slow))
    values = np.maximum(np.minimum(values, fastest), floor)
    ends, inside = values[: count + 1], values[count + 1 :]
    # The control point that leads a quadratic through all three.
    points = np.maximum(2.0 * inside - 0.5 * (ends[1:] + ends[:-1]), 0.5 * inside)
    return np.concatenate((ends[:1], points, ends[-1:]))


def _steady(grid: TimingGrid) -> FloatArray:
    """Return a b that steady speeds allow, and that changes slowly. Shape (n,)."""
    _, second, highest, lowest = grid.heights
    third = np.maximum(np.abs(highest), np.abs(lowest))
    acceleration, jerk, added = grid.limits[1:]
    with np.errstate(divide="ignore"):
        steady = np.minimum(
            (acceleration / np.abs(second)).min(axis=(0, 1)),
            np.square(np.cbrt((jerk / third).min(axis=(0, 1)))),
        )
        slopes = (acceleration / np.abs(grid.heights.first)).min(axis=(0, 1))
        if len(added.squared):
            steady = np.minimum(steady, 0.5 / np.abs(added.squared).max(axis=0))
            slopes = np.minimum(slopes, 1.0 / np.abs(added.acceleration).max(axis=0))
        slopes = 2.0 * _FLAT * slopes
    steady = np.minimum(steady, grid.limits.squared_speed)
    spans = np.diff(grid.cells.parameters)
    # Next to rest the heights hardly depend on the parameter; no slope has to be so large there.
    with np.errstate(divide="ignore"):
        slopes = np.minimum(slopes, steady.max() / spans)
    reach = np.cumsum(slopes * spans)
    steady = np.minimum.accumulate(steady - reach) + reach
    return np.asarray(np.minimum.accumulate((steady + reach)[::-1])[::-1] - reach)


def _slowing(
    curve: PathHeights, start: tuple[float, float, float], speed: float, limits: SliderLimits
) -> TimeScaling | None:
    """Return how a motion gets another ``speed`` [m/s], gently; None if ruckig finds no way."""
    slopes = np.abs(curve.derivatives(np.array(start[:1])).heights[1, :, 0])
    # A slider that rests for a moment, as where the platform passes its axis, bounds nothing.
    with np.errstate(divide="ignore"):
        _, acceleration, jerk = (_GENTLE * (limits.table / slopes).min(axis=1)).tolist()
    bounds = ([1.0], [acceleration], [jerk])
    try:
        (phases,) = RuckigPlanner(1).to_velocity([speed], [start[1]], [start[2]], bounds)
    except PlanningError:
        return None
    phases = [(duration, jerk) for duration, jerk in phases if duration > 1e-9]
    if not phases:
        return None
    times = np.concatenate(((0.0,), np.cumsum([duration for duration, _ in phases])))
    return TimeScaling(*evaluate(phases, start, times))


def _speeds(scaling: TimeScaling, ways: FloatArray) -> FloatArray:
    """Return the speeds of a ``scaling`` at ``ways`` [m]; behind its end, the last. Shape (n,)."""
    times = np.interp(ways, np.maximum.accumulate(scaling.ways), scaling.times)
    for _ in range(_NEWTON_STEPS):
        way, speed, _ = scaling.evaluate(times)
        times = times - (way - ways) / np.maximum(speed, 1e-3 * scaling.speeds.max())
        times = np.clip(times, 0.0, scaling.times[-1])
    return scaling.evaluate(times)[1]


# A plan from rest is stretched to keep the limits if that costs less than this part of its time.
_STRETCH = 0.001

# Factor by which a plan is stretched more than it has to be, as the bounds have rounding errors.
ABOVE_ROUNDING = 1.0 + 1e-7

# How often cells are divided or their limits tightened where the bounds find them exceeded.
_ROUNDS = 9

# Number of cells at the start of a window that are those of the held motion.
_SAME_CELLS = 40


def plan_window(
    curve: PathHeights,
    start: PathStart,
    limits: SliderLimits,
    held: TimeScaling | None = None,
    until: float = inf,
    hurried_from: TimeScaling | None = None,
) -> Interruptible[PathPlan]:
    """Return a motion to rest at the next stop, or as far as is looked ahead.

    Args:
        curve: the path.
        start: where the motion begins; at rest, or inside all limits.
        limits: of the sliders.
        held: a motion from there to rest that keeps the limits, if one is known: it makes it more
            likely that one is found, and sooner. Its times may begin anywhere.
        until: place at which it has to rest at the latest [m].
        hurried_from: a slower motion from there to rest, which is driven until a faster one is
            found: so the search begins with it, in fewer cells, and takes fewer turns. From rest it
            is not used.

    Raises:
        PathTimingError: if none is found.
        PlanningError: if the start is at the end of the path.
    """
    if not start.place < min(curve.driven.length, until):
        raise PlanningError("the path is at its end")
    if not start.speed > 0.0:
        grid = yield from _window(
            curve, extent(curve, start.place, until, FIRST_PIECES), 0.0, limits
        )
        return (yield from _from_rest(curve, grid, start, limits))
    if held is not None:
        # The held motion is one of those that are looked for, as long as cells are the same.
        places = held.ways[1 : 1 + _SAME_CELLS]
        most = pieces_ahead(curve, start.place, float(held.ways[-1]))
        ahead = extent(curve, start.place, until, most)
        grid = yield from _window(curve, ahead, start.speed, limits, places)
        try:
            return (yield from _in_motion(curve, grid, start, limits, held))
        except PathTimingError:
            # Another guess may lead to one.
            yield
    ahead, shortest, power = extent(curve, start.place, until), 0.0, 1.0
    if hurried_from is not None:
        shortest, power = float(hurried_from.times[-1]) / LEAST_CELLS, _HURRIED
    grid = yield from _window(curve, ahead, start.speed, limits, shortest=shortest)
    return (yield from _in_motion(curve, grid, start, limits, hurried_from, power))


def _window(
    curve: PathHeights,
    ahead: Extent,
    speed: float,
    limits: SliderLimits,
    first_places: FloatArray | None = None,
    shortest: float = 0.0,
) -> Interruptible[TimingGrid]:
    """Return the cells of a window, and what they allow.

    Args:
        curve: the path.
        ahead: how far the window may lead.
        speed: where it begins [m/s].
        limits: of the sliders.
        first_places: where the first cells end, ascending, if that is known [m].
        shortest: time that a cell takes at least, about [s].

    Raises:
        PathTimingError: if an arm does not reach some place.
    """
    seen = curve.derivatives(ahead.samples)
    yield
    estimate = estimated(curve, ahead.samples, seen, speed, limits, shortest=shortest)
    yield
    part = ahead.cut(estimate)
    if part is not ahead:
        seen = curve.derivatives(part.samples)
        yield
        estimate = estimated(curve, part.samples, seen, speed, estimate.limits, estimate.each)
        yield
    cells = cells_of(part, estimate, speed, first_places)
    yield
    return (yield from _grid(curve, cells))


def _grid(curve: PathHeights, cells: Cells) -> Interruptible[TimingGrid]:
    """Return what some ``cells`` of a path allow."""
    ends = cell_ends(curve, cells)
    yield
    thirds = extreme_thirds(curve, cells, ends)
    yield
    grid = timing_grid(curve, cells, ends, thirds)
    yield
    return grid


def _bounds(
    curve: PathHeights, scaling: TimeScaling, limits: SliderLimits
) -> Interruptible[Bounds]:
    """Return the bounds along a path, found block by block."""
    found = []
    for block in blocks(curve, scaling):
        parts = smooth_parts(curve, block)
        yield
        seen = curve.in_parts(parts.ways)
        yield
        found.append(bounds_of(parts, seen))
        yield
        if limits.added:
            found[-1] = yield from with_added(found[-1], curve, block, parts.times, limits)
    return Bounds.joined(found)


def _from_rest(
    curve: PathHeights, grid: TimingGrid, start: PathStart, limits: SliderLimits
) -> Interruptible[PathPlan]:
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
            best = search.scaling.slower(slower * ABOVE_ROUNDING)
        if slower <= 1.0 + _STRETCH or not search.converged:
            break
    if best is None:
        # A b that is the same everywhere needs no solver.
        search = TimingSearch(curve, grid, start, limits, None)
        yield from search.go_steadily()
        if search.scaling is None:
            raise search.error()
        best = search.scaling.slower(search.slower * ABOVE_ROUNDING)
        best_parts = search.parts
    best = yield from _certified(curve, best, limits)
    return PathPlan(curve, best, _continuation(best, best_parts, grid.cells.is_cut))


def _certified(
    curve: PathHeights, scaling: TimeScaling, limits: SliderLimits
) -> Interruptible[TimeScaling]:
    """Return a motion from rest that was stretched, a little slower where rounding asks for it.

    Raises:
        PlanningError: if its knots are too close to be more than rounding.
    """
    for _ in range(_ROUNDS):
        bounds = yield from _bounds(curve, scaling, limits)
        slower = float(bounds.slowdown(limits).max())
        if slower <= 1.0 + RELATIVE_ROUNDING:
            return scaling
        scaling = scaling.slower(slower * ABOVE_ROUNDING)
    raise PlanningError("the knots of the motion are too close")


def _in_motion(
    curve: PathHeights,
    grid: TimingGrid,
    start: PathStart,
    limits: SliderLimits,
    held: TimeScaling | None,
    excess_power: float = 1.0,
) -> Interruptible[PathPlan]:
    """Return a motion that goes on; it cannot be stretched."""
    search = TimingSearch(curve, grid, start, limits, held, excess_power)
    for _ in range(_ROUNDS):
        yield from search.improve()
        if search.scaling is not None and search.slower <= 1.0:
            until = _continuation(search.scaling, search.parts, grid.cells.is_cut)
            return PathPlan(curve, search.scaling, until)
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
