"""From the solution of a timing problem to the way over time."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.lines.time_scaling import TimeScaling
from tri_glide_kinematics.motion.paths.timing_problem import SplineRows
from tri_glide_kinematics.vectors import FloatArray

_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


# The spline rests on a limit where so many cells to each side are within this part of theirs, and
# these are the same but for this part.
_AROUND = 2
_ON_LIMIT = 0.99
_SAME_LIMIT = 1e-4


def smoothed(coefficients: FloatArray, spans: FloatArray, largest: FloatArray) -> FloatArray:
    """Return the coefficients without what alternates where b rests on a constant limit.

    That is the speed that a path asks for. There the value of b at the ends of cells does not tell
    what it does within them, and the optimum may swing to and fro. Half of each coefficient is
    replaced by the straight line between its neighbours.

    Args:
        coefficients: of the spline. Shape (n + 2,).
        spans: of the parameter in each cell. Shape (n,).
        largest: value of b in each cell. Shape (n,).
    """
    rests = coefficients[1:-1] > _ON_LIMIT * largest
    count = 2 * _AROUND + 1
    if len(rests) < count:
        return coefficients
    around = np.lib.stride_tricks.sliding_window_view(largest, count)
    is_constant = around.max(axis=1) <= (1.0 + _SAME_LIMIT) * around.min(axis=1)
    stays = np.lib.stride_tricks.sliding_window_view(rests, count).all(axis=1)
    inner = np.flatnonzero(stays & is_constant) + 1 + _AROUND
    # Of each coefficient, the place that it stands for.
    ends = np.concatenate(((0.0,), np.cumsum(spans)))
    places = np.concatenate((ends[:1], 0.5 * (ends[:-1] + ends[1:]), ends[-1:]))
    part = (places[inner] - places[inner - 1]) / (places[inner + 1] - places[inner - 1])
    before, after = coefficients[inner - 1], coefficients[inner + 1]
    result = coefficients.copy()
    result[inner] = 0.5 * (coefficients[inner] + before + part * (after - before))
    return result


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
