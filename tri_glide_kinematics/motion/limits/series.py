r"""Taylor series of the motion of platform and sliders, with bounds over whole cells of time.

A cell is a short interval of time in which a motion is smooth. About its middle a motion has the
coefficients $f_n = f^{(n)} / n!$ up to the fifth order; besides, for each order there is a bound of
$|f_n|$ about any instant of the cell. Products, roots and compositions of series give both in the
same way: the bounds with absolute values and sums for differences. So the fifth order bounds what
a polynomial of the fourth order leaves out, and what follows from it is proved, not sampled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible, blocks
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import BoolArray, FloatArray

# The number of coefficients: up to the fifth order.
ORDERS = 6

# The velocity of the platform in a cell is taken to be at most so much more than with the inverse
# matrix of its middle; what follows from that shows whether it is.
_SUPPOSED = 1.5


# Cells are so long at first. Where they would be more than so many between two knots, as in slow
# motion, there are few. Where no limit is proved they are divided by four, until they are short
# [s].
FIRST_CELL = 0.008
MOST_BETWEEN = 16
SLOW_BETWEEN = 4
SHORTEST_CELL = FIRST_CELL / 64.0

# Number of edges that are looked at between two breaks of the computation.
EDGES_AT_ONCE = 500

# Middles of the quarters of a cell, in halves of it.
_QUARTERS = np.array((-0.75, -0.25, 0.25, 0.75))


class Series(NamedTuple):
    """Taylor series of some quantities in n cells.

    Attributes:
        values: coefficients about the middles, in ascending order. Shape (6, m, n).
        bounds: of the absolute coefficients about any instant of the cells; NaN where none is
            known. Shape (6, m, n).
    """

    values: FloatArray
    bounds: FloatArray

    def plus(self, other: Series) -> Series:
        """Return the sum of two motions."""
        return Series(self.values + other.values, self.bounds + other.bounds)

    def of(self, cells: BoolArray) -> Series:
        """Return those of some ``cells``. Shape (n,)."""
        return Series(self.values[..., cells], self.bounds[..., cells])

    def put(self, cells: BoolArray, those: Series) -> None:
        """Replace ``those`` of some ``cells``. Shape (n,)."""
        self.values[..., cells], self.bounds[..., cells] = those


def divided(
    edges: FloatArray, most: int = MOST_BETWEEN, slow: int = SLOW_BETWEEN
) -> tuple[FloatArray, FloatArray]:
    """Return middles and halves of cells between ``edges``, as long as they are at first.

    Args:
        edges: ascending. Shape (k,) [s].
        most: so many are between two of them, at most.
        slow: so many are where those would be more.
    """
    lengths = np.diff(edges)
    counts = np.maximum(np.ceil(lengths / FIRST_CELL), 1.0)
    counts = np.where(counts > most, slow, counts).astype(int)
    half = np.repeat(0.5 * lengths / counts, counts)
    number = np.arange(len(half)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(edges[:-1], counts) + (2.0 * number + 1.0) * half, half


def dividing(
    edges: FloatArray, slow: int = SLOW_BETWEEN
) -> Interruptible[tuple[FloatArray, FloatArray]]:
    """Return the same as ``divided``, in pieces where there are many edges."""
    parts = []
    for some in blocks(max(len(edges) - 1, 1), EDGES_AT_ONCE):
        if some.start:
            yield
        parts.append(divided(edges[some.start : some.stop + 1], slow=slow))
    middles, half = (np.concatenate(each) for each in zip(*parts))
    return middles, half


def quartered(middles: FloatArray, half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return middles and halves of the quarters of cells. Shapes (4 n,) [s]."""
    middles = (middles[:, np.newaxis] + np.outer(half, _QUARTERS)).ravel()
    return middles, np.repeat(0.25 * half, 4)


def resting(places: FloatArray, count: int) -> Series:
    """Return rest at ``places``, shape (m,), in ``count`` cells."""
    values = np.zeros((ORDERS, len(places), count))
    values[0] = places[:, np.newaxis]
    return Series(values, np.abs(values))


def polynomial(coefficients: FloatArray, half: FloatArray) -> Series:
    """Return polynomials as series.

    Args:
        coefficients: of ascending powers of the time from the middles, of the fifth degree at
            most. Shape (k, m, n).
        half: of the lengths of the cells. Shape (n,) [s].
    """
    values = np.zeros((ORDERS, *coefficients.shape[1:]))
    values[: len(coefficients)] = coefficients
    # About an instant later than the middle; for an earlier one the signs do not matter.
    return Series(values, moved(np.abs(values), half))


