r"""What the roundings of all joints together add to the path as programmed: a piecewise quartic.

Between two breaks it is the sum of all roundings that reach over them. Where many overlap, this
sum is formed at some breaks only, and carried on from them: the polynomial is moved to the next
break, where one of its coefficients jumps as a rounding begins, ends or passes its joint.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import comb

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.paths.joints import Indices, RoundedJoints, any_bend
from tri_glide_kinematics.motion.paths.layers import Breaks, Layer, breaks_of, layers_of
from tri_glide_kinematics.motion.paths.widths import Widths
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
    layers = layers_of(joints, widths)
    yield
    breaks = yield from breaks_of(ways, layers)
    yield
    table = yield from corrections_at(breaks[0], layers[0])
    for at, layer in zip(breaks[1:], layers[1:]):
        added = yield from corrections_at(at, layer)
        # The first layer has terms of the highest degree, so that its table is the widest.
        table[:, : added.shape[1]] += added
    return breaks[0].ways, table


def corrections_at(breaks: Breaks, layer: Layer) -> Interruptible[FloatArray]:
    """Return what a layer adds from each break to the next. Shape (k, 4 or 5, 3)."""
    sums = _Sums(breaks, layer)
    yield
    counts = sums.ends - sums.begins
    if counts.sum() <= max(FEW_TERMS, FEW_EACH * sums.count):
        table = np.zeros((sums.count, sums.size, 3))
        pieces = np.flatnonzero(counts)
    else:
        table, lossy = yield from _carried_on(sums, counts)
        yield
        table[counts == 0] = 0.0
        yield
        pieces = np.flatnonzero(np.repeat(lossy, BLOCK)[: sums.count] & (counts > 0))
        yield
    part = np.cumsum(counts[pieces]) // AT_A_TIME
    for number in range(int(part[-1]) + 1 if len(part) else 0):
        some = pieces[slice(*np.searchsorted(part, (number, number + 1)))]
        if len(some):
            table[some] = sums.at(some)
            yield
    return table


class _Sums:
    """Sums over the roundings that reach over some pieces.

    Attributes:
        count: number of pieces.
        size: of coefficients.
        begins: index of the first rounding that reaches over each piece. Shape (k,).
        ends: index of the first one after these that does not. Shape (k,).
    """

    def __init__(self, breaks: Breaks, layer: Layer) -> None:
        self.breaks = breaks
        self.layer = layer
        self.joints = layer.joints
        self.bent = any_bend(layer.joints)
        self.tapering = bool(layer.fourths.any())
        self.count = len(breaks.ways) - 1
        self.size = 5 if self.bent or self.tapering else 4
        over = np.bincount(breaks.ends, minlength=self.count + 1)
        under = np.bincount(breaks.begins, minlength=self.count + 1)
        self.begins = np.cumsum(over)[:-1]
        self.ends = np.cumsum(under)[:-1]

    def near(self, begin: int, end: int) -> slice:
        """Return the roundings of which a break may be among those from ``begin`` to ``end``."""
        first, _ = np.searchsorted(self.breaks.ends, (begin, end))
        _, last = np.searchsorted(self.breaks.begins, (begin, end))
        return slice(int(first), int(last))

    def at(self, pieces: Indices) -> FloatArray:
        """Return the coefficients on pieces that a rounding reaches over. Shape (n, size, 3)."""
        counts = self.ends[pieces] - self.begins[pieces]
        heads = np.cumsum(counts) - counts
        joint = np.arange(int(counts.sum())) + np.repeat(self.begins[pieces] - heads, counts)
        piece = np.repeat(pieces, counts)
        width = self.layer.half_widths[joint]
        side = np.where(piece >= self.breaks.middles[joint], 1.0, -1.0)
        x = self.breaks.ways[piece] - self.joints.ways[joint]
        far = side * x
        rest = np.maximum(width - far, 0.0)
        unit = 1.0 / (6.0 * width * width)
        scale = self.layer.thirds[joint] * unit
        square = rest * rest
        slope = -side * scale
        jump = self.joints.tangent_jumps[joint]
        factors = [scale * square * rest, 3.0 * slope * square, 3.0 * scale * rest, slope]
        result = np.zeros((len(pieces), self.size, 3))
        for power, factor in enumerate(factors):
            result[:, power] = np.add.reduceat(factor[:, np.newaxis] * jump, heads)
        if self.tapering:
            scale = 0.75 * self.layer.fourths[joint] * unit / width
            cube = square * rest
            slope = -4.0 * side * scale
            factors = [scale * cube * rest, slope * cube, 6.0 * scale * square, slope * rest, scale]
            for power, factor in enumerate(factors):
                result[:, power] += np.add.reduceat(factor[:, np.newaxis] * jump, heads)
        if self.bent:
            scale = 0.5 * unit
            jump = self.joints.curvature_jumps[joint]
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


def _carried_on(
    sums: _Sums, counts: Indices
) -> Interruptible[tuple[FloatArray, NDArray[np.bool_]]]:
    """Return the table, from a sum at the begin of each block, and which blocks lose digits."""
    starts = np.arange(0, sums.count, BLOCK)
    first = np.zeros((len(starts), sums.size, 3))
    covered = np.flatnonzero(counts[starts])
    for some in np.array_split(covered, 1 + int(counts[starts].sum()) // AT_A_TIME):
        if len(some):
            first[some] = sums.at(starts[some])
            yield
    table = np.empty((sums.count, sums.size, 3))
    lossy = []
    for begin in range(0, len(starts), TOGETHER):
        filled, lost = yield from _blocks(sums, begin * BLOCK, first[begin : begin + TOGETHER])
        table[begin * BLOCK : begin * BLOCK + len(filled)] = filled
        lossy.append(lost)
        yield
    return table, np.concatenate(lossy)


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
    turn = np.ascontiguousarray(sums.joints.tangent_jumps[some].T)
    fourths, thirds = layer.fourths[some], layer.thirds[some]
    yield 1, middles, -(thirds + fourths) * turn
    unit = turn / (6.0 * width * width)
    third = thirds * unit
    yield 3, begins, third
    yield 3, middles, -2.0 * third - 6.0 * fourths * unit
    yield 3, ends, third
    if sums.tapering:
        fourth = 0.75 * fourths * unit / width
        yield 4, begins, fourth
        yield 4, ends, -fourth
    if sums.bent:
        bend = np.ascontiguousarray(sums.joints.curvature_jumps[some].T)
        yield 2, middles, -0.5 * bend
        third, fourth = bend / (12.0 * width), bend / (12.0 * width * width)
        yield 3, begins, -third
        yield 3, ends, third
        yield 4, begins, fourth
        yield 4, middles, -2.0 * fourth
        yield 4, ends, fourth
