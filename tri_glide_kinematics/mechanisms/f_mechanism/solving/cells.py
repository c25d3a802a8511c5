"""Cells that may hold roots of a trigonometric polynomial, by samples at their ends.

The circle is cut into cells of equal width. Bounds of the second and third derivative decide for
each cell whether it holds no root, exactly one, or must be looked at closely.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.solving.polynomial import Cubic, derivative_bound

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CELLS = 64
CELL_WIDTH = 2.0 * math.pi / CELLS
_BEND = CELL_WIDTH**2 / 8.0
NODES: Array = -math.pi + CELL_WIDTH * np.arange(CELLS + 1, dtype=np.float64)

# Products of so few rows stay below the size from which matrix libraries start threads: waking them
# costs more than such a product, and a control program has other uses for its processors.
_BLOCK = 128


def _sampling_table() -> Array:
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

    value: Array
    slope: Array
    curvature: Array


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


def possible_cells(polynomial: Cubic, samples: Ends, tolerance: Array | float) -> Mask:
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
    low: Ends, high: Ends, width: float, third: Array, fourth: Array, tolerance: Array
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


def _beyond(low: Array, high: Array, bound: Array) -> Mask:
    """Whether both lie on the same side of zero and farther from it than ``bound``."""
    beyond: Mask = (np.minimum(low, high) > bound) | (np.maximum(low, high) < -bound)
    return beyond
