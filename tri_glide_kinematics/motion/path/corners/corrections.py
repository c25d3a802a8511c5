r"""What the roundings of all joints together add to the path as programmed: a piecewise quartic.

Between two breaks it is the sum of all roundings that reach over them. Where many overlap, this
sum is formed at some breaks only, and carried on from them: the polynomial is moved to the next
break, where one of its coefficients jumps as a rounding begins, ends or passes its joint.

Roundings are sorted into layers. In a layer of two roundings the one that begins first also ends
first. Those that taper off or swing out are put together of some, one inside the other
(``widths``), each in a layer of its own.

Functions inside of others work on ``some`` of the rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import comb
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import (
    ROWS,
    Interruptible,
    any_of,
    blocks,
    column_of,
    columns_of,
    concatenated,
    indices_of,
    picked,
    sorting,
)
from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints
from tri_glide_kinematics.motion.path.corners.widths import PARTS, Widths, inner_parts, swing_parts
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Indices

# Number of breaks that are worked through from each sum over all roundings.
SUM_BLOCK = 64

# Carrying on may cost so many units of rounding of the largest third derivative, and this [m].
LOST_UNITS = 2e-15
LARGEST_LOSS = 1e-15

# Two breaks that are nearer, as part of the path's length, are one: the rest is rounding error.
SAME_BREAK = 1e-13

# The sums are formed at all breaks if they have no more terms, or no more each on average.
FEW_TERMS = 4000
FEW_EACH = 2

# Number of spans between breaks that are worked on together.
CARRIED_SPANS = 64 * SUM_BLOCK

# Number of terms of sums that are worked on together.
TERMS = 2000


class Layer(NamedTuple):
    """Roundings; of two, the one that begins first also ends first.

    Each is made of one of the third and one of the fourth degree, the latter w/8 (1 - |x|/w)^4.

    Attributes:
        ways: programmed way at each joint. Shape (m,) [m].
        tangent_jumps: change of the unit tangent. Shape (m, 3).
        curvature_jumps: change of the curvature vector; None where none is rounded in this layer.
            Shape (m, 3) [1/m].
        half_widths: Shape (m,) [m].
        thirds: how much of the third degree counts. Shape (m,).
        fourths: how much of the fourth degree counts; None for nothing. Shape (m,).
    """

    ways: FloatArray
    tangent_jumps: FloatArray
    curvature_jumps: FloatArray | None
    half_widths: FloatArray
    thirds: FloatArray
    fourths: FloatArray | None


class Breaks(NamedTuple):
    """Joints of a path and ends of its roundings.

    Attributes:
        ways: of all of them, ascending. Shape (k + 1,) [m].
        begins: index of the break at which each rounding of a layer begins. Shape (m,).
        middles: index of the break at its joint. Shape (m,).
        ends: index of the break at which it ends. Shape (m,).
    """

    ways: FloatArray
    begins: Indices
    middles: Indices
    ends: Indices


def roundings_over(breaks: Breaks, some: slice) -> list[Indices]:
    """Return which roundings of a layer reach over ``some`` spans between breaks.

    Returns:
        The index of the first one that does, and of the first one after these that does not.
    """
    columns = []
    for at in (breaks.ends, breaks.begins):
        first, last = np.searchsorted(at, (some.start, some.stop))
        here = np.bincount(at[first:last] - some.start, minlength=some.stop - some.start)
        columns.append(first + np.cumsum(here))
    return columns


class RoundingSums:
    """Sums over the roundings of a layer that reach over each span between breaks.

    Attributes:
        count: number of spans.
        size: of coefficients.
        begins: index of the first rounding that reaches over each span. Shape (k,).
        ends: index of the first one after these that does not. Shape (k,).
    """

    def __init__(self, breaks: Breaks, layer: Layer, begins: Indices, ends: Indices) -> None:
        """Take what ``roundings_over`` returns for all spans as ``begins`` and ``ends``."""
        self.breaks = breaks
        self.layer = layer
        self.count = len(breaks.ways) - 1
        self.size = 4 if layer.curvature_jumps is None and layer.fourths is None else 5
        self.begins = begins
        self.ends = ends

    def counts(self, spans: slice | Indices) -> Indices:
        """Return how many roundings reach over each of some spans. Shape (n,)."""
        return np.asarray(self.ends[spans] - self.begins[spans])

    def near(self, begin: int, end: int) -> slice:
        """Return the roundings of which a break may be among those from ``begin`` to ``end``."""
        first, _ = np.searchsorted(self.breaks.ends, (begin, end))
        _, last = np.searchsorted(self.breaks.begins, (begin, end))
        return slice(int(first), int(last))

    def at(self, spans: Indices) -> FloatArray:
        """Return the coefficients on spans that a rounding reaches over. Shape (n, size, 3)."""
        counts = self.counts(spans)
        heads = np.cumsum(counts) - counts
        joint = np.arange(int(counts.sum())) + np.repeat(self.begins[spans] - heads, counts)
        span = np.repeat(spans, counts)
        width = self.layer.half_widths[joint]
        side = np.where(span >= self.breaks.middles[joint], 1.0, -1.0)
        x = self.breaks.ways[span] - self.layer.ways[joint]
        far = side * x
        rest = np.maximum(width - far, 0.0)
        unit = 1.0 / (6.0 * width * width)
        scale = self.layer.thirds[joint] * unit
        square = rest * rest
        slope = -side * scale
        jump = self.layer.tangent_jumps[joint]
        factors = [scale * square * rest, 3.0 * slope * square, 3.0 * scale * rest, slope]
        result = np.zeros((len(spans), self.size, 3))
        for power, factor in enumerate(factors):
            result[:, power] = np.add.reduceat(factor[:, np.newaxis] * jump, heads)
        if self.layer.fourths is not None:
            scale = 0.75 * self.layer.fourths[joint] * unit / width
            cube = square * rest
            slope = -4.0 * side * scale
            factors = [scale * cube * rest, slope * cube, 6.0 * scale * square, slope * rest, scale]
            for power, factor in enumerate(factors):
                result[:, power] += np.add.reduceat(factor[:, np.newaxis] * jump, heads)
        if self.layer.curvature_jumps is not None:
            scale = 0.5 * unit
            jump = self.layer.curvature_jumps[joint]
            factors = [
                scale * x * square * rest,
                scale * square * (rest - 3.0 * far),
                3.0 * scale * side * rest * (far - rest),
                scale * (3.0 * rest - far),
                -scale * side,
            ]
            for power, factor in enumerate(factors):
                result[:, power] += np.add.reduceat(factor[:, np.newaxis] * jump, heads)
        return result


def changes_at(sums: RoundingSums, some: slice) -> FloatArray:
    """Return by how much the coefficients of some spans jump where these begin.

    Args:
        sums: over roundings.
        some: spans, which are blocks of ``SUM_BLOCK``; the last one may be shorter.

    Returns:
        Shape (size, 3, n, SUM_BLOCK) for n blocks.
    """
    begin, count = some.start, some.stop - some.start
    blocks = -(-count // SUM_BLOCK)
    changes = np.zeros((sums.size, 3, blocks * SUM_BLOCK))
    for power, at, change in _jumps(sums, sums.near(begin, begin + count)):
        # The breaks ascend, as the roundings do.
        inside = slice(*np.searchsorted(at, (begin, begin + count)))
        places = at[inside] - begin
        for axis in range(3):
            changes[power, axis, :count] += np.bincount(places, change[axis, inside], count)
    return changes.reshape(sums.size, 3, blocks, SUM_BLOCK)


def carried_on(
    changes: FloatArray, first: FloatArray, ways: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the coefficients on spans in succession, and which of these lose digits.

    Args:
        changes: what ``changes_at`` returns; it is written to. Shape (size, 3, n, SUM_BLOCK).
        first: coefficients on the first span of each block. Shape (n, size, 3).
        ways: at which these spans begin, and the last one ends. Shape (m + 1,) [m].

    Returns:
        Shape (m, size, 3); (m,).
    """
    count = len(ways) - 1
    steps = np.zeros(changes.shape[2:])
    steps.ravel()[:count] = np.diff(ways)
    # From what the coefficients change by at each break to what they are.
    table = changes
    table[..., 0] = first.transpose(1, 2, 0)
    highest = len(table) - 1
    for power in range(highest, -1, -1):
        if power < highest:
            table[power, ..., 1:] += _moved(table[power:, ..., :-1], steps[:, :-1], power)
        np.cumsum(table[power], axis=-1, out=table[power])
    extents = steps.sum(axis=1)
    largest = np.abs(table[3:]).max(axis=(1, 3))
    lost = sum(extents ** (3 + power) * row for power, row in enumerate(largest))
    lossy = np.asarray(LOST_UNITS * lost > LARGEST_LOSS)
    filled = table.reshape(len(table), 3, -1).transpose(2, 0, 1)
    return filled[:count], np.repeat(lossy, SUM_BLOCK)[:count]


