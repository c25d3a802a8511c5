"""Closure of an F-mechanism as a trigonometric polynomial of the platform angle, and its roots.

With the unit number z = exp(i phi), the rod vector
v = A2 - A1, the platform vectors d_b = B2 - A2, d_c = C2 - A2 (platform frame) and the crank pin
vectors e_b = B1 - A1, e_c = C1 - A1, the three rod equations of source 001, equation (2), read

    |v| = l_a,    |v + w_b| = l_b,    |v + w_c| = l_c,    w_k = z d_k - e_k.

Their differences are linear in v. The polynomial has degree three.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import (
    CrankPins,
    Linkage,
    Number,
    direction,
)
from tri_glide_kinematics.vectors import FloatArray

Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Linear(NamedTuple):
    """Trigonometric polynomial ``constant + Re(first * z)``."""

    constant: Number
    first: Number

    def at(self, z: Number) -> Number:
        """Value at the unit number ``z``."""
        return self.constant + (self.first * z).real


class Cubic(NamedTuple):
    """Trigonometric polynomial ``constant + Re(first z + second z^2 + third z^3)``."""

    constant: Number
    first: Number
    second: Number
    third: Number


def derivative_bound(polynomial: Cubic, order: int) -> FloatArray:
    """Upper bound of the derivative of the given order over the whole circle."""
    first, second, third = abs(polynomial[1]), abs(polynomial[2]), abs(polynomial[3])
    return first + 2.0**order * second + 3.0**order * third


def derivatives(polynomial: Cubic, z: Number) -> tuple[Number, Number, Number]:
    """Value, first and second derivative at the unit number ``z``."""
    square = z * z
    first = polynomial[1] * z
    second = polynomial[2] * square
    third = polynomial[3] * (square * z)
    return (
        polynomial[0] + (first + second + third).real,
        -(first + 2.0 * second + 3.0 * third).imag,
        -(first + 4.0 * second + 9.0 * third).real,
    )


# Rounding of the closure polynomial, relative to ``Closure.scale``.
ROUNDING_ERROR = 8.0 * float(np.finfo(np.float64).eps)


# Rounding of F above this part of the terms that F has in positions makes F noise there.
_NOISE = 3e-6


class Closure(NamedTuple):
    """The closure condition at one crank angle, or at many, of lengths times ``Linkage.unit``.

    Attributes:
        polynomial: F, whose real roots are the platform angles.
        noisy: whether rounding leaves too little of F where positions may be.
        scale: size to which rounding errors of F refer: they are below ROUNDING_ERROR * scale.
        product_b: m_b = (l_b^2 - l_a^2 - |w_b|^2) / 2, the scalar product v . w_b.
        product_c: m_c, likewise.
        determinant: D = w_b x w_c, determinant of the linear system for v.
    """

    polynomial: Cubic
    scale: Number
    noisy: Number
    product_b: Linear
    product_c: Linear
    determinant: Linear


def closure(linkage: Linkage, pins: CrankPins) -> Closure:
    """Closure condition F(phi) = |m_b w_c - m_c w_b|^2 - l_a^2 D^2 of the given crank pins.

    F is the first rod equation with v = -i (m_b w_c - m_c w_b) / D inserted, multiplied by D^2
    (source 001, section 3, without its half-angle tangent). With |w_k|^2 = s_k - 2 m_k and the
    constants s_k = l_k^2 - l_a^2 it becomes

        F = s_c m_b^2 + s_b m_c^2 - l_a^2 D^2 - 2 m_b m_c (m_b + m_c + w_b . w_c).

    m_b, m_c, D and w_b . w_c all have degree one in phi, so F has degree three and no root at
    infinity.
    """
    unit = linkage.unit
    d_b, d_c = unit * linkage.platform_b, unit * linkage.platform_c
    rod_a, rod_b, rod_c = (unit * rod for rod in linkage.rods)
    square_a, square_b, square_c = rod_a * rod_a, rod_b * rod_b, rod_c * rod_c
    s_b, s_c = square_b - square_a, square_c - square_a
    e_b, e_c = unit * (pins.b - pins.a), unit * (pins.c - pins.a)
    bar_b, bar_c = e_b.conjugate(), e_c.conjugate()

    b0 = 0.5 * (s_b - abs(d_b) ** 2 - (e_b * bar_b).real)
    c0 = 0.5 * (s_c - abs(d_c) ** 2 - (e_c * bar_c).real)
    b1, c1 = d_b * bar_b, d_c * bar_c
    constant = d_b.conjugate() * d_c + bar_b * e_c
    cross_bc, cross_cb = d_b * bar_c, d_c * bar_b
    t0, t1 = b0 + c0 + constant.real, b1 + c1 - cross_bc - cross_cb
    d0, d1 = constant.imag, 1j * (cross_cb - cross_bc)

    # Re(p z) Re(q z) = Re(p conj(q)) / 2 + Re(p q z^2) / 2, and so on for higher powers.
    p0 = b0 * c0 + 0.5 * (b1 * c1.conjugate()).real
    p1 = b0 * c1 + c0 * b1
    p2 = 0.5 * b1 * c1
    half = 0.5 * t1
    polynomial = Cubic(
        s_c * (b0 * b0 + 0.5 * (b1 * b1.conjugate()).real)
        + s_b * (c0 * c0 + 0.5 * (c1 * c1.conjugate()).real)
        - square_a * (d0 * d0 + 0.5 * (d1 * d1.conjugate()).real)
        - 2.0 * (p0 * t0 + (p1 * half.conjugate()).real),
        2.0 * (s_c * b0 * b1 + s_b * c0 * c1 - square_a * d0 * d1)
        - 2.0 * (p0 * t1 + p1 * t0 + p2 * half.conjugate()),
        0.5 * (s_c * b1 * b1 + s_b * c1 * c1 - square_a * d1 * d1) - 2.0 * (p2 * t0 + p1 * half),
        -2.0 * p2 * half,
    )
    reach_b, reach_c = abs(b0) + abs(b1), abs(c0) + abs(c1)
    reach_d, reach_t = abs(d0) + abs(d1), abs(t0) + abs(t1)
    # Each factor is known to rounding of size^2 only, even where it nearly vanishes.
    scale = (unit * linkage.size) ** 2 * (
        reach_b * (reach_b + abs(s_c) + reach_t)
        + reach_c * (reach_c + abs(s_b) + reach_t)
        + reach_b * reach_c
        + square_a * reach_d
    )
    # In positions |m_k| <= l_a |w_k| and |w_k| <= l_a + l_k.
    terms = (rod_a * (rod_a + rod_b) * (rod_a + rod_c)) ** 2
    noisy = ROUNDING_ERROR * scale > _NOISE * terms
    return Closure(polynomial, scale, noisy, Linear(b0, b1), Linear(c0, c1), Linear(d0, d1))


# All real roots of trigonometric polynomials of degree three.
#
# The circle is cut into cells of equal width. Bounds of the third and fourth derivative decide for
# each cell whether it holds no root or exactly one; cells for which they prove neither are halved.
# A polynomial that still has such a cell after many halvings, or that nearly touches zero between
# two roots, is left to arithmetic without rounding.

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
    return (np.minimum(low, high) <= bound) & (np.maximum(low, high) >= -bound)


# Roots of z^3 F nearer to the unit circle than this may be real roots of F.
_NEAR_CIRCLE = 1e-3
# Companion matrix of z^6: those of other polynomials differ in the first row.
_COMPANION = np.diag(np.ones(5, dtype=np.complex128), -1)


def real_roots(polynomial: Cubic, tolerance: float) -> list[float] | None:
    """All real roots in [-pi, pi], ascending [rad]; None where rounding could decide their number.

    z^3 F is a polynomial of z, and they are its roots on the unit circle, eigenvalues of its
    companion matrix. Between two of them F has to keep clear of zero, each time on the other side.
    So it has to in the direction of each root beside the circle: on the part of the circle to which
    this root is the nearest, abs(F) is at least 3^-5 of its value there, as no other root is more
    than three times as far from there.

    Args:
        polynomial: coefficients as plain numbers; not identically zero.
        tolerance: rounding error of the polynomial.
    """
    upper = [0.5 * number for number in polynomial[:0:-1]]
    while upper and abs(upper[0]) <= tolerance:
        del upper[0]
    if not upper:
        return []
    powers = [*upper, polynomial[0], *[number.conjugate() for number in upper[::-1]]]
    companion = _COMPANION[: len(powers) - 1, : len(powers) - 1].copy()
    factor = -1.0 / powers[0]
    companion[0] = [factor * power for power in powers[1:]]
    roots, beside = [], []
    for z in np.linalg.eigvals(companion).tolist():
        size = abs(z)
        if abs(size - 1.0) < _NEAR_CIRCLE:
            # A step of Newton's method, as eigenvalues beside each other have a larger error.
            value, slope, _ = derivatives(polynomial, z / size)
            step = value / slope if slope else 0.0
            roots.append(math.remainder(cmath.phase(z) - step, math.tau))
        elif size > 1.0:
            # The roots beside the circle are pairs in one direction, inside and outside.
            beside.append(_value(polynomial, z / size))
    roots.sort()
    ends = [*roots[1:], *(root + math.tau for root in roots[:1])]
    middles = (cmath.rect(1.0, 0.5 * (left + right)) for left, right in zip(roots, ends))
    between = [_value(polynomial, middle) for middle in middles]
    if min(map(abs, between + beside), default=math.inf) <= _TOUCHING * tolerance:
        return None
    signs = [value > 0.0 for value in between]
    return roots if signs == [not sign for sign in signs[1:] + signs[:1]] else None


def _value(polynomial: Cubic, z: complex) -> float:
    """Value at the unit number ``z``."""
    constant, first, second, third = polynomial
    value: float = constant + (z * (first + z * (second + z * third))).real
    return value


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
        # Where F nearly vanishes on a stretch, halving makes ever more of them.
        special |= np.bincount(row[unclear], minlength=len(special)) > CELLS
        unclear &= ~special[row]
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
