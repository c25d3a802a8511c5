"""All real roots of trigonometric polynomials of degree three.

The circle is cut into cells of equal width. Bounds of the second and third derivative decide for
each cell whether it holds no root, exactly one, or must be looked at closely. Those that must are
halved until the polynomial is monotone or convex in each part. In a convex part the sign of the
polynomial at its extremum tells two roots from none, and an extremum that is zero to rounding is
one double root.
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

Mask = NDArray[np.bool_]

# Cells of a turn: values at the ends of each, and a bound of the bend, tell whether it holds roots.
CELLS = 64
CELL_WIDTH = 2.0 * math.pi / CELLS
_BEND = CELL_WIDTH**2 / 8.0
NODES: FloatArray = -math.pi + CELL_WIDTH * np.arange(CELLS + 1, dtype=np.float64)

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


class Ends(NamedTuple):
    """Value, slope and curvature of a polynomial at one end of many intervals."""

    value: FloatArray
    slope: FloatArray
    curvature: FloatArray


class Verdict(NamedTuple):
    """Proofs about intervals, from samples at both ends.

    Attributes:
        single: exactly one root.
        dip: convex toward zero about an extremum: two roots, one double root or none.
        unclear: to be halved.
    """

    single: Mask
    dip: Mask
    unclear: Mask


def sample(polynomial: Cubic) -> Ends:
    """Sample one polynomial, or one for each of n rows, at NODES: shape (..., CELLS + 1)."""
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
    samples = samples.reshape((*constant.shape, 3, CELLS + 1))
    return Ends(samples[..., 0, :], samples[..., 1, :], samples[..., 2, :])


def possible_cells(polynomial: Cubic, samples: Ends, tolerance: FloatArray | float) -> Mask:
    """Cells between NODES that may hold a root, shape (..., CELLS).

    The chord of a function deviates from it by at most max|f''| width^2 / 8: end values of one
    sign that are both farther from zero exclude a root.
    """
    value, curvature = samples.value, np.abs(samples.curvature)
    fourth = np.asarray(derivative_bound(polynomial, 4))[..., np.newaxis]
    steepest = np.maximum(curvature[..., :-1], curvature[..., 1:]) + _BEND * fourth
    bound = _BEND * steepest + np.asarray(tolerance)[..., np.newaxis]
    low, high = value[..., :-1], value[..., 1:]
    possible: Mask = (np.minimum(low, high) <= bound) & (np.maximum(low, high) >= -bound)
    return possible


def judge(
    low: Ends,
    high: Ends,
    width: float,
    third: FloatArray,
    fourth: FloatArray,
    tolerance: FloatArray,
) -> Verdict:
    """Judge intervals of one ``width`` by the samples at their ends.

    As in ``possible_cells``, the chord bound excludes a zero in between: for the polynomial a
    root, for its derivatives that it is not monotone, or not convex.

    Args:
        low: samples at the lower ends.
        high: samples at the upper ends.
        width: width of all intervals [rad].
        third: upper bounds of the third derivative.
        fourth: upper bounds of the fourth derivative.
        tolerance: rounding errors of the polynomials.
    """
    bend = width * width / 8.0
    curvature_bound = bend * fourth
    positive, rising = high.value >= 0.0, high.slope >= 0.0
    change = positive != (low.value >= 0.0)
    turning = rising != (low.slope >= 0.0)
    steepest = np.maximum(np.abs(low.curvature), np.abs(high.curvature)) + curvature_bound
    nearest = np.minimum(np.abs(low.value), np.abs(high.value))
    possible = change | (nearest <= bend * steepest + tolerance)
    sure = _beyond(low.slope, high.slope, bend * third) | _beyond(
        low.curvature, high.curvature, curvature_bound
    )
    # Convex intervals without a turn are monotone; those that bend away from zero have no root.
    dip = possible & sure & ~change & turning & (rising == positive)
    return Verdict(change & sure, dip, possible & ~sure)


def _beyond(low: FloatArray, high: FloatArray, bound: FloatArray) -> Mask:
    """Whether both lie on the same side of zero and farther from it than ``bound``."""
    beyond: Mask = (np.minimum(low, high) > bound) | (np.maximum(low, high) < -bound)
    return beyond


# Real roots of one polynomial.

# A cell this narrow is not halved again: within it a triple root cannot be told from a simple one.
_NARROWEST = 1e-5
# Roots closer than this are looked at as the possible halves of one double root.
_CLUSTER_WIDTH = 1e-3
# A Newton step may leave its bracket by rounding, which also decides the signs at a converged root.
SLACK = 1e-13


class Root(NamedTuple):
    """A real root ``angle`` [rad]; ``double`` where the polynomial touches zero to rounding."""

    angle: float
    double: bool


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


def real_roots(polynomial: Cubic, tolerance: float) -> list[Root]:
    """All real roots in [-pi, pi], ascending.

    Args:
        polynomial: coefficients as plain numbers; not identically zero.
        tolerance: rounding error of the polynomial. Roots between which it does not exceed this
            are one double root.
    """
    samples = sample(polynomial)
    value, slope, curvature = samples
    third, fourth = derivative_bound(polynomial, 3), derivative_bound(polynomial, 4)
    bounds = _Bounds(float(third), float(fourth), tolerance)
    roots: list[Root] = []
    for index in np.flatnonzero(possible_cells(polynomial, samples, tolerance)).tolist():
        after = index + 1
        low = _Sample(
            float(NODES[index]), float(value[index]), float(slope[index]), float(curvature[index])
        )
        high = _Sample(
            float(NODES[after]), float(value[after]), float(slope[after]), float(curvature[after])
        )
        roots += _isolate(polynomial, low, high, bounds)
    if len(roots) > 1:
        return _merge_touching(polynomial, roots, tolerance)
    return roots


def _newton(polynomial: Cubic, low: _Sample, high: float, start: float) -> float:
    """Root between ``low`` and ``high``, of which exactly one is known to be there."""
    left, right, angle = low.angle, high, start
    positive = low.value >= 0.0
    for _ in range(60):
        value, slope, curvature = evaluate(polynomial, angle)
        if (value >= 0.0) == positive:
            left = angle
        else:
            right = angle
        step = -value / slope if slope else math.inf
        if not left - SLACK <= angle + step <= right + SLACK:
            angle = 0.5 * (left + right)
            continue
        angle += step
        if step * step * abs(curvature) <= 1e-16 * abs(slope):
            break
    return angle


def _extremum(polynomial: Cubic, low: _Sample, high: _Sample) -> float:
    """Zero of the derivative between two samples where it is monotone and changes its sign."""
    left, right = low.angle, high.angle
    angle = left + (right - left) * low.slope / (low.slope - high.slope)
    for _ in range(60):
        _, slope, curvature = evaluate(polynomial, angle)
        if (slope >= 0.0) == (low.slope >= 0.0):
            left = angle
        else:
            right = angle
        following = angle - slope / curvature if curvature else math.inf
        if not left - SLACK <= following <= right + SLACK:
            following = 0.5 * (left + right)
        if abs(following - angle) < 1e-12:
            return following
        angle = following
    return angle


def _isolate(polynomial: Cubic, low: _Sample, high: _Sample, bounds: _Bounds) -> list[Root]:
    """Roots between two samples, halving until each part is monotone or convex.

    The judgement is that of ``judge``, where its bounds are explained.
    """
    width = high.angle - low.angle
    bend = width * width / 8.0
    curvature_bound = bend * bounds.fourth
    change = (low.value >= 0.0) != (high.value >= 0.0)
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
            start = low.angle + width * low.value / (low.value - high.value)
            return [Root(_newton(polynomial, low, high.angle, start), False)]
        rising = high.slope >= 0.0
        if (low.slope >= 0.0) != rising and rising == (low.value >= 0.0):
            return _roots_beside_extremum(polynomial, low, high, bounds.tolerance)
        return []
    angle = 0.5 * (low.angle + high.angle)
    middle = _Sample(angle, *evaluate(polynomial, angle))
    if width < _NARROWEST:
        if change:
            return [Root(_newton(polynomial, low, high.angle, angle), False)]
        return [Root(angle, True)] if abs(middle.value) <= bounds.tolerance else []
    return _isolate(polynomial, low, middle, bounds) + _isolate(polynomial, middle, high, bounds)


def _roots_beside_extremum(
    polynomial: Cubic, low: _Sample, high: _Sample, tolerance: float
) -> list[Root]:
    """Two, one double or no root about the one extremum in a convex part."""
    angle = _extremum(polynomial, low, high)
    value, _, curvature = evaluate(polynomial, angle)
    if abs(value) <= tolerance:
        return [Root(angle, True)]
    if (value >= 0.0) == (low.value >= 0.0):
        return []
    reach = math.sqrt(max(-2.0 * value / curvature, 0.0)) if curvature else 0.0
    extremum = _Sample(angle, value, 0.0, curvature)
    return [
        Root(_newton(polynomial, low, angle, max(low.angle, angle - reach)), False),
        Root(_newton(polynomial, extremum, high.angle, min(high.angle, angle + reach)), False),
    ]


def _merge_touching(polynomial: Cubic, roots: list[Root], tolerance: float) -> list[Root]:
    """Replace neighbours between which the polynomial is zero to rounding by one double root."""
    roots = sorted(roots)
    clusters = [[roots[0]]]
    for root in roots[1:]:
        if _touches(polynomial, clusters[-1][-1].angle, root.angle, tolerance):
            clusters[-1].append(root)
        else:
            clusters.append([root])
    wrapped = roots[0].angle + 2.0 * math.pi
    if len(clusters) > 1 and _touches(polynomial, clusters[-1][-1].angle, wrapped, tolerance):
        tail = [Root(root.angle - 2.0 * math.pi, root.double) for root in clusters.pop()]
        clusters[0] = tail + clusters[0]
    merged = []
    for cluster in clusters:
        if len(cluster) == 1:
            merged.append(cluster[0])
        else:
            angle = 0.5 * (cluster[0].angle + cluster[-1].angle)
            merged.append(Root(math.remainder(angle, 2.0 * math.pi), True))
    return sorted(merged)


def _touches(polynomial: Cubic, left: float, right: float, tolerance: float) -> bool:
    if right - left > _CLUSTER_WIDTH:
        return False
    return abs(evaluate(polynomial, 0.5 * (left + right))[0]) <= tolerance


# Real roots of many polynomials at once, on flat arrays with one entry a root.

Index = NDArray[np.int64]

# Halvings of unclear cells before a row is solved by itself.
_HALVINGS = 12
# Neighbouring roots closer than this [rad] may be one double root: if the polynomial exceeds its
# rounding error between them by no more than this factor.
_CLOSE = 1e-3
_TOUCHING = 1e3
# A bracketed Newton iteration ends with a step below this [rad], or after so many rounds: beside a
# double root rounding alone moves it farther, and the row is solved by itself.
_CONVERGED = 1e-10
_ROUNDS = 20


class _Spans(NamedTuple):
    """Intervals of the platform angle, each in one row of the batch."""

    row: Index
    low: FloatArray
    start: Ends
    end: Ends

    def where(self, mask: Mask) -> _Spans:
        start, end = (Ends(*(part[mask] for part in ends)) for ends in (self.start, self.end))
        return _Spans(self.row[mask], self.low[mask], start, end)


class _Brackets(NamedTuple):
    """Intervals with exactly one zero each, and a first guess of it."""

    row: Index
    low: FloatArray
    high: FloatArray
    positive: Mask
    guess: FloatArray


class Roots(NamedTuple):
    """Roots in flat arrays: the ``row`` of each, and its ``angle`` [rad]."""

    row: Index
    angle: FloatArray


def simple_roots(polynomial: Cubic, tolerance: FloatArray, special: Mask) -> Roots:
    """Roots of the rows that are not ``special``; rows with a double root become it."""
    brackets = _isolate_rows(polynomial, tolerance, special)
    row = np.concatenate([part.row for part in brackets])
    merged = _Brackets(row, *(np.concatenate(parts) for parts in list(zip(*brackets))[1:]))
    angle = _bracketed_newton(_rows(polynomial, row), 0, merged)
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
    return Roots(row, angle)


def row_roots(polynomial: Cubic) -> tuple[Index, FloatArray]:
    """Simple roots of many polynomials: their rows, ascending, and their angles [rad].

    Rows with a double root are missing.
    """
    tolerance = ROUNDING_ERROR * sum(abs(coefficient) for coefficient in polynomial)
    special = np.zeros(len(tolerance), dtype=np.bool_)
    roots = simple_roots(polynomial, tolerance, special)
    simple = ~special[roots.row]
    return roots.row[simple], roots.angle[simple]


def row_order(row: Index, angle: FloatArray) -> Index:
    """Order by row, then by angle."""
    return np.argsort(angle + 8.0 * row)


def _rows(polynomial: Cubic, row: Index) -> Cubic:
    return Cubic(*(coefficients[row] for coefficients in polynomial))


def _isolate_rows(polynomial: Cubic, tolerance: FloatArray, special: Mask) -> list[_Brackets]:
    """Brackets of all roots; rows that need a closer look become ``special``."""
    samples = sample(polynomial)
    possible = possible_cells(polynomial, samples, tolerance) & ~special[:, np.newaxis]
    row, cell = np.nonzero(possible)
    start, end = (Ends(*(part[row, cell + k] for part in samples)) for k in (0, 1))
    spans = _Spans(row, NODES[cell], start, end)
    width = CELL_WIDTH
    brackets = []
    for halving in range(_HALVINGS + 1):
        if halving:
            width *= 0.5
            spans = _halve(polynomial, spans, width)
        of_row = _rows(polynomial, spans.row)
        third, fourth = derivative_bound(of_row, 3), derivative_bound(of_row, 4)
        verdict = judge(spans.start, spans.end, width, third, fourth, tolerance[spans.row])
        brackets.append(_secant_brackets(spans.where(verdict.single), width))
        dips = spans.where(verdict.dip)
        brackets += _dip_brackets(polynomial, dips, width, tolerance, special)
        spans = spans.where(verdict.unclear)
        if not spans.row.size:
            break
    special[spans.row] = True
    return brackets


def _halve(polynomial: Cubic, spans: _Spans, width: float) -> _Spans:
    """Both halves of each span, now of the given ``width``."""
    middle = Ends(*derivatives(_rows(polynomial, spans.row), direction(spans.low + width)))
    start, end = (
        Ends(*(np.concatenate(pair) for pair in zip(*ends)))
        for ends in ((spans.start, middle), (middle, spans.end))
    )
    return _Spans(
        np.concatenate([spans.row, spans.row]),
        np.concatenate([spans.low, spans.low + width]),
        start,
        end,
    )


def _secant_brackets(spans: _Spans, width: float) -> _Brackets:
    low, high = spans.start.value, spans.end.value
    guess = spans.low + width * low / (low - high)
    return _Brackets(spans.row, spans.low, spans.low + width, low >= 0.0, guess)


def _dip_brackets(
    polynomial: Cubic, spans: _Spans, width: float, tolerance: FloatArray, special: Mask
) -> list[_Brackets]:
    """Brackets on both sides of the extremum where the polynomial passes through zero there."""
    row, low = spans.row, spans.low
    if not len(row):
        return []
    of_row = _rows(polynomial, row)
    slopes = spans.start.slope, spans.end.slope
    guess = low + width * slopes[0] / (slopes[0] - slopes[1])
    extremum = _bracketed_newton(
        of_row, 1, _Brackets(row, low, low + width, slopes[0] >= 0.0, guess)
    )
    value, _, curvature = derivatives(of_row, direction(extremum))
    special[row[abs(value) <= tolerance[row]]] = True
    positive = spans.start.value >= 0.0
    through = (value >= 0.0) != positive
    row, low, extremum, positive = row[through], low[through], extremum[through], positive[through]
    reach = np.sqrt(-2.0 * value[through] / curvature[through])
    high = low + width
    return [
        _Brackets(row, low, extremum, positive, np.maximum(low, extremum - reach)),
        _Brackets(row, extremum, high, ~positive, np.minimum(high, extremum + reach)),
    ]


def _bracketed_newton(
    polynomial: Cubic, order: int, brackets: _Brackets, rounds: int = _ROUNDS
) -> FloatArray:
    """Zeros of the derivative of the given order (0 or 1), one in each bracket.

    Each round of three iterations goes on with those only that still move.
    """
    row, left, right, positive, angle = brackets
    for _ in range(3):
        evaluated = derivatives(polynomial, direction(angle))
        value, slope = evaluated[order], evaluated[order + 1]
        before = (value >= 0.0) == positive
        left, right = np.where(before, angle, left), np.where(before, right, angle)
        with np.errstate(divide="ignore", invalid="ignore"):
            following = angle - value / slope
        kept = (following >= left - SLACK) & (following <= right + SLACK)
        following = np.where(kept, following, 0.5 * (left + right))
        moved = abs(following - angle)
        angle = following
    unfinished = np.flatnonzero((moved > _CONVERGED) & (right - left > _CONVERGED))
    if unfinished.size and rounds:
        rest = _Brackets(
            row[unfinished],
            left[unfinished],
            right[unfinished],
            positive[unfinished],
            angle[unfinished],
        )
        angle[unfinished] = _bracketed_newton(
            _rows(polynomial, unfinished), order, rest, rounds - 1
        )
    return angle
