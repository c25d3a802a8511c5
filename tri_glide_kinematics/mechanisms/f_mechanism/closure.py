"""Closure of an F-mechanism as a trigonometric polynomial of degree three in the platform angle.

With the unit number z = exp(i phi), the rod vector
v = A2 - A1, the platform vectors d_b = B2 - A2, d_c = C2 - A2 (platform frame) and the crank pin
vectors e_b = B1 - A1, e_c = C1 - A1, the three rod equations of source 001, equation (2), read

    |v| = l_a,    |v + w_b| = l_b,    |v + w_c| = l_c,    w_k = z d_k - e_k.

Their differences are linear in v.
"""

from __future__ import annotations

import cmath
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import CrankPins, Linkage, Number
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
    square_a, square_b, square_c = ((unit * rod) ** 2 for rod in linkage.rods)
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
    rod_a, rod_b, rod_c = (unit * rod for rod in linkage.rods)
    terms = (rod_a * (rod_a + rod_b) * (rod_a + rod_c)) ** 2
    noisy = ROUNDING_ERROR * scale > _NOISE * terms
    return Closure(polynomial, scale, noisy, Linear(b0, b1), Linear(c0, c1), Linear(d0, d1))
