"""Extreme singular values of 3 x 3 matrices in closed form.

The eigenvalue formula of a symmetric 3 x 3 matrix (Smith, "Eigenvalues of a symmetric 3 x 3
matrix", Comm. ACM 4, 1961) is exact to rounding for the largest eigenvalue only, as all its terms
are then positive. So the smallest singular value is found as the inverse of the largest one of
the inverse matrix, whose columns are cross products of the rows.
"""

from __future__ import annotations

from math import acos, cos, sqrt

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.vectors import Vector3, cross, dot

Matrix3 = tuple[Vector3, Vector3, Vector3]

# Below this the eigenvalues are equal, and the angle between them has no meaning.
NO_SPREAD = 1e-100


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
    matrices: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the same for many matrices.

    Args:
        matrices: row, column, number of the matrix. Shape (3, 3, n). A matrix with NaN gives NaN.

    Returns:
        Largest and smallest singular values, each of shape (n,).
    """
    count = matrices.shape[2]
    # The matrices and their cross products side by side, so that both are worked on at once.
    both = np.empty((3, 3, 2 * count))
    both[:, :, :count] = matrices
    following, preceding = matrices[[1, 2, 0]], matrices[[2, 0, 1]]
    columns = both[:, :, count:]
    np.multiply(following[:, [1, 2, 0]], preceding[:, [2, 0, 1]], out=columns)
    columns -= following[:, [2, 0, 1]] * preceding[:, [1, 2, 0]]
    determinant = np.einsum("jn,jn->n", matrices[0], columns[0])
    largest = _largest_batch(both)
    return largest[:count], determinant / largest[count:]


def _largest_singular_value(a: Vector3, b: Vector3, c: Vector3) -> float:
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
    spread = sqrt((aa * aa + bb * bb + cc * cc + 2.0 * off_diagonal) / 6.0)
    if spread <= NO_SPREAD:
        return sqrt(mean)
    half_determinant = (
        aa * (bb * cc - bc * bc) - ab * (ab * cc - bc * ca) + ca * (ab * bc - bb * ca)
    ) / 2.0
    cosine = half_determinant / (spread * spread * spread)
    return sqrt(mean + 2.0 * spread * cos(acos(max(-1.0, min(1.0, cosine))) / 3.0))


def _largest_batch(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the same for ``rows`` of shape (3, 3, n)."""
    diagonal = np.einsum("ijn,ijn->in", rows, rows)
    others = np.einsum("ijn,ijn->in", rows, rows[[1, 2, 0]])
    mean = diagonal.sum(axis=0) / 3.0
    diagonal -= mean
    aa, bb, cc = diagonal
    ab, bc, ca = others
    squares = np.einsum("in,in->n", diagonal, diagonal)
    squares += 2.0 * np.einsum("in,in->n", others, others)
    spread = np.maximum(np.sqrt(squares / 6.0), NO_SPREAD)
    half_determinant = 0.5 * (
        aa * (bb * cc - bc * bc) - ab * (ab * cc - bc * ca) + ca * (ab * bc - bb * ca)
    )
    cosine = np.minimum(np.maximum(half_determinant / (spread * spread * spread), -1.0), 1.0)
    return np.asarray(np.sqrt(mean + 2.0 * spread * np.cos(np.arccos(cosine) / 3.0)))