def _moved(table: FloatArray, steps: FloatArray, power: int) -> FloatArray:
    """Return how the coefficient of a ``power`` changes as polynomials are moved by ``steps``.

    Args:
        table: coefficients from this power on. Shape (n, 3, ...).
        steps: Shape (...) [m].
        power: the least one.
    """
    total = np.zeros(table.shape[1:])
    for above in range(len(table) - 1, 0, -1):
        total += comb(power + above, power) * table[above]
        total *= steps
    return total


def _jumps(sums: RoundingSums, some: slice) -> Iterator[tuple[int, Indices, FloatArray]]:
    """Yield which coefficients jump by ``some`` of the roundings, at which breaks, by how much.

    Shape (m,), (3, m).
    """
    layer, width = sums.layer, sums.layer.half_widths[some]
    begins, middles = sums.breaks.begins[some], sums.breaks.middles[some]
    ends = sums.breaks.ends[some]
    turn = np.ascontiguousarray(layer.tangent_jumps[some].T)
    thirds = layer.thirds[some]
    fourths = np.zeros_like(thirds) if layer.fourths is None else layer.fourths[some]
    yield 1, middles, -(thirds + fourths) * turn
    unit = turn / (6.0 * width * width)
    third = thirds * unit
    yield 3, begins, third
    yield 3, middles, -2.0 * third - 6.0 * fourths * unit
    yield 3, ends, third
    if layer.fourths is not None:
        fourth = 0.75 * fourths * unit / width
        yield 4, begins, fourth
        yield 4, ends, -fourth
    if layer.curvature_jumps is not None:
        bend = np.ascontiguousarray(layer.curvature_jumps[some].T)
        yield 2, middles, -0.5 * bend
        third, fourth = bend / (12.0 * width), bend / (12.0 * width * width)
        yield 3, begins, -third
        yield 3, ends, third
        yield 4, begins, fourth
        yield 4, middles, -2.0 * fourth
        yield 4, ends, fourth


