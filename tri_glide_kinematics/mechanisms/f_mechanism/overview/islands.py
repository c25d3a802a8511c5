"""Closed branches so small that they lie between two sampled crank angles.

Such an island appears and vanishes between two samples. There the closure condition F, as a
function of the platform angle, has an extremum that comes to zero and leaves it again. So every
extremum that approaches zero on one side of an interval and leaves it on the other is searched for
its least distance.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.solving import (
    ROUNDING,
    Closure,
    Cubic,
    Linkage,
    derivatives,
    direction,
    pins_at,
    row_roots,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.closure import closure

Array = NDArray[np.float64]

_DIFFERENCE = 1e-6
_BISECTIONS = 25
_NEWTON_STEPS = 6
_TRACKING_STEPS = 2


def find_islands(linkage: Linkage, crank_angles: Array) -> list[float]:
    """Crank angles between the equidistant given ones at which an island is widest [rad]."""
    polynomial = _closure(linkage, crank_angles).polynomial
    row, angle = row_roots(_derivative(polynomial))
    spacing = crank_angles[1] - crank_angles[0]
    low = crank_angles[row]
    value, slope, angle = _extremum(linkage, low, angle)
    high_value, high_slope, _ = _extremum(linkage, low + spacing, angle)
    sign = np.where(value >= 0.0, 1.0, -1.0)
    valley = (sign * high_value > 0.0) & (sign * slope < 0.0) & (sign * high_slope > 0.0)
    low, angle, sign = low[valley], angle[valley], sign[valley]
    high = low + spacing
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        value, slope, angle = _extremum(linkage, middle, angle, _TRACKING_STEPS)
        falling = sign * slope < 0.0
        low, high = np.where(falling, middle, low), np.where(falling, high, middle)
    scale = _closure(linkage, low).scale
    island = sign * value < -ROUNDING * scale
    return [math.remainder(float(found), 2.0 * math.pi) for found in low[island]]


def _closure(linkage: Linkage, crank_angles: Array) -> Closure:
    return closure(linkage, pins_at(linkage, linkage.crank_angles(crank_angles)))


def _derivative(polynomial: Cubic) -> Cubic:
    """Derivative by the platform angle."""
    zero = np.zeros_like(polynomial.constant)
    return Cubic(zero, 1j * polynomial.first, 2j * polynomial.second, 3j * polynomial.third)


def _extremum(
    linkage: Linkage, crank_angles: Array, angle: Array, steps: int = _NEWTON_STEPS
) -> tuple[Array, Array, Array]:
    """Value at the extremum near ``angle``, its slope over the crank angle, and its place."""
    polynomial = _closure(linkage, crank_angles).polynomial
    for _ in range(steps):
        _, slope, curvature = derivatives(polynomial, direction(angle))
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.nan_to_num(slope / curvature)
        angle = angle - np.clip(step, -0.1, 0.1)
    z = direction(angle)
    value = derivatives(polynomial, z)[0]
    # Along the line of extrema the derivative is the partial one.
    before, after = (
        derivatives(_closure(linkage, crank_angles + offset).polynomial, z)[0]
        for offset in (-_DIFFERENCE, _DIFFERENCE)
    )
    return value, (after - before) / (2.0 * _DIFFERENCE), angle
