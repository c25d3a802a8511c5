r"""Extreme singular values of 3 x 3 matrices in closed form, and what they say around a place.

The eigenvalue formula of a symmetric 3 x 3 matrix (Smith, "Eigenvalues of a symmetric 3 x 3
matrix", Comm. ACM 4, 1961) is exact to rounding for the largest eigenvalue only, as all its terms
are then positive. So the smallest singular value is found as the inverse of the largest one of
the inverse matrix, whose columns are cross products of the rows.

Per metre of the platform the Jacobian changes by at most $K = \sqrt{\sum_i (L_i^2/s_i^3)^2}$ with
the rises $s_i$, and each singular value by no more than the Jacobian does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import acos, cos, sqrt
from typing import Any

import numpy as np

from tri_glide_kinematics.vectors import FloatArray, Vector3, cross, dot

Matrix3 = tuple[Vector3, Vector3, Vector3]

# A float, or an array of them.
Number = Any

Triple = tuple[Number, Number, Number]
Function = Callable[..., Number]

# Below this the eigenvalues are equal, and the angle between them has no meaning.
NO_SPREAD = 1e-100

# Of arrays: root, cosine, its inverse, the smaller and the larger of two.
OF_ARRAYS = (np.sqrt, np.cos, np.arccos, np.minimum, np.maximum)


def extreme_singular_values(matrix: Matrix3) -> tuple[float, float]:
    """Return the largest and the smallest singular value of ``matrix``, given by its rows.

    The smallest has the sign of the determinant.
    """
    row1, row2, row3 = matrix
    column1, column2, column3 = cross(row2, row3), cross(row3, row1), cross(row1, row2)
    determinant = dot(row1, column1)
    largest = _largest_singular_value(row1, row2, row3)
    if determinant == 0.0:
        return largest, 0.0
    return largest, determinant / _largest_singular_value(column1, column2, column3)


def extreme_singular_values_batch(
    matrices: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the same for many matrices.

    Args:
        matrices: row, column, number of the matrix. Shape (3, 3, n). A matrix with NaN gives NaN.

    Returns:
        Largest and smallest singular values, each of shape (n,).
    """
    row1, row2, row3 = matrices
    column1, column2, column3 = cross(row2, row3), cross(row3, row1), cross(row1, row2)
    largest = _largest_singular_value(row1, row2, row3, *OF_ARRAYS)
    return largest, dot(row1, column1) / _largest_singular_value(
        column1, column2, column3, *OF_ARRAYS
    )


def least_rises(
    lengths: FloatArray, distances: FloatArray, radius: float | FloatArray
) -> FloatArray:
    """Return the least rise of each arm around places; NaN where it does not reach.

    Args:
        lengths: of the arms. Shape (3, 1) or (3, n) [m].
        distances: horizontal length of each arm at the places. Shape (3, n) [m].
        radius: of what is around, one for all places or one for each [m].
    """
    farthest = distances + radius
    return np.asarray(np.sqrt((lengths - farthest) * (lengths + farthest)))


def jacobian_rows(
    across: FloatArray, lengths: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the Jacobian at many places; an arm that does not reach gives NaN or infinity.

    Args:
        across: from the platform to each anchor. Shape (3, 2, n) [m].
        lengths: of the arms. Shape (3, 1) or (3, n) [m].

    Returns:
        Horizontal length and rise of each arm, both of shape (3, n) [m], and the rows, of shape
        (3, 3, n).
    """
    distances = np.hypot(across[:, 0], across[:, 1])
    rises = least_rises(lengths, distances, 0.0)
    rows = np.ones((3, 3, across.shape[2]))
    np.divide(across, rises[:, np.newaxis], out=rows[:, :2])
    return distances, rises, rows


def ball_that_keeps(
    margin: Number,
    smallest: Number,
    max_condition: float,
    lengths: Iterable[float],
    distances: Iterable[Number],
    granted: float,
    smaller: Callable[[Number, Number], Number] = min,
    larger: Callable[[Number, Number], Number] = max,
) -> tuple[Number, Number]:
    """Return a radius in which the condition number is kept, and the slope of the Jacobian there.

    Args:
        margin: smallest singular value less the part of the largest that it has to be.
        smallest: singular value.
        max_condition: largest condition number.
        lengths: of the arms, three numbers [m].
        distances: horizontal length of each arm, three numbers or arrays [m].
        granted: as far beyond the edge a place may be [m].
        smaller: of two numbers; of two arrays ``np.minimum``.
        larger: likewise.

    Returns:
        Radius [m], and by how much the Jacobian changes in it per metre at most [1/m].
    """
    arms = list(zip(lengths, distances))
    first, second, third = [length - distance for length, distance in arms]
    # The slope of the margin is that of the Jacobian times the factor.
    factor = 1.0 + 1.0 / max_condition
    # A first guess of the radius, with some rise of every arm left, bounds the slope; that bounds
    # the radius.
    radius = larger(margin / (factor * _steepest(arms, 0.0)), granted)
    radius = smaller(radius, 0.5 * smaller(smaller(first, second), third))
    slope = _steepest(arms, radius)
    granted = smaller(granted, 0.5 * smallest / slope)
    return smaller(radius, larger(margin / (factor * slope), granted)), slope


def _steepest(arms: list[tuple[float, Number]], radius: Number) -> Number:
    """Return the largest slope of the Jacobian within ``radius`` [1/m]."""
    total = 0.0
    for length, distance in arms:
        farthest = distance + radius
        rise_squared = (length - farthest) * (length + farthest)
        total = total + length**4 / rise_squared**3
    return sqrt(total) if isinstance(total, float) else np.sqrt(total)


def _largest_singular_value(
    a: Triple,
    b: Triple,
    c: Triple,
    sqrt: Function = sqrt,
    cos: Function = cos,
    acos: Function = acos,
    smaller: Function = min,
    larger: Function = max,
) -> Number:
    """Return the largest singular value of the matrix with these rows (or columns)."""
    # Written out, as it runs for each sample of a path.
    (a1, a2, a3), (b1, b2, b3), (c1, c2, c3) = a, b, c
    ab = a1 * b1 + a2 * b2 + a3 * b3
    bc = b1 * c1 + b2 * c2 + b3 * c3
    ca = c1 * a1 + c2 * a2 + c3 * a3
    aa = a1 * a1 + a2 * a2 + a3 * a3
    bb = b1 * b1 + b2 * b2 + b3 * b3
    cc = c1 * c1 + c2 * c2 + c3 * c3
    mean = (aa + bb + cc) / 3.0
    aa, bb, cc = aa - mean, bb - mean, cc - mean
    off_diagonal = ab * ab + bc * bc + ca * ca
    spread = larger(sqrt((aa * aa + bb * bb + cc * cc + 2.0 * off_diagonal) / 6.0), NO_SPREAD)
    half_determinant = (
        aa * (bb * cc - bc * bc) - ab * (ab * cc - bc * ca) + ca * (ab * bc - bb * ca)
    ) / 2.0
    cosine = smaller(larger(half_determinant / (spread * spread * spread), -1.0), 1.0)
    return sqrt(mean + 2.0 * spread * cos(acos(cosine) / 3.0))
