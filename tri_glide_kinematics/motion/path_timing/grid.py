r"""Where along a path the speed is to be found: cells that are short where much happens.

How long the platform takes at each place is estimated before (``speed_estimate.py``). The cells
take about the same time each, and each piece of the path has some of its own, unless it is so short
that many pass in one cell. As many cells as there may be set how far is looked ahead.

Cells are those of a parameter of the path in which a motion that begins or ends at rest is regular.
After rest with constant jerk the way grows with the third power of time, and its square of the
speed, as a function of the way, has an infinite slope there. So the way is a smooth function of a
parameter u. At an end at rest it is $s = w\,\Psi(u / w)$ with $\Psi' = 6x^2 - 8x^3 + 3x^4$ up to
$x = 1$, and of slope one behind that: three times continuously differentiable, monotone, and like
$2 x^3$ next to rest. The motion is then described by $b(u) = \dot u^2$, which is positive there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.limits import PathRows
from tri_glide_kinematics.motion.path_timing.problem import CellHeights, CellLimits
from tri_glide_kinematics.motion.path_timing.speed_estimate import (
    SAMPLES,
    SpeedEstimate,
    added_rows,
    samples,
)
from tri_glide_kinematics.motion.trajectory import PathHeights
from tri_glide_kinematics.vectors import BoolArray, FloatArray, ascending

# Way behind which the map has slope one, as a fraction of the width.
REACH = 0.6

# Newton's method for the parameter; from its starting value fewer are enough.
_NEWTON_STEPS = 6


class RestMap(NamedTuple):
    """Way over parameter, between two ends each of which may be at rest.

    Attributes:
        begin: where the way begins [m].
        end: where it ends [m].
        first: width of the map at the begin, 0 if that is in motion [m].
        last: width of the map at the end, 0 if that is in motion [m].
    """

    begin: float
    end: float
    first: float
    last: float

    @property
    def span(self) -> float:
        """Largest parameter [m]; the least is 0."""
        return self.end - self.begin + (1.0 - REACH) * (self.first + self.last)

    def parameters(self, ways: FloatArray) -> FloatArray:
        """Return the parameters of ``ways``. Shape (n,) [m]."""
        before, after = ways - self.begin, self.end - ways
        result = before + (1.0 - REACH) * self.first
        if self.first > 0.0:
            near = before < REACH * self.first
            result[near] = self.first * _inverse(before[near] / self.first)
        if self.last > 0.0:
            near = after < REACH * self.last
            result[near] = self.span - self.last * _inverse(after[near] / self.last)
        return np.asarray(result)

    def derivatives(self, parameters: FloatArray) -> FloatArray:
        """Return the way and three derivatives by the parameter. Shape (4, n)."""
        result = np.zeros((4, len(parameters)))
        result[0] = parameters + (self.begin - (1.0 - REACH) * self.first)
        result[1] = 1.0
        if self.first > 0.0:
            near = parameters < self.first
            result[:, near] = _scaled(parameters[near], self.first)
            result[0, near] += self.begin
        if self.last > 0.0:
            left = self.span - parameters
            near = left < self.last
            result[:, near] = _scaled(left[near], self.last)
            result[0, near] = self.end - result[0, near]
            result[2, near] *= -1.0
        return result


def _scaled(parameters: FloatArray, width: float) -> FloatArray:
    """Return the way from rest and its derivatives. Shape (4, n)."""
    x = parameters / width
    square = x * x
    return np.array(
        (
            width * square * x * (2.0 - 2.0 * x + 0.6 * square),
            square * (6.0 - 8.0 * x + 3.0 * square),
            12.0 * x * (1.0 - x) ** 2 / width,
            12.0 * (1.0 - x) * (1.0 - 3.0 * x) / width**2,
        )
    )


def _inverse(ways: FloatArray) -> FloatArray:
    """Return x with Psi(x) = ``ways`` between 0 and ``REACH``. Shape (n,)."""
    ways = np.maximum(ways, 0.0)
    x = np.cbrt(0.5 * ways)
    x = np.minimum(x * (1.0 + x * (1.0 / 3.0 + 0.4 * x * x)), 1.0)
    for _ in range(_NEWTON_STEPS):
        square = x * x
        slope = square * (6.0 - 8.0 * x + 3.0 * square)
        miss = square * x * (2.0 - 2.0 * x + 0.6 * square) - ways
        x = np.clip(x - miss / np.maximum(slope, 1e-300), 0.0, 1.0)
    return np.asarray(x)


# Most cells of a window, and most pieces of the path that it looks at.
MOST_CELLS = 300
MOST_PIECES = 1500

# From rest it looks at fewer, so that the motion begins soon; what goes on from there looks so many
# times as far as what is held still leads: where it is continued, that may be a fifth of it.
FIRST_PIECES = 300
AHEAD_OF_HELD = 12

# Cells that a piece of the path gets of its own.
_CELLS_OF_PIECE = 3.0

# A break divides cells if it is this many cells behind that before it.
_SHORTEST = 0.5

# Widths of the map next to rest, as a multiple of the way during which the jerk is constant.
_WIDTH = 40.0

# And as a multiple of the way up to the speed that the path asks for: there the b that belongs to
# a steady speed is to be constant.
_ASKED_WIDTH = 3.0

# Part of the largest speed of a window from which on its added bounds are best known.
_LEAST_SPEED = 0.2

# The largest b: where the sliders do not move.
_FASTEST = 1e6


class Cells(NamedTuple):
    """How a window of a path is divided into n cells.

    Attributes:
        rest_map: the parameter u.
        parameters: u where cells begin, and where the last one ends. Shape (n + 1,) [m].
        ways: the way there, and three derivatives by u. Shape (4, n + 1).
        estimate: of the speed, and of what of the sliders' limits the cells can use.
        is_cut: whether the window ends before the next stop.
    """

    rest_map: RestMap
    parameters: FloatArray
    ways: FloatArray
    estimate: SpeedEstimate
    is_cut: bool

    def divided(self, which: BoolArray) -> Cells:
        """Return the cells with some of them, ``which``, shape (n,), divided into two."""
        middles = self.middle_parameters[which]
        places = np.flatnonzero(which) + 1
        ways = np.insert(self.ways, places, self.rest_map.derivatives(middles), axis=1)
        return self._replace(parameters=np.insert(self.parameters, places, middles), ways=ways)

    @property
    def middle_parameters(self) -> FloatArray:
        """The parameter u in the middle of each cell. Shape (n,) [m]."""
        return 0.5 * (self.parameters[1:] + self.parameters[:-1])


class CellEnds(NamedTuple):
    """Derivatives of the slider heights by the way, where n cells begin and where they end.

    Attributes:
        heights: from first to third. Shape (3, 2, 3, n).
        rates: of the driven way by the way. Shape (2, n).
    """

    heights: FloatArray
    rates: FloatArray


class TimingGrid(NamedTuple):
    """The cells of a window of a path, and what they allow.

    Attributes:
        cells: how it is divided.
        heights: of the sliders, by u.
        limits: of all cells.
    """

    cells: Cells
    heights: CellHeights
    limits: CellLimits


class Extent(NamedTuple):
    """How far a window leads.

    Attributes:
        begin: place on the path [m].
        end: likewise [m].
        breaks: of the path between them [m].
        is_cut: whether it ends before the next stop.
    """

    begin: float
    end: float
    breaks: FloatArray
    is_cut: bool

    @property
    def samples(self) -> FloatArray:
        """Places for an estimate of the speed. Shape (n,) [m]."""
        return samples(self.begin, self.end, self.breaks)

    def cut(self, estimate: SpeedEstimate, most: int = MOST_CELLS) -> Extent:
        """Return the part that has so many cells at ``most`` after an ``estimate``."""
        if not estimate.cells[-1] > most:
            return self
        index = int(np.searchsorted(estimate.cells, most))
        end = float(estimate.places[max(index, 2)])
        return Extent(self.begin, end, self.breaks[self.breaks < end], is_cut=True)


def extent(
    heights: PathHeights, begin: float, until: float = math.inf, most_pieces: int = MOST_PIECES
) -> Extent:
    """Return what there is from ``begin`` [m] to the next stop.

    Args:
        heights: of the sliders along the path.
        begin: place on the path, before its last stop [m].
        until: where the motion is to end at the latest [m].
        most_pieces: of the path.
    """
    driven = heights.driven
    end = min(float(driven.stops[np.searchsorted(driven.stops, begin, "right")]), until)
    breaks = driven.breaks
    first = int(np.searchsorted(breaks, begin, "right"))
    last = int(np.searchsorted(breaks, end, "left"))
    if last - first > most_pieces:
        last = first + most_pieces
        return Extent(begin, float(breaks[last]), breaks[first:last], is_cut=True)
    return Extent(begin, end, breaks[first:last], is_cut=False)


def cells_of(
    extent: Extent, estimate: SpeedEstimate, speed: float, first_places: FloatArray | None = None
) -> Cells:
    """Return the cells of a window.

    Args:
        extent: of the window.
        estimate: of the speed in it.
        speed: where it begins; 0 at rest [m/s].
        first_places: where the first cells end, ascending, if that is known [m].
    """
    at_begin, at_end = _widths(estimate)
    rest_map = RestMap(extent.begin, extent.end, 0.0 if speed > 0.0 else at_begin, at_end)
    parameters, ways = _cells(rest_map, estimate, extent.breaks)
    if first_places is not None:
        parameters, ways = _begun(rest_map, parameters, ways, first_places)
    return Cells(rest_map, parameters, ways, estimate, extent.is_cut)


def _widths(estimate: SpeedEstimate) -> tuple[float, float]:
    """Return the widths of the map next to rest, at the begin and at the end [m]."""
    places = estimate.places
    widest = 0.5 * float(places[-1] - places[0]) / REACH
    widths = (_WIDTH * estimate.ramp[[0, -1]]).tolist()
    asked = places[estimate.is_asked]
    if len(asked):
        ways = (float(asked[0] - places[0]), float(places[-1] - asked[-1]))
        widths = [min(width, _ASKED_WIDTH * way) for width, way in zip(widths, ways)]
    return min(widths[0], widest), min(widths[1], widest)


def pieces_ahead(heights: PathHeights, begin: float, end: float) -> int:
    """Return how many pieces of a path to look at after a motion from ``begin`` to ``end`` [m]."""
    first, last = np.searchsorted(heights.driven.breaks, (begin, end))
    return int(np.clip(AHEAD_OF_HELD * (last - first), FIRST_PIECES, MOST_PIECES))


def _cells(
    rest_map: RestMap, estimate: SpeedEstimate, breaks: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return where cells begin and end: u, and the way with its derivatives by u."""
    wanted = np.interp(breaks, estimate.places, estimate.cells)
    before_end = estimate.cells[-1] - wanted > _SHORTEST
    last, kept = 0.0, []
    for place, mark in zip(breaks[before_end].tolist(), wanted[before_end].tolist()):
        if mark - last > _SHORTEST:
            last = mark
            kept.append(place)
    kept_ways = np.array(kept)
    ends = np.concatenate(((0.0,), rest_map.parameters(kept_ways), (rest_map.span,)))
    # The density of cells over u, which is regular next to rest.
    marks_of_u = np.linspace(0.0, rest_map.span, 4 * SAMPLES + 1)
    marks_of_u = ascending(np.concatenate((marks_of_u, ends)))
    before = np.interp(rest_map.derivatives(marks_of_u)[0], estimate.places, estimate.cells)
    pieces = np.interp(ends, marks_of_u, before)
    steps = np.diff(pieces)
    counts = np.ceil(steps + _CELLS_OF_PIECE * np.clip(2.0 * steps - 1.0, 0.0, 1.0)).astype(int)
    owner = np.repeat(np.arange(len(counts)), counts)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    wanted_marks = pieces[owner] + within * (steps / counts)[owner]
    parameters = np.append(np.interp(wanted_marks, before, marks_of_u), rest_map.span)
    begins = np.cumsum(counts) - counts
    parameters[begins] = ends[:-1]
    ways = rest_map.derivatives(parameters)
    ways[0, begins[1:]] = kept_ways
    ways[0, 0], ways[0, -1] = rest_map.begin, rest_map.end
    return parameters, ways