def corrections_of(
    ways: FloatArray, joints: RoundedJoints, widths: Widths
) -> Interruptible[tuple[FloatArray, FloatArray]]:
    """Return what the roundings add to a path, as polynomials; interruptibly.

    Args:
        ways: of all joints, rounded or not. Shape (n + 1,) [m].
        joints: that are rounded.
        widths: of the roundings; of two, the one that begins first also ends first.

    Returns:
        The breaks, shape (k + 1,) [m]; and from each to the next the coefficients of ascending
        powers of the way from the break: four, or five if the curvature jumps at a joint or a
        rounding tapers off. Shape (k, 4 or 5, 3).
    """
    layers = yield from _layers(joints, widths)
    all_breaks = yield from _breaks(ways, layers)
    # The first layer has terms of the highest degree, so that the table is wide enough for all.
    table: FloatArray | None = None
    for layer, breaks in zip(layers, all_breaks):
        table = yield from _with_layer(table, layer, breaks)
    return all_breaks[0].ways, np.asarray(table)


def _with_layer(
    table: FloatArray | None, layer: Layer, breaks: Breaks
) -> Interruptible[FloatArray]:
    """Return the ``table`` of coefficients with those of a layer added; the first makes it."""
    count, terms = len(breaks.ways) - 1, 0
    over = yield from columns_of(count, lambda some: roundings_over(breaks, some))
    sums = RoundingSums(breaks, layer, *over)
    for some in blocks(count):
        terms += int(sums.counts(some).sum())
        yield
    carries_on = terms > max(FEW_TERMS, FEW_EACH * count)
    made = np.empty((count, sums.size, 3)) if table is None else table
    for begin in range(0, count, CARRIED_SPANS):
        some = slice(begin, min(begin + CARRIED_SPANS, count))
        added = yield from _corrections_on(sums, some, carries_on)
        if table is None:
            made[some] = added
        else:
            made[some, : sums.size] += added
        yield
    return made


def _layers(joints: RoundedJoints, widths: Widths) -> Interruptible[list[Layer]]:
    """Return the layers of all roundings, those with terms of the fourth degree first."""
    total, tapers, half_widths = len(joints.ways), widths.tapers, widths.half_widths
    tapering = yield from indices_of(tapers)
    swinging = yield from indices_of(widths.swings)
    bent = yield from any_of(np.asarray, joints.bends)
    thirds = yield from column_of(total, lambda some: 1.0 - tapers[some])
    fourths = None
    if len(tapering):
        fourths = yield from column_of(total, lambda some: PARTS[0][0] * tapers[some])
    jumps = joints.tangent_jumps, joints.curvature_jumps if bent else None
    layers = [Layer(joints.ways, *jumps, half_widths, thirds, fourths)]
    if len(tapering):
        ways = yield from picked(joints.ways, tapering)
        changes = yield from picked(joints.tangent_jumps, tapering)
        columns = yield from columns_of(
            len(tapering),
            lambda some: inner_parts(half_widths[tapering[some]], tapers[tapering[some]]),
        )
        nothing = np.zeros(len(tapering))
        for narrower, heights in zip(columns[::2], columns[1::2]):
            layers.append(Layer(ways, changes, None, narrower, nothing, heights))
    if len(swinging):
        ways = yield from picked(joints.ways, swinging)
        changes = yield from picked(joints.tangent_jumps, swinging)
        given = half_widths, widths.swings, widths.swing_widths
        columns = yield from columns_of(
            len(swinging), lambda some: swing_parts(*(each[swinging[some]] for each in given))
        )
        for wide, heights in zip(columns[::2], columns[1::2]):
            layers.append(Layer(ways, changes, None, wide, heights, None))
    return layers