def moved(coefficients: FloatArray, times: FloatArray) -> FloatArray:
    """Return the coefficients of polynomials about other ``times``. Shape (k, m, n).

    Args:
        coefficients: of ascending powers of the time. Shape (k, m, n).
        times: Shape (n,) [s].
    """
    result = coefficients.copy()
    count = len(coefficients)
    for first in range(count - 1):
        for order in range(count - 2, first - 1, -1):
            result[order] += times * result[order + 1]
    return result


def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the coefficients of a product of series, up to the fifth order."""
    result = a[:1] * b
    for order in range(1, ORDERS):
        result[order:] += a[order] * b[: ORDERS - order]
    return result


def composed(outer: Series, inner: Series) -> Series:
    """Return the series of a motion along a curve.

    Args:
        outer: places over the way, about the ways at the middles and with bounds in the cells.
            Shape (6, m, n).
        inner: the way over time. Shape (6, 1, n).
    """
    results = []
    for coefficients, way in zip(outer, inner):
        change = way.copy()
        change[0] = 0.0
        result = np.zeros_like(coefficients)
        # Of a line only the first two are not zero.
        top = max((n for n in range(ORDERS) if coefficients[n].any()), default=0)
        result[0] = coefficients[top]
        for coefficient in coefficients[:top][::-1]:
            result = product(change, result)
            result[0] += coefficient
        results.append(result)
    return Series(*results)


def heights_of(geometry: TriGlideGeometry, position: Series, half: FloatArray) -> Series:
    """Return the series of the slider heights where the platform moves.

    Args:
        geometry: of the machine.
        position: of the platform. Shape (6, 3, n) [m].
        half: of the lengths of the cells. Shape (n,) [s].
    """
    anchors = np.array(geometry.anchors)
    results = []
    for coefficients, sign in zip(position, (-1.0, 1.0)):
        # How far each arm reaches sideways; its rise squared is what is left of its length squared.
        across = np.repeat(coefficients[:, np.newaxis, :2], 3, axis=1)
        if sign < 0.0:
            across[0] -= anchors[..., np.newaxis]
            farthest = np.abs(across[0]) + half * position.bounds[1, :2]
        else:
            across[0] = farthest
        square = sign * product(across, across).sum(axis=2)
        results.append(square)
    values, bounds = results
    values[0] += np.square(geometry.arm_lengths)[:, np.newaxis]
    change = half * bounds[1]
    with np.errstate(invalid="ignore"):
        rise = _square_root(values, np.sqrt(values[0]))
        least = np.sqrt(values[0] - change)
        largest = _square_root(-bounds, least)
        rise_bounds = np.abs(largest)
        rise_bounds[0] = np.sqrt(values[0] + change)
    rise += position.values[:, 2:]
    return Series(rise, rise_bounds + position.bounds[:, 2:])


def _square_root(square: FloatArray, root: FloatArray) -> FloatArray:
    """Return the coefficients of the root of a series, from its value or a lower bound of that.

    From the negative bounds of a series come those of its root: all terms have one sign then.
    """
    result = np.empty_like(square)
    result[0] = root
    scale = 0.5 / root
    for order in range(1, ORDERS):
        rest = square[order].copy()
        for i in range(1, order):
            rest -= result[i] * result[order - i]
        result[order] = scale * rest
    return result


def position_of(machine: TriGlide, heights: Series, half: FloatArray) -> Series:
    r"""Return the series of the platform's position where the sliders move.

    With $w_i$ from the joint of slider i to the platform, $|w_i|^2 = L_i^2$ for all times. So order
    by order, $w_{i,0} \cdot w_{i,n} = -\tfrac12 \sum_{0<j<n} w_{i,j} \cdot w_{i,n-j}$, three
    equations for the platform's coefficients of that order.

    The inverse of their matrix anywhere in a cell is bounded by that in its middle and a Neumann
    series, for a largest velocity that is supposed. Where the bound that follows is smaller, it
    holds: the velocity is continuous, and below it in the middle.

    Args:
        machine: the tri-glide.
        heights: of the sliders. Shape (6, 3, n) [m].
        half: of the lengths of the cells. Shape (n,) [s].
    """
    anchors = np.array(machine.geometry.anchors)
    start = machine.forward_batch(heights.values[0].T).T
    arms = np.repeat(start[np.newaxis], 3, axis=0)
    arms[:, :2] -= anchors[..., np.newaxis]
    arms[:, 2] -= heights.values[0]
    matrices = arms.transpose(2, 0, 1)
    inverse = np.asarray(np.linalg.inv(matrices).transpose(1, 2, 0), dtype=np.float64)
    values = _recursion(inverse, arms[:, 2], heights.values, -1.0)
    values[0] = start

    size, rises = np.abs(inverse), np.abs(arms[:, 2])
    supposed = _SUPPOSED * np.einsum("ijn,jn->in", size, rises * heights.bounds[1])
    turned = np.repeat(supposed[np.newaxis], 3, axis=0)
    turned[:, 2] += heights.bounds[1]
    turned *= half
    largest = largest_inverse(size, turned)
    bounds = _recursion(largest, rises + turned[:, 2], heights.bounds, 1.0)
    bounds[0] = np.abs(start) + half * bounds[1]
    bounds[:, :, ~(bounds[1] <= supposed).all(axis=0)] = np.nan
    return Series(values, bounds)


def positions(machine: TriGlide, series: Series, of_sliders: BoolArray, half: FloatArray) -> Series:
    """Return series of the platform's position, with those of slider heights replaced.

    Args:
        machine: the tri-glide.
        series: of the heights, or of the position. Shape (6, 3, n) [m].
        of_sliders: in which cells they are of the heights. Shape (n,).
        half: of the lengths of the cells. Shape (n,) [s].
    """
    if of_sliders.any():
        series.put(of_sliders, position_of(machine, series.of(of_sliders), half[of_sliders]))
    return series


def largest_inverse(size: FloatArray, changes: FloatArray) -> FloatArray:
    """Return bounds of the absolute inverse of a matrix that changes in a cell.

    They are those of a Neumann series.

    Args:
        size: absolute values of the inverse in the middle. Shape (3, 3, n).
        changes: of the matrix from there, at most. Shape (3, 3, n).

    Returns:
        Shape (3, 3, n); NaN where the series does not converge.
    """
    change = np.einsum("ijn,jkn->ikn", size, changes)
    norm = change.sum(axis=1).max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where(norm < 1.0, 1.0 / (1.0 - norm), np.nan)
    return np.asarray(size + np.einsum("kn,kjn->jn", change.max(axis=0), size) * factor)


def _recursion(
    inverse: FloatArray, rises: FloatArray, heights: FloatArray, sign: float
) -> FloatArray:
    """Return the platform's coefficients from the first order on, or their bounds.

    Args:
        inverse: of the matrix of the arms. Shape (3, 3, n).
        rises: from slider to platform. Shape (3, n) [m].
        heights: coefficients. Shape (6, 3, n).
        sign: -1 for coefficients, 1 for bounds.
    """
    result = np.zeros_like(heights)
    arms = np.zeros((ORDERS, 3, *heights.shape[1:]))
    for order in range(1, ORDERS):
        right = rises * heights[order]
        if order > 1:
            earlier = arms[1:order]
            right += 0.5 * sign * np.einsum("oijn,oijn->in", earlier, earlier[::-1])
        result[order] = np.einsum("ijn,jn->in", inverse, right)
        arms[order] = result[order]
        arms[order, :, 2] += sign * heights[order]
    return result


def largest_value(coefficients: FloatArray, rest: FloatArray, half: FloatArray) -> FloatArray:
    """Return upper bounds of polynomials of the third degree, and a rest, in cells. Shape (n,).

    Args:
        coefficients: of ascending powers of the time from the middles. Shape (4, n).
        rest: bound of the absolute coefficient of the fourth power. Shape (n,).
        half: of the lengths of the cells. Shape (n,) [s].
    """
    c0, c1, c2, c3 = coefficients
    # A parabola that has its top inside; else it is largest at an end.
    top_inside = np.abs(c1) < -2.0 * c2 * half
    top = -0.25 * c1 * c1 / np.where(top_inside, c2, -1.0)
    parabola = np.where(top_inside, top, np.abs(c1) * half + c2 * half * half)
    return np.asarray(c0 + parabola + (np.abs(c3) + rest * half) * half**3)
