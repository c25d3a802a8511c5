r"""What the roundings of all joints together add to the path as programmed: a piecewise quartic.

Between two breaks it is the sum of all roundings that reach over them. Where many overlap, this
sum is formed at some breaks only, and carried on from them: the polynomial is moved to the next
break, where one of its coefficients jumps as a rounding begins, ends or passes its joint.

Roundings are sorted into layers. In a layer of two roundings the one that begins first also ends
first. Those that taper off or swing out are put together of some, one inside the other
(``widths``), each in a layer of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.vectors import BoolArray, FloatArray, Indices

# Number of breaks that are worked through from each sum over all roundings.
SUM_BLOCK = 64

# Carrying on may cost so many units of rounding of the largest third derivative, and this [m].
LOST_UNITS = 2e-15
LARGEST_LOSS = 1e-15


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