def _breaks(ways: FloatArray, layers: Sequence[Layer]) -> Interruptible[list[Breaks]]:
    """Return the joints of a path and the ends of its roundings, each place once.

    Args:
        ways: of all joints, rounded or not. Shape (n + 1,) [m].
        layers: of roundings.

    Returns:
        One for each layer, all with the same ``ways``.
    """
    middles = yield from concatenated([layer.ways for layer in layers])
    half_widths = yield from concatenated([layer.half_widths for layer in layers])
    begins, ends = yield from columns_of(
        len(middles),
        lambda some: (
            np.clip(middles[some] - half_widths[some], ways[0], ways[-1]),
            np.clip(middles[some] + half_widths[some], ways[0], ways[-1]),
        ),
    )
    ends = yield from concatenated((ways, begins, ends))
    order = yield from sorting(ends, ways[:: ROWS // 3])
    ascending = yield from picked(ends, order)
    fresh = np.ones(len(ends), dtype=bool)
    group = np.empty(len(ends), dtype=np.intp)
    total = -1
    for first in range(0, len(ends), ROWS):
        yield
        some = slice(first, first + ROWS)
        begin = max(first, 1)
        steps = np.diff(ascending[begin - 1 : first + ROWS])
        fresh[begin : first + ROWS] = steps > SAME_BREAK * ways[-1]
        numbers = np.cumsum(fresh[some]) + total
        group[order[some]] = numbers
        total = int(numbers[-1])
    yield
    places = yield from picked(ascending, (yield from indices_of(fresh)))
    # A joint counts as the end of a rounding that differs from it by rounding errors only.
    count, rounded = len(ways), len(half_widths)
    for some in blocks(count):
        places[group[some]] = ways[some]
        yield
    columns = (
        group[count : count + rounded],
        (yield from column_of(rounded, lambda some: group[np.searchsorted(ways, middles[some])])),
        group[count + rounded :],
    )
    last = np.cumsum([len(layer.half_widths) for layer in layers])
    return [
        Breaks(places, *(column[end - len(layer.half_widths) : end] for column in columns))
        for layer, end in zip(layers, last)
    ]


def _corrections_on(sums: RoundingSums, some: slice, carries_on: bool) -> Interruptible[FloatArray]:
    """Return the coefficients on some spans in succession. Shape (n, size, 3)."""
    formed = sums.counts(some) > 0
    if carries_on:
        heads = np.flatnonzero(formed[::SUM_BLOCK])
        firsts = np.zeros((-(-len(formed) // SUM_BLOCK), sums.size, 3))
        yield from _form(firsts, heads, sums, some.start + SUM_BLOCK * heads)
        changes = changes_at(sums, some)
        yield
        ways = sums.breaks.ways[some.start : some.stop + 1]
        table, is_lossy = carried_on(changes, firsts, ways)
        yield
        table[~formed] = 0.0
        formed &= is_lossy
    else:
        table = np.zeros((len(formed), sums.size, 3))
    rows = np.flatnonzero(formed)
    yield from _form(table, rows, sums, some.start + rows)
    return table


def _form(
    table: FloatArray, rows: Indices, sums: RoundingSums, spans: Indices
) -> Interruptible[None]:
    """Write coefficients on ``spans`` to ``rows`` of a ``table``, each summed over all roundings.

    Args:
        table: Shape (n, size, 3).
        rows: Shape (m,).
        sums: over roundings.
        spans: Shape (m,).
    """
    part = np.cumsum(sums.counts(spans)) // TERMS
    for number in range(int(part[-1]) + 1 if len(part) else 0):
        these = slice(*np.searchsorted(part, (number, number + 1)))
        if these.stop > these.start:
            table[rows[these]] = sums.at(spans[these])
            yield
