r"""Quintic polynomials between knots, given by value, slope and bend at each knot.

Over a piece of length $\Delta$, and in $x = t/\Delta$, all that matters is linear in five numbers:
the step of the value, and $\Delta$ times the slopes and $\Delta^2$ times the bends at both ends.
"""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.vectors import FloatArray

# From the five numbers to the coefficients of x^3, x^4 and x^5.
_UPPER_COEFFICIENTS = np.array(
    (
        (10.0, -6.0, -4.0, -1.5, 0.5),
        (-15.0, 8.0, 7.0, 1.5, -1.0),
        (6.0, -3.0, -3.0, -0.5, 0.5),
    )
)

# From the five numbers to the Bernstein control points of a quintic that begins at zero.
_CONTROL_POINTS = np.array(
    (
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.2, 0.0, 0.0, 0.0),
        (0.0, 0.4, 0.0, 0.05, 0.0),
        (1.0, 0.0, -0.4, 0.0, 0.05),
        (1.0, 0.0, -0.2, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.0, 0.0),
    )
)


def _derivative_control_points() -> FloatArray:
    """Return the matrix from the five numbers to the control points of all derivatives."""
    derivatives = []
    points = _CONTROL_POINTS
    for degree in (5, 4, 3, 2, 1):
        points = degree * np.diff(points, axis=0)
        derivatives.append(points)
    return np.concatenate(derivatives)


_DERIVATIVE_CONTROL_POINTS = _derivative_control_points()


def _numbers(
    spans: FloatArray, values: FloatArray, slopes: FloatArray, bends: FloatArray
) -> FloatArray:
    """Return the five numbers of each piece, as the module's text has them. Shape (5, k)."""
    squares = spans * spans
    return np.array(
        (
            values[1:] - values[:-1],
            slopes[:-1] * spans,
            slopes[1:] * spans,
            bends[:-1] * squares,
            bends[1:] * squares,
        )
    )


def coefficients(
    spans: FloatArray, values: FloatArray, slopes: FloatArray, bends: FloatArray
) -> FloatArray:
    """Return the coefficients of 1, x, ... x^5 in each piece.

    Args:
        spans: lengths of the pieces. Shape (k,).
        values: at the knots. Shape (k + 1,).
        slopes: first derivatives there. Shape (k + 1,).
        bends: second derivatives there. Shape (k + 1,).

    Returns:
        Shape (6, k).
    """
    numbers = _numbers(spans, values, slopes, bends)
    result = np.empty((6, len(spans)))
    result[0] = values[:-1]
    result[1] = numbers[1]
    result[2] = 0.5 * numbers[3]
    np.matmul(_UPPER_COEFFICIENTS, numbers, out=result[3:])
    return result


def evaluate(table: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return value, and first and second derivative by x, of the polynomials of a ``table``.

    Args:
        table: coefficients. Shape (6, n).
        x: where. Shape (n,).
    """
    c0, c1, c2, c3, c4, c5 = table
    # Horner's scheme, each derivative with what the one before it leaves on its way.
    top = x * c5
    p4 = c4 + top
    p3 = c3 + x * p4
    p2 = c2 + x * p3
    p1 = c1 + x * p2
    d3 = p4 + top
    d2 = p3 + x * d3
    d1 = p2 + x * d2
    bend = d1 + x * (d2 + x * (d3 + top))
    return c0 + x * p1, p1 + x * d1, bend + bend


def derivative_control_points(
    spans: FloatArray, values: FloatArray, slopes: FloatArray, bends: FloatArray
) -> FloatArray:
    """Return the Bernstein control points of the derivatives by x in each piece.

    The arguments are those of ``coefficients``.

    Returns:
        Five of the first derivative, four of the second, and so on. Shape (15, k).
    """
    numbers = _numbers(spans, values, slopes, bends)
    return np.asarray(_DERIVATIVE_CONTROL_POINTS @ numbers)
