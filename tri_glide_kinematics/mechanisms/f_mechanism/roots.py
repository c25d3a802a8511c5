"""All real roots of trigonometric polynomials of degree three.

The circle is cut into cells of equal width. Bounds of the third and fourth derivative decide for
each cell whether it holds no root or exactly one; cells for which they prove neither are halved. A
polynomial that still has such a cell after many halvings, or that nearly touches zero between two
roots, is left to arithmetic without rounding.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.closure import (
    ROUNDING_ERROR,
    Cubic,
    derivative_bound,
    derivatives,
    evaluate,
)
from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import direction
from tri_glide_kinematics.vectors import FloatArray

Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Cells of a turn: values at the ends of each, and a bound of the bend, tell whether it holds roots.
CELLS = 64
CELL_WIDTH = 2.0 * math.pi / CELLS
NODES: FloatArray = -math.pi + CELL_WIDTH * np.arange(CELLS + 1, dtype=np.float64)
# Halvings of a cell in which bounds prove neither one root nor none.
_HALVINGS = 24

# Neighbouring roots closer than this [rad] may be one double root: if the polynomial exceeds its
# rounding error between them by no more than this factor.
_CLOSE = 1e-3
_TOUCHING = 1e3

# A Newton step may leave its bracket by rounding, which also decides the signs at a converged root.
_SLACK = 1e-13
# A bracketed Newton iteration ends with a step below this [rad], or after so many steps: beside a
# double root rounding alone moves it farther.
_CONVERGED = 1e-10
_STEPS = 60

# Products of so few rows stay below the size from which matrix libraries start threads: waking them
# costs more than such a product, and a control program has other uses for its processors.
_BLOCK = 128


def _sampling_table() -> FloatArray:
    """Matrix (7, 3 (CELLS + 1)): coefficients to values, first and second derivatives at NODES."""
    rows = np.zeros((7, 3, CELLS + 1))
    rows[0, 0] = 1.0
    for order in (1, 2, 3):
        cosine, sine = np.cos(order * NODES), np.sin(order * NODES)
        rows[2 * order - 1] = cosine, -order * sine, -(order**2) * cosine
        rows[2 * order] = -sine, -order * cosine, order**2 * sine
    # The first and the last node are one place: rounding must not tell a sign between them.
    rows[:, :, -1] = rows[:, :, 0]
    return rows.reshape(7, -1)


_TABLE = _sampling_table()


def _sample(polynomial: Cubic) -> FloatArray:
    """Values, slopes and curvatures at NODES of one polynomial, or of n: (..., 3, CELLS + 1)."""
    constant = np.asarray(polynomial.constant)
    coefficients = np.empty((*constant.shape, 7))
    coefficients[..., 0] = constant
    for order in (1, 2, 3):
        coefficients[..., 2 * order - 1] = polynomial[order].real
        coefficients[..., 2 * order] = polynomial[order].imag
    rows = coefficients.reshape(-1, 7)
    samples = np.empty((len(rows), _TABLE.shape[1]))
    for first in range(0, len(rows), _BLOCK):
        block = slice(first, first + _BLOCK)
        np.matmul(rows[block], _TABLE, out=samples[block])
    return samples.reshape((*constant.shape, 3, CELLS + 1))


def _possible_cells(polynomial: Cubic, samples: FloatArray, tolerance: FloatArray | float) -> Mask:
    """Cells between NODES that may hold a root, shape (..., CELLS).

    The chord of a function deviates from it by at most max|f''| width^2 / 8: end values of one
    sign that are both farther from zero exclude a root.
    """
    value, curvature = samples[..., 0, :], np.abs(samples[..., 2, :])
    fourth = np.asarray(derivative_bound(polynomial, 4))[..., np.newaxis]
    bend = CELL_WIDTH**2 / 8.0
    steepest = np.maximum(curvature[..., :-1], curvature[..., 1:]) + bend * fourth
    bound = bend * steepest + np.asarray(tolerance)[..., np.newaxis]
    low, high = value[..., :-1], value[..., 1:]
    possible: Mask = (np.minimum(low, high) <= bound) & (np.maximum(low, high) >= -bound)
    return possible


# Real roots of one polynomial, as plain numbers: a fifth of the time of arrays with one row.


class _Sample(NamedTuple):
    angle: float
    value: float
    slope: float
    curvature: float


class _Bounds(NamedTuple):
    """Upper bounds of the third and fourth derivative, and the rounding error."""

    third: float
    fourth: float
    tolerance: float


def real_roots(polynomial: Cubic, tolerance: float) -> list[float] | None:
    """All real roots in [-pi, pi], ascending [rad]; None where rounding could decide their number.

    Args:
        polynomial: coefficients as plain numbers; not identically zero.
        tolerance: rounding error of the polynomial.
    """
    samples = _sample(polynomial)
    third, fourth = derivative_bound(polynomial, 3), derivative_bound(polynomial, 4)
    bounds = _Bounds(float(third), float(fourth), tolerance)
    cells = np.flatnonzero(_possible_cells(polynomial, samples, tolerance))
    ends = zip(*(samples[:, cells + side].T.tolist() for side in (0, 1)))
    roots: list[float] = []
    for angle, (start, end) in zip(NODES[cells].tolist(), ends):
        low, high = _Sample(angle, *start), _Sample(angle + CELL_WIDTH, *end)
        found = _isolate(polynomial, low, high, bounds, _HALVINGS)
        if found is None:
            return None
        roots += found
    for left, right in zip(roots, [*roots[1:], *(root + 2.0 * math.pi for root in roots[:1])]):
        if right - left < _CLOSE:
            value, _, _ = evaluate(polynomial, 0.5 * (left + right))
            if abs(value) <= _TOUCHING * tolerance:
                return None
    return roots


def _isolate(
    polynomial: Cubic, low: _Sample, high: _Sample, bounds: _Bounds, halvings: int
) -> list[float] | None:
    """Roots between two samples, judged as in ``_judge``; None if halving does not part them."""
    width = high.angle - low.angle
    bend = width * width / 8.0
    curvature_bound = bend * bounds.fourth
    positive, rising = high.value >= 0.0, high.slope >= 0.0
    change = (low.value >= 0.0) != positive
    if not change:
        steepest = max(abs(low.curvature), abs(high.curvature)) + curvature_bound
        if min(abs(low.value), abs(high.value)) > bend * steepest + bounds.tolerance:
            return []
    if (
        min(low.slope, high.slope) > bend * bounds.third
        or max(low.slope, high.slope) < -bend * bounds.third
        or min(low.curvature, high.curvature) > curvature_bound
        or max(low.curvature, high.curvature) < -curvature_bound
    ):
        if change:
            return [_newton(polynomial, low, high)]
        if (low.slope >= 0.0) == rising or rising != positive:
            return []
    if not halvings:
        return None
    angle = 0.5 * (low.angle + high.angle)
    middle = _Sample(angle, *evaluate(polynomial, angle))
    first = _isolate(polynomial, low, middle, bounds, halvings - 1)
    second = _isolate(polynomial, middle, high, bounds, halvings - 1)
    return None if first is None or second is None else first + second


def _newton(polynomial: Cubic, low: _Sample, high: _Sample) -> float:
    """Root between two samples, of which exactly one is known to be there."""
    left, right, positive = low.angle, high.angle, low.value >= 0.0
    angle = left + (right - left) * low.value / (low.value - high.value)
    for _ in range(_STEPS):
        value, slope, curvature = evaluate(polynomial, angle)
        if (value >= 0.0) == positive:
            left = angle
        else:
            right = angle
        step = -value / slope if slope else math.inf
        if not left - _SLACK <= angle + step <= right + _SLACK:
            angle = 0.5 * (left + right)
            continue
        angle += step
        if step * step * abs(curvature) <= 1e-16 * abs(slope):
            break
    return angle


# Real roots of many polynomials at once, on flat arrays with one entry a root.


def simple_roots(
    polynomial: Cubic, tolerance: FloatArray, special: Mask
) -> tuple[Index, FloatArray]:
    """Rows and angles [rad] of the roots of all rows but ``special`` ones, ascending.

    Rows in which rounding could decide the number of roots become special.
    """
    row, angle = _isolated_roots(polynomial, tolerance, special)
    order = row_order(row, angle)
    row, angle = row[order], angle[order]
    close = np.flatnonzero((row[1:] == row[:-1]) & (angle[1:] - angle[:-1] < _CLOSE))
    between = direction(0.5 * (angle[close] + angle[close + 1]))
    row_of_pair = row[close]
    value = derivatives(_rows(polynomial, row_of_pair), between)[0]
    special[row_of_pair[abs(value) <= _TOUCHING * tolerance[row_of_pair]]] = True
    # The first and the last root of a row may be neighbours across pi.
    lowest, highest = row[angle < _CLOSE - np.pi], row[angle > np.pi - _CLOSE]
    special[np.intersect1d(lowest, highest)] = True
    return row, angle


def row_roots(polynomial: Cubic) -> tuple[Index, FloatArray]:
    """Simple roots of many polynomials: their rows, ascending, and their angles [rad].

    Rows with a root that is double, or nearly so, are left out.
    """
    tolerance = ROUNDING_ERROR * sum(abs(coefficient) for coefficient in polynomial)
    special = np.zeros(len(tolerance), dtype=np.bool_)
    row, angle = simple_roots(polynomial, tolerance, special)
    simple = ~special[row]
    return row[simple], angle[simple]


def row_order(row: Index, angle: FloatArray) -> Index:
    """Order by row, then by angle."""
    return np.argsort(angle + 8.0 * row)


def _rows(polynomial: Cubic, row: Index) -> Cubic:
    return Cubic(*(coefficients[row] for coefficients in polynomial))


def _isolated_roots(
    polynomial: Cubic, tolerance: FloatArray, special: Mask
) -> tuple[Index, FloatArray]:
    """All roots, with their rows; rows in which halving does not part them become ``special``."""
    samples = _sample(polynomial)
    possible = _possible_cells(polynomial, samples, tolerance) & ~special[:, np.newaxis]
    row, cell = np.nonzero(possible)
    low, width = NODES[cell], CELL_WIDTH
    start, end = (np.ascontiguousarray(samples[row, :, cell + side].T) for side in (0, 1))
    found = []
    for halving in range(_HALVINGS + 1):
        if halving:
            width *= 0.5
            middle = np.array(derivatives(_rows(polynomial, row), direction(low + width)))
            row, low = np.concatenate([row, row]), np.concatenate([low, low + width])
            start, end = np.hstack([start, middle]), np.hstack([middle, end])
        single, unclear = _judge(_rows(polynomial, row), start, end, width, tolerance[row])
        ends = start[0, single], end[0, single]
        found.append((row[single], low[single], low[single] + width, *ends))
        row, low, start, end = row[unclear], low[unclear], start[:, unclear], end[:, unclear]
        if not row.size:
            break
    special[row] = True
    row, left, right, before, after = (np.concatenate(parts) for parts in zip(*found))
    return row, _newton_in_brackets(_rows(polynomial, row), left, right, before, after)


def _judge(
    polynomial: Cubic, start: FloatArray, end: FloatArray, width: float, tolerance: FloatArray
) -> tuple[Mask, Mask]:
    """Whether intervals are proven to hold exactly one root, and whether they are to be halved.

    As in ``_possible_cells``, the chord bound excludes a zero in between: for the polynomial a
    root, for its derivatives that it is not monotone, or not convex.

    Args:
        polynomial: that of each interval.
        start: value, slope and curvature at the lower ends. Shape (3, m).
        end: likewise at the upper ends.
        width: of all intervals [rad].
        tolerance: rounding errors of the polynomials.
    """
    third, fourth = derivative_bound(polynomial, 3), derivative_bound(polynomial, 4)
    bend = width * width / 8.0
    low_positive, low_rising, _ = start >= 0.0
    positive, rising, _ = end >= 0.0
    change = positive != low_positive
    smallest, steepest = np.minimum(abs(start), abs(end)), np.maximum(abs(start), abs(end))
    possible = change | (smallest[0] <= bend * (steepest[2] + bend * fourth) + tolerance)
    least, most = np.minimum(start, end), np.maximum(start, end)
    slope_bound, curvature_bound = bend * third, bend * fourth
    sure = (least[1] > slope_bound) | (most[1] < -slope_bound)
    sure |= (least[2] > curvature_bound) | (most[2] < -curvature_bound)
    # Convex intervals without a turn are monotone; those that bend away from zero have no root.
    dip = (rising != low_rising) & (rising == positive)
    return change & sure, possible & ~(sure & (change | ~dip))


def _newton_in_brackets(
    polynomial: Cubic, left: FloatArray, right: FloatArray, before: FloatArray, after: FloatArray
) -> FloatArray:
    """Roots of polynomials, each between two places with the values ``before`` and ``after`` it."""
    positive = before >= 0.0
    angles = left + (right - left) * before / (before - after)
    moving = np.arange(len(angles))
    for _ in range(_STEPS):
        angle = angles[moving]
        value, slope, _ = derivatives(polynomial, direction(angle))
        is_before = (value >= 0.0) == positive
        left, right = np.where(is_before, angle, left), np.where(is_before, right, angle)
        with np.errstate(divide="ignore", invalid="ignore"):
            following = angle - value / slope
        kept = (following >= left - _SLACK) & (following <= right + _SLACK)
        following = np.where(kept, following, 0.5 * (left + right))
        angles[moving] = following
        going = (abs(following - angle) > _CONVERGED) & (right - left > _CONVERGED)
        if not going.any():
            break
        moving, positive = moving[going], positive[going]
        left, right = left[going], right[going]
        polynomial = _rows(polynomial, np.flatnonzero(going))
    return angles
