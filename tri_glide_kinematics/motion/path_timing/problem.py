r"""The time-optimal speed along a path, as an optimisation over a quadratic spline.

Over the parameter u of a path (``grid.py``) the unknown is $b(u) = \dot u^2$, a quadratic in
each cell with a continuous slope. With the heights $H(u)$ of a slider

$$|H'| \sqrt b \le V, \quad |\tfrac12 H' b' + H'' b| \le A, \quad
|\tfrac12 H' b'' + \tfrac32 H'' b' + H''' b| \le J / \sqrt b,$$

and the duration $\int du / \sqrt b$ is to be least. The duration is convex, the first two kinds of
constraints are linear. In the third the right side is convex, so that its tangent is a stricter
constraint: a solver that linearises it stays on the safe side.

The coefficients of the spline are b at the first place, the middle control point of each cell, and
b at the last place: each cell has three coefficients, and the next cell two of the same. At rest
the slope of b is zero, so that the first or the last of these has no effect.

The bound of b is one of the middle control points. At the ends of cells b is a mean of two of them:
coefficients that alternate would not be seen there, and would pay.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.limits import PathRows
from tri_glide_kinematics.vectors import BoolArray, FloatArray

# Places of Gauss' quadrature with two points, in a cell from 0 to 1.
_GAUSS = (0.5 - 0.5 / 3.0**0.5, 0.5 + 0.5 / 3.0**0.5)

# The middle control point of a cell as a row over its three coefficients.
_MIDDLE = np.array(((0.0,), (1.0,), (0.0,)))


class SplineRows(NamedTuple):
    """Values of the spline in each of n cells, as rows over the three coefficients of the cell.

    Attributes:
        left: b where the cell begins. Shape (3, n).
        right: b where it ends. Shape (3, n).
        left_slope: b' where it begins. Shape (3, n).
        right_slope: b' where it ends. Shape (3, n).
        bend: b'' in it. Shape (3, n).
        inside: b at two places inside. Shape (3, 2, n).
    """

    left: FloatArray
    right: FloatArray
    left_slope: FloatArray
    right_slope: FloatArray
    bend: FloatArray
    inside: FloatArray


class CellHeights(NamedTuple):
    """Derivatives of the slider heights by u, at two places in each of n cells.

    These are where a cell begins and where it ends.

    Attributes:
        first: Shape (2, 3, n).
        second: Shape (2, 3, n) [1/m].
        highest: third derivative, the largest in each cell. Shape (2, 3, n) [1/m^2].
        lowest: likewise, the least. Shape (2, 3, n) [1/m^2].
    """

    first: FloatArray
    second: FloatArray
    highest: FloatArray
    lowest: FloatArray


class CellLimits(NamedTuple):
    """What each of n cells allows.

    Attributes:
        squared_speed: upper bound of the middle control point of b. Shape (n,).
        acceleration: of the sliders. Shape (3, n) [m/s^2].
        jerk: of the sliders. Shape (3, n) [m/s^3].
        added: what the added bounds ask for where each cell begins.
    """

    squared_speed: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    added: PathRows


class TimingProblem(NamedTuple):
    """What is to be solved, for n cells.

    Attributes:
        spans: lengths of the cells in u. Shape (n,).
        rows: of the spline.
        linear: rows over the coefficients that are at most 1: the middle control point, the
            accelerations upwards and downwards where cells begin, and the k rows of the added
            bounds there. Shape (3, 7 + k, n).
        jerks: rows that are at most 1/sqrt(b): the jerks upwards where cells begin and where
            they end, and downwards. Shape (3, 12, n).
        values: b where cells begin and where they end. Shape (3, 2, n).
        start: the first two coefficients if the motion goes on, or None if it begins at rest.
    """

    spans: FloatArray
    rows: SplineRows
    linear: FloatArray
    jerks: FloatArray
    values: FloatArray
    start: tuple[float, float] | None


def spline_rows(spans: FloatArray, from_rest: bool) -> SplineRows:
    """Return the rows of a spline.

    Args:
        spans: lengths of the cells in u. Shape (n,).
        from_rest: whether the motion begins at rest. It always ends there.
    """
    left, right, middle = np.zeros((3, 3, len(spans)))
    share = spans[1:] / (spans[1:] + spans[:-1])
    left[1 if from_rest else 0, 0] = right[1, -1] = 1.0
    left[0, 1:] = right[1, :-1] = share
    left[1, 1:] = right[2, :-1] = 1.0 - share
    middle[1] = 1.0
    inside = [(1.0 - x) * ((1.0 - x) * left + 2.0 * x * middle) + x * x * right for x in _GAUSS]
    return SplineRows(
        left,
        right,
        (2.0 / spans) * (middle - left),
        (2.0 / spans) * (right - middle),
        (2.0 / (spans * spans)) * (left - 2.0 * middle + right),
        np.stack(inside, axis=1),
    )


def timing_problem(
    rows: SplineRows,
    spans: FloatArray,
    heights: CellHeights,
    limits: CellLimits,
    start: tuple[float, float] | None,
) -> TimingProblem:
    """Return the problem.

    Args:
        rows: of the spline.
        spans: lengths of the cells in u. Shape (n,).
        heights: of the sliders.
        limits: of each cell.
        start: b and its slope if the motion goes on, or None if it begins at rest.
    """
    values = np.stack((rows.left, rows.right), axis=1)
    slopes = np.stack((rows.left_slope, rows.right_slope), axis=1)
    added = limits.added
    linear = np.empty((3, 7 + len(added.squared), len(spans)))
    jerks = np.empty((3, 4, 3, len(spans)))
    for side, (first, second, highest, lowest) in enumerate(zip(*heights)):
        half, value, slope = 0.5 * first, values[:, side, np.newaxis], slopes[:, side, np.newaxis]
        if side == 0:
            linear[:, 0] = _MIDDLE / limits.squared_speed
            linear[:, 1:4] = (slope * half + value * second) / limits.acceleration
            linear[:, 4:7] = -linear[:, 1:4]
            linear[:, 7:] = 0.5 * slope * added.acceleration + value * added.squared
        common = rows.bend[:, np.newaxis] * half + slope * (1.5 * second)
        jerks[:, side] = common + value * highest
        jerks[:, 2 + side] = -common - value * lowest
    jerks /= limits.jerk
    fixed = None if start is None else (start[0], start[0] + 0.5 * start[1] * float(spans[0]))
    return TimingProblem(spans, rows, linear, jerks.reshape(3, 12, -1), values, fixed)


def feasible_constant(heights: CellHeights, limits: CellLimits) -> float:
    """Return a b that, the same everywhere, keeps all limits."""
    with np.errstate(divide="ignore"):
        third = np.maximum(np.abs(heights.highest), np.abs(heights.lowest)).max(axis=0)
        return min(
            float(limits.squared_speed.min()),
            float((limits.acceleration / np.abs(heights.second)).min()),
            float((1.0 / np.abs(limits.added.squared)).min(initial=np.inf)),
            float(np.square(np.cbrt(limits.jerk / third)).min()),
        )


def divided(coefficients: FloatArray, rows: SplineRows, cells: BoolArray) -> FloatArray:
    """Return the coefficients of the same spline with some ``cells`` divided into two.

    Args:
        coefficients: Shape (n + 2,).
        rows: of the spline.
        cells: which. Shape (n,).
    """
    parts = coefficients[:-2], coefficients[1:-1], coefficients[2:]
    left = sum(row * values for row, values in zip(rows.left, parts))
    right = sum(row * values for row, values in zip(rows.right, parts))
    middle = coefficients[1:-1]
    before = np.where(cells, 0.5 * (left + middle), middle)
    after = (0.5 * (right + middle))[cells]
    inside = np.insert(before, np.flatnonzero(cells) + 1, after)
    return np.concatenate((coefficients[:1], inside, coefficients[-1:]))