def _begun(
    rest_map: RestMap, parameters: FloatArray, ways: FloatArray, first_places: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return cells, the first of which end at places that are known, not near rest."""
    beginning = rest_map.parameters(first_places)
    beginning = beginning[beginning < rest_map.span - rest_map.last]
    if not len(beginning):
        return parameters, ways
    last = float(beginning[-1])
    step = last - float(beginning[-2]) if len(beginning) > 1 else last
    rest = int(np.searchsorted(parameters, last + 0.5 * step))
    own = rest_map.derivatives(beginning)
    own[0] = first_places[: len(beginning)]
    return (
        np.concatenate((parameters[:1], beginning, parameters[rest:])),
        np.concatenate((ways[:, :1], own, ways[:, rest:]), axis=1),
    )


def cell_ends(curve: PathHeights, cells: Cells) -> CellEnds:
    """Return the derivatives of the slider heights where ``cells`` begin and where they end."""
    driven, places = curve.driven, cells.ways[0]
    # The piece before a break counts for the end of the cell before it.
    pieces = np.concatenate(
        (driven.spans_of(places[:-1]), np.searchsorted(driven.breaks, places[1:], "left") - 1)
    )
    both, rates = curve.derivatives_on(pieces, np.concatenate((places[:-1], places[1:])))
    count = len(places) - 1
    heights = both[1:].reshape(3, 3, 2, count).swapaxes(1, 2)
    return CellEnds(heights, rates.reshape(2, count))


def timing_grid(
    curve: PathHeights, cells: Cells, ends: CellEnds, thirds: tuple[FloatArray, FloatArray]
) -> TimingGrid:
    """Return what some ``cells`` of a path allow.

    Args:
        curve: the path.
        cells: of a window.
        ends: of the cells.
        thirds: the largest and the least third derivatives in them (``extreme_thirds``).
    """
    rest_map, usable = cells.rest_map, cells.estimate.limits
    h1, h2, _ = ends.heights
    highest, lowest = thirds
    _, s1, s2, s3 = np.stack((cells.ways[:, :-1], cells.ways[:, 1:]), axis=1)[:, :, np.newaxis]
    first, square = h1 * s1, s1 * s1
    rest = 3.0 * h2 * s1 * s2 + h1 * s3
    velocity, acceleration, jerk = usable.table[..., np.newaxis]
    middles = rest_map.derivatives(cells.middle_parameters)
    squared = _squared_speeds(curve, middles, velocity, (first, ends.rates * s1[:, 0]))
    shape = first.shape[1:]
    added = PathRows.none(len(squared))
    if usable.added:
        # In the middles, as the parameter has no speed by its way at rest.
        speeds = np.interp(middles[0], cells.estimate.places, cells.estimate.speeds) / middles[1]
        speeds = np.maximum(speeds, _LEAST_SPEED * speeds.max())
        added = added_rows(curve, cells.ways[:3, :-1], usable, speeds)
    return TimingGrid(
        cells,
        CellHeights(
            first,
            h2 * square + h1 * s2,
            highest * (square * s1) + rest,
            lowest * (square * s1) + rest,
        ),
        CellLimits(
            squared, np.broadcast_to(acceleration, shape), np.broadcast_to(jerk, shape), added
        ),
    )


def _squared_speeds(
    heights: PathHeights, middles: FloatArray, velocity: FloatArray, ends: tuple[FloatArray, ...]
) -> FloatArray:
    """Return upper bounds of the middle control points of b. Shape (n,).

    Args:
        heights: of the sliders along the path.
        middles: ways in the middle of cells, and derivatives by u. Shape (2 or more, n).
        velocity: limits. Shape (3, 1) [m/s].
        ends: derivatives of the heights by u where cells begin and where they end, shape
            (2, 3, n), and those of the way driven, shape (2, n).
    """
    (_, inside, *_), rates = heights.derivatives(middles[0])
    asked = heights.speed_limits(middles[0])
    first = np.concatenate((ends[0], inside[np.newaxis] * middles[1]))
    driven = np.concatenate((ends[1], rates[np.newaxis] * middles[1]))
    slowness = np.maximum((np.abs(first) / velocity).max(axis=1), driven / asked)
    with np.errstate(divide="ignore"):
        begin, end, middle = np.minimum(1.0 / np.square(slowness), _FASTEST)
    # That of a quadratic with these three values: so no cell stands out that is longer than others.
    point = 2.0 * middle - 0.5 * (begin + end)
    return np.asarray(np.clip(point, 0.5 * middle, 1.5 * middle))


def extreme_thirds(
    curve: PathHeights, cells: Cells, ends: CellEnds
) -> tuple[FloatArray, FloatArray]:
    """Return the largest and the least third derivatives by the way that cells have to allow.

    Those at the two ``ends`` of each cell, and at breaks of the path inside it.

    Returns:
        Shape (2, 3, n) each [1/m^2].
    """
    thirds, knots, rest_map = ends.heights[2], cells.ways[0], cells.rest_map
    breaks = curve.driven.breaks
    breaks = breaks[(breaks > rest_map.begin) & (breaks < rest_map.end)]
    owner = np.searchsorted(knots, breaks, "right") - 1
    hidden = knots[owner] != breaks
    if not hidden.any():
        return thirds, thirds
    # Of breaks inside cells, the third derivatives on both sides count as well.
    owner, hidden_breaks = owner[hidden], breaks[hidden]
    pieces = curve.driven.spans_of(hidden_breaks)
    before = curve.derivatives_on(pieces - 1, hidden_breaks).heights[3]
    after = curve.derivatives_on(pieces, hidden_breaks).heights[3]
    firsts = np.flatnonzero(np.diff(owner, prepend=-1))
    owners = owner[firsts]
    highest, lowest = thirds.copy(), thirds.copy()
    most = np.maximum.reduceat(np.maximum(before, after), firsts, axis=1)
    least = np.minimum.reduceat(np.minimum(before, after), firsts, axis=1)
    highest[:, :, owners] = np.maximum(thirds.max(axis=0)[:, owners], most)
    lowest[:, :, owners] = np.minimum(thirds.min(axis=0)[:, owners], least)
    return highest, lowest
