r"""What the roundings of all joints together add to the path as programmed: a piecewise quartic.

Between two breaks it is the sum of all roundings that reach over them. Where many overlap, this
sum is formed at some breaks only, and carried on from them: the polynomial is moved to the next
break, where one of its coefficients jumps as a rounding begins, ends or passes its joint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import comb

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import Interruptible, blocks, columns_of
from tri_glide_kinematics.motion.path.corners.joints import Indices, RoundedJoints
from tri_glide_kinematics.motion.path.corners.rounding_layers import (
    Breaks,
    Layer,
    breaks_of,
    layers_of,
)
from tri_glide_kinematics.motion.path.corners.widths import Widths
from tri_glide_kinematics.vectors import FloatArray

# So many breaks are worked through from each sum over all roundings, and so many blocks of them
# together.
BLOCK = 64
TOGETHER = 64

# The sums are formed at all breaks if they have no more terms, or no more each on average.
FEW_TERMS = 4000
FEW_EACH = 2

# So many terms are worked on between two breaks of the computation.
AT_A_TIME = 2000

# Carrying on may cost so many units of rounding of the largest third derivative, and this [m].
UNITS = 2e-15
LARGEST_LOSS = 1e-15


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
    layers = yield from layers_of(joints, widths)
    breaks = yield from breaks_of(ways, layers)
    yield
    # The first layer has terms of the highest degree, so that the table is wide enough for all.
    table = np.empty((0, 0, 3))
    for at, layer in zip(breaks, layers):
        sums = _Sums(at, layer, *(yield from columns_of(*_over_pieces(at))))
        carries_on = yield from _are_many(sums)
        if layer is layers[0]:
            table = np.empty((sums.count, sums.size, 3))
        for begin in range(0, sums.count, BLOCK * TOGETHER):
            some = slice(begin, min(begin + BLOCK * TOGETHER, sums.count))
            added = yield from _corrections_on(sums, some, carries_on)
            if layer is layers[0]:
                table[some] = added
            else:
                table[some, : sums.size] += added
            yield
    return breaks[0].ways, table


def _are_many(sums: _Sums) -> Interruptible[bool]:
    """Return whether the sums have so many terms that not all of them are formed."""
    terms = 0
    for some in blocks(sums.count):
        terms += int(sums.counts(some).sum())
        yield
    return terms > max(FEW_TERMS, FEW_EACH * sums.count)


def _corrections_on(sums: _Sums, some: slice, carries_on: bool) -> Interruptible[FloatArray]:
    """Return the coefficients on some pieces in succession. Shape (n, size, 3)."""
    counts = sums.counts(some)
    formed = counts > 0
    if carries_on:
        table, lossy = yield from _carried_on(sums, some)
        table[~formed] = 0.0
        formed &= np.repeat(lossy, BLOCK)[: len(formed)]
    else:
        table = np.zeros((len(counts), sums.size, 3))
    places = np.flatnonzero(formed)
    part = np.cumsum(counts[places]) // AT_A_TIME
    for number in range(int(part[-1]) + 1 if len(part) else 0):
        these = places[slice(*np.searchsorted(part, (number, number + 1)))]
        if len(these):
            table[these] = sums.at(some.start + these)
            yield
    return table


def _over_pieces(breaks: Breaks) -> tuple[int, Callable[[slice], list[Indices]]]:
    """Return how many pieces there are, and what finds which roundings reach over some of them.

    These are the index of the first one that does, and of the first one after these that does not.
    """

    def found(some: slice) -> list[Indices]:
        columns = []
        for at in (breaks.ends, breaks.begins):
            first, last = np.searchsorted(at, (some.start, some.stop))
            here = np.bincount(at[first:last] - some.start, minlength=some.stop - some.start)
            columns.append(first + np.cumsum(here))
        return columns

    return len(breaks.ways) - 1, found


class _Sums:
    """Sums over the roundings that reach over some pieces.

    Attributes:
        count: number of pieces.
        size: of coefficients.
        begins: index of the first rounding that reaches over each piece. Shape (k,).
        ends: index of the first one after these that does not. Shape (k,).
    """

    def __init__(self, breaks: Breaks, layer: Layer, begins: Indices, ends: Indices) -> None:
        self.breaks = breaks
        self.layer = layer
        self.count = len(breaks.ways) - 1
        self.size = 4 if layer.curvature_jumps is None and layer.fourths is None else 5
        self.begins = begins
        self.ends = ends

    def counts(self, pieces: slice | Indices) -> Indices:
        """Return how many roundings reach over each of some pieces. Shape (n,)."""
        return np.asarray(self.ends[pieces] - self.begins[pieces])

    def near(self, begin: int, end: int) -> slice:
        """Return the roundings of which a break may be among those from ``begin`` to ``end``."""
        first, _ = np.searchsorted(self.breaks.ends, (begin, end))
        _, last = np.searchsorted(self.breaks.begins, (begin, end))
        return slice(int(first), int(last))

    def at(self, pieces: Indices) -> FloatArray:
        """Return the coefficients on pieces that a rounding reaches over. Shape (n, size, 3)."""
        counts = self.counts(pieces)
        heads = np.cumsum(counts) - counts
        joint = np.arange(int(counts.sum())) + np.repeat(self.begins[pieces] - heads, counts)
        piece = np.repeat(pieces, counts)
        width = self.layer.half_widths[joint]
        side = np.where(piece >= self.breaks.middles[joint], 1.0, -1.0)
        x = self.breaks.ways[piece] - self.layer.ways[joint]
        far = side * x
        rest = np.maximum(width - far, 0.0)
        unit = 1.0 / (6.0 * width * width)
        scale = self.layer.thirds[joint] * unit
        square = rest * rest
        slope = -side * scale
        jump = self.layer.tangent_jumps[joint]
        factors = [scale * square * rest, 3.0 * slope * square, 3.0 * scale * rest, slope]
        result = np.zeros((len(pieces), self.size, 3))
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


def _carried_on(sums: _Sums, some: slice) -> Interruptible[tuple[FloatArray, NDArray[np.bool_]]]:
    """Return the coefficients from a sum at the begin of each block, and which blocks lose digits.

    ``some`` of the pieces begin with a block.
    """
    starts = np.arange(some.start, some.stop, BLOCK)
    counts = sums.counts(starts)
    first = np.zeros((len(starts), sums.size, 3))
    covered = np.flatnonzero(counts)
    each = 1 + AT_A_TIME * len(covered) // (1 + int(counts.sum()))
    for head in range(0, len(covered), each):
        these = covered[head : head + each]
        first[these] = sums.at(starts[these])
        yield
    return (yield from _blocks(sums, some.start, first))


def _blocks(
    sums: _Sums, begin: int, first: FloatArray
) -> Interruptible[tuple[FloatArray, NDArray[np.bool_]]]:
    """Return the coefficients on the pieces of some blocks, and which blocks lose digits.

    Args:
        sums: over roundings.
        begin: index of the first piece of these blocks.
        first: coefficients on the first piece of each block. Shape (n, size, 3).
    """
    blocks = len(first)
    count = min(blocks * BLOCK, sums.count - begin)
    padded = np.zeros((sums.size, 3, blocks * BLOCK))
    for power, at, change in _jumps(sums, sums.near(begin, begin + count)):
        # The breaks ascend, as the roundings do.
        inside = slice(*np.searchsorted(at, (begin, begin + count)))
        places = at[inside] - begin
        for axis in range(3):
            padded[power, axis, :count] += np.bincount(places, change[axis, inside], count)
    yield
    steps = np.zeros((blocks, BLOCK))
    steps.ravel()[:count] = np.diff(sums.breaks.ways[begin : begin + count + 1])
    # From what the coefficients change by at each break to what they are.
    table = padded.reshape(sums.size, 3, blocks, BLOCK)
    table[..., 0] = first.transpose(1, 2, 0)
    highest = sums.size - 1
    for power in range(highest, -1, -1):
        if power < highest:
            table[power, ..., 1:] += _moved(table[power:, ..., :-1], steps[:, :-1], power)
        np.cumsum(table[power], axis=-1, out=table[power])
    yield
    extents = steps.sum(axis=1)
    largest = np.abs(table[3:]).max(axis=(1, 3))
    lost = sum(extents ** (3 + power) * row for power, row in enumerate(largest))
    filled = padded.transpose(2, 0, 1)[:count]
    return filled, np.asarray(UNITS * lost > LARGEST_LOSS)


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


def _jumps(sums: _Sums, some: slice) -> Iterator[tuple[int, Indices, FloatArray]]:
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
