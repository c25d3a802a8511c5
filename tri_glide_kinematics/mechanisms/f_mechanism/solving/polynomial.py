"""Trigonometric polynomials of degree one and three, and the derivatives of the latter."""

from __future__ import annotations

import cmath
from typing import NamedTuple

from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import Number
from tri_glide_kinematics.vectors import FloatArray


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
    bound: FloatArray = first + 2.0**order * second + 3.0**order * third
    return bound


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


def evaluate(polynomial: Cubic, angle: float) -> tuple[float, float, float]:
    """Value, first and second derivative at ``angle``."""
    value, slope, curvature = derivatives(polynomial, cmath.rect(1.0, angle))
    return value, slope, curvature
