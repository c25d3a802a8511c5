"""Real roots of many trigonometric polynomials at once, on flat arrays with one entry a root."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.solving.cells import (
    CELL_WIDTH,
    NODES,
    Ends,
    judge,
    possible_cells,
    sample,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.closure import ROUNDING
from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import direction
from tri_glide_kinematics.mechanisms.f_mechanism.solving.polynomial import (
    Cubic,
    derivative_bound,
    derivatives,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.roots import SLACK

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

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
    low: Array
    start: Ends
    end: Ends

    def where(self, mask: Mask) -> _Spans:
        start, end = (Ends(*(part[mask] for part in ends)) for ends in (self.start, self.end))
        return _Spans(self.row[mask], self.low[mask], start, end)


class _Brackets(NamedTuple):
    """Intervals with exactly one zero each, and a first guess of it."""

    row: Index
    low: Array
    high: Array
    positive: Mask
    guess: Array


class Roots(NamedTuple):
    """Roots in flat arrays: the ``row`` of each, and its ``angle`` [rad]."""

    row: Index
    angle: Array


def simple_roots(polynomial: Cubic, tolerance: Array, special: Mask) -> Roots:
    """Roots of the rows that are not ``special``; rows with a double root become it."""
    brackets = _isolate(polynomial, tolerance, special)
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


def row_roots(polynomial: Cubic) -> tuple[Index, Array]:
    """Simple roots of many polynomials: their rows, ascending, and their angles [rad].

    Rows with a double root are missing.
    """
    tolerance = ROUNDING * sum(abs(coefficient) for coefficient in polynomial)
    special = np.zeros(len(tolerance), dtype=np.bool_)
    roots = simple_roots(polynomial, tolerance, special)
    simple = ~special[roots.row]
    return roots.row[simple], roots.angle[simple]


def row_order(row: Index, angle: Array) -> Index:
    """Order by row, then by angle."""
    return np.argsort(angle + 8.0 * row)


def _rows(polynomial: Cubic, row: Index) -> Cubic:
    return Cubic(*(coefficients[row] for coefficients in polynomial))


def _isolate(polynomial: Cubic, tolerance: Array, special: Mask) -> list[_Brackets]:
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
    polynomial: Cubic, spans: _Spans, width: float, tolerance: Array, special: Mask
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
) -> Array:
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
