"""Singular places of the curve of positions: turning points and bifurcations."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.following.curve import (
    Curve,
    Frame,
    Gradients,
    Symmetric,
    Vector,
    distance,
    dot,
)

Array = NDArray[np.float64]

_BISECTIONS = 80
_ITERATIONS = 30
# Residual of the bifurcation equations, lengths relative to the size, that counts as zero.
_EXACT = 1e-11


def turning_point(curve: Curve, frame: Frame, end: float) -> tuple[Vector, float]:
    """The turning point on an arc whose two ends run against each other in the drive.

    Args:
        curve: the curve.
        frame: start of the arc.
        end: tangential coordinate of its end.

    Returns:
        The point, and its tangential coordinate in ``frame``.
    """
    low, high = 0.0, end
    at_low = _drive_slope(curve.gradients(frame.x))
    corrected = curve.correct(frame, end)
    at_high = _drive_slope(corrected[1]) if corrected else -at_low
    x = frame.x
    for _ in range(_BISECTIONS):
        if abs(high - low) < 1e-13:
            break
        spread = at_low - at_high
        h = low + (high - low) * at_low / spread if spread else low
        if not min(low, high) < h < max(low, high):
            h = 0.5 * (low + high)
        corrected = curve.correct(frame, h)
        if corrected is None:
            break
        x, at = corrected
        slope = _drive_slope(at)
        # Halving the value at the end that stays (Illinois) keeps the secant from creeping.
        if (slope > 0.0) == (at_low > 0.0):
            low, at_low, at_high = h, slope, 0.5 * at_high
        else:
            high, at_high, at_low = h, slope, 0.5 * at_low
    x = _polish_turning_point(curve, x)
    difference = (x[0] - frame.x[0], x[1] - frame.x[1], x[2] - frame.x[2])
    return x, dot(difference, frame.tangent)


def _drive_slope(at: Gradients) -> float:
    """Drive component of the tangent, times a positive factor."""
    return at.b[0] * at.c[1] - at.b[1] * at.c[0]


def _polish_turning_point(curve: Curve, x: Vector) -> Vector:
    """Newton's method on both rod equations and the determinant that vanishes with them."""
    best = np.array(x)
    scale = curve.linkage.size**2
    for _ in range(3):
        at = curve.gradients((best[0], best[1], best[2]))
        h_b, h_c = (_matrix(h) for h in curve.hessians((best[0], best[1], best[2])))
        slope_gradient = (
            h_b[0] * at.c[1] + at.b[0] * h_c[1] - h_b[1] * at.c[0] - at.b[1] * h_c[0]
        ) / scale
        matrix = np.array([at.b, at.c, slope_gradient])
        gaps = np.array([at.gap_b, at.gap_c, _drive_slope(at) / scale])
        if abs(np.linalg.det(matrix)) < 1e-12 * scale**3:
            break
        step = np.linalg.solve(matrix, gaps)
        if np.max(np.abs(step)) > 1e-4:
            break
        best = best - step
    return float(best[0]), float(best[1]), float(best[2])


def find_bifurcation(curve: Curve, start: Vector, reach: float) -> Vector | None:
    """The point within ``reach`` of ``start`` where the gradients are dependent, or None.

    A branch that merely passes close by another has no such point: the equations, five for four
    unknowns, then have no solution.
    """
    scale = curve.linkage.size**2
    x = np.array(start)
    at = curve.gradients(start)
    left = np.linalg.svd(np.array([at.b, at.c]))[0][:, -1]
    mix = math.atan2(left[1], left[0])
    for _ in range(_ITERATIONS):
        point = (float(x[0]), float(x[1]), float(x[2]))
        at = curve.gradients(point)
        h_b, h_c = (_matrix(h) / scale for h in curve.hessians(point))
        b, c = np.array(at.b) / scale, np.array(at.c) / scale
        cosine, sine = math.cos(mix), math.sin(mix)
        residual = np.concatenate([[at.gap_b / scale, at.gap_c / scale], cosine * b + sine * c])
        jacobian = np.zeros((5, 4))
        jacobian[0, :3], jacobian[1, :3] = b, c
        jacobian[2:, :3] = cosine * h_b + sine * h_c
        jacobian[2:, 3] = cosine * c - sine * b
        step = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        x, mix = x - step[:3], mix - float(step[3])
        if distance((x[0], x[1], x[2]), start) > 2.0 * reach:
            return None
        if np.max(np.abs(step)) < 1e-14:
            break
    if np.max(np.abs(residual)) > _EXACT or distance(point, start) > reach:
        return None
    return point


def branch_directions(curve: Curve, x: Vector) -> tuple[Vector, Vector] | None:
    """Unit tangents of the two branches that cross at a bifurcation; None if they do not cross.

    They are the zeros of the second derivative of that combination of the rod equations whose
    gradient vanishes, on the plane that both gradients leave free.
    """
    at = curve.gradients(x)
    scale = curve.linkage.size**2
    left, _, right = np.linalg.svd(np.array([at.b, at.c]) / scale)
    h_b, h_c = (_matrix(h) / scale for h in curve.hessians(x))
    plane = right[1:]
    form = plane @ (left[0, 1] * h_b + left[1, 1] * h_c) @ plane.T
    values, vectors = np.linalg.eigh(form)
    if values[0] * values[1] >= 0.0 or min(abs(values)) < 1e-9 * max(abs(values)):
        return None
    along, across = math.sqrt(values[1]), math.sqrt(-values[0])
    first = (along * vectors[:, 0] + across * vectors[:, 1]) @ plane
    second = (along * vectors[:, 0] - across * vectors[:, 1]) @ plane
    return _unit(first), _unit(second)


def _unit(vector: Array) -> Vector:
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    return x, y, z


def _matrix(symmetric: Symmetric) -> Array:
    m00, m11, m22, m01, m02, m12 = symmetric
    return np.array([[m00, m01, m02], [m01, m11, m12], [m02, m12, m22]])
