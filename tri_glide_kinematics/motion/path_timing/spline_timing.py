"""From the solution of a timing problem to the way over time."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.path_timing.problem import SplineRows
from tri_glide_kinematics.motion.trajectory.time_scaling import TimeScaling
from tri_glide_kinematics.vectors import FloatArray

_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def time_scaling(
    spans: FloatArray, rows: SplineRows, ways: FloatArray, coefficients: FloatArray
) -> TimeScaling | None:
    """Return the time scaling with a knot at each end of a cell, or None if it stands still.

    Args:
        spans: lengths of the cells in u. Shape (n,) [m].
        rows: of the spline.
        ways: at the ends of the cells, and two derivatives by u. Shape (3 or more, n + 1).
        coefficients: of the spline. Shape (n + 2,).
    """
    c0, middle, c2 = coefficients[:-2], coefficients[1:-1], coefficients[2:]

    def applied(row: FloatArray) -> FloatArray:
        return np.asarray(row[0] * c0 + row[1] * middle + row[2] * c2)

    left, right = applied(rows.left), applied(rows.right)
    x = (0.5 + 0.5 * _PLACES)[:, np.newaxis]
    y = 1.0 - x
    inside = y * y * left + 2.0 * x * y * middle + x * x * right
    if not (inside.min() > 0.0 and left.min() > 0.0 and right.min() > 0.0):
        return None
    dt = spans * ((0.5 * _WEIGHTS) @ (1.0 / np.sqrt(inside)))
    squares = np.append(left, right[-1])
    slopes = np.append(applied(rows.left_slope), applied(rows.right_slope)[-1])
    return TimeScaling(
        np.concatenate(((0.0,), np.cumsum(dt))),
        ways[0].copy(),
        ways[1] * np.sqrt(squares),
        0.5 * ways[1] * slopes + ways[2] * squares,
    )
