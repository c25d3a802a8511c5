"""Closure of an F-mechanism as a trigonometric polynomial of degree three in the platform angle.

Points of the plane are complex numbers. With the unit number z = exp(i phi), the rod vector
v = A2 - A1, the platform vectors d_b = B2 - A2, d_c = C2 - A2 (platform frame) and the crank pin
vectors e_b = B1 - A1, e_c = C1 - A1, the three rod equations of source 001, equation (2), read

    |v| = l_a,    |v + w_b| = l_b,    |v + w_c| = l_c,    w_k = z d_k - e_k.

Their differences are linear in v. Every function here takes plain complex numbers and numpy arrays
of them alike, so that one position and a million share the same formulas.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

# Scalars and arrays run through the same lines: Python complex/float, or numpy arrays of them.
Number = Any

# Rounding of the closure polynomial, relative to ``Closure.scale``.
ROUNDING = 8.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Linkage:
    """Constant lengths and points of an F-mechanism as complex numbers [m].

    Attributes:
        pivots: crank pivots A0, B0, C0.
        cranks: crank lengths.
        rods: rod lengths l_a, l_b, l_c.
        joints: platform joints A2, B2, C2 in the platform frame.
        speeds: turning speeds of the three cranks per unit speed of crank A: 1, +1 or -1, 1.
        phases: crank angles of A, B, C when crank A stands at zero [rad].
        size: the largest length of the mechanism, to which tolerances refer.
        platform_radius: root mean square distance of the platform joints from their centroid.
        platform_b: vector d_b from A2 to B2 in the platform frame.
        platform_c: vector d_c from A2 to C2 in the platform frame.
    """

    pivots: tuple[complex, complex, complex]
    cranks: tuple[float, float, float]
    rods: tuple[float, float, float]
    joints: tuple[complex, complex, complex]
    speeds: tuple[float, float, float]
    phases: tuple[float, float, float]
    size: float
    platform_radius: float
    platform_b: complex = field(init=False)
    platform_c: complex = field(init=False)

    def __post_init__(self) -> None:
        """Compute what every solution needs."""
        object.__setattr__(self, "platform_b", self.joints[1] - self.joints[0])
        object.__setattr__(self, "platform_c", self.joints[2] - self.joints[0])


class CrankPins(NamedTuple):
    """Crank pins A1, B1, C1 [m] and their derivatives by the angle of crank A [m/rad]."""

    a: Number
    b: Number
    c: Number
    a_rate: Number
    b_rate: Number
    c_rate: Number


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


class Closure(NamedTuple):
    """The closure condition at one crank angle, or at many.

    Attributes:
        polynomial: F, whose real roots are the platform angles [m^6].
        scale: size [m^6] to which rounding errors of F refer: they are below ROUNDING * scale.
        product_b: m_b = (l_b^2 - l_a^2 - |w_b|^2) / 2, the scalar product v . w_b [m^2].
        product_c: m_c, likewise.
        determinant: D = w_b x w_c, determinant of the linear system for v [m^2].
    """

    polynomial: Cubic
    scale: Number
    product_b: Linear
    product_c: Linear
    determinant: Linear


def crank_pins(linkage: Linkage, units: tuple[Number, Number, Number]) -> CrankPins:
    """Crank pins from the ``units`` exp(i psi) of the three crank angles psi."""
    (a0, b0, c0), (a, b, c) = linkage.pivots, linkage.cranks
    arm_a, arm_b, arm_c = a * units[0], b * units[1], c * units[2]
    speed_a, speed_b, speed_c = linkage.speeds
    return CrankPins(
        a0 + arm_a,
        b0 + arm_b,
        c0 + arm_c,
        1j * speed_a * arm_a,
        1j * speed_b * arm_b,
        1j * speed_c * arm_c,
    )


def closure(linkage: Linkage, pins: CrankPins) -> Closure:
    """Closure condition F(phi) = |m_b w_c - m_c w_b|^2 - l_a^2 D^2 of the given crank pins.

    F is the first rod equation with v = -i (m_b w_c - m_c w_b) / D inserted, multiplied by D^2
    (source 001, section 3, without its half-angle tangent). With |w_k|^2 = s_k - 2 m_k and the
    constants s_k = l_k^2 - l_a^2 it becomes

        F = s_c m_b^2 + s_b m_c^2 - l_a^2 D^2 - 2 m_b m_c (m_b + m_c + w_b . w_c).

    m_b, m_c, D and w_b . w_c all have degree one in phi, so F has degree three and no root at
    infinity.
    """
    d_b, d_c = linkage.platform_b, linkage.platform_c
    square_a, square_b, square_c = linkage.rods[0] ** 2, linkage.rods[1] ** 2, linkage.rods[2] ** 2
    s_b, s_c = square_b - square_a, square_c - square_a
    e_b, e_c = pins.b - pins.a, pins.c - pins.a
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
    scale = linkage.size**2 * (
        reach_b * (reach_b + abs(s_c) + reach_t)
        + reach_c * (reach_c + abs(s_b) + reach_t)
        + reach_b * reach_c
        + square_a * reach_d
    )
    return Closure(polynomial, scale, Linear(b0, b1), Linear(c0, c1), Linear(d0, d1))


def rotation(angle: Number) -> Number:
    """Unit number that turns by ``angle`` to second order: exact for the last digits only.

    The Cayley form has modulus one to rounding, so that iterates stay on the unit circle.
    """
    half = 0.5j * angle
    return (1.0 + half) / (1.0 - half)


class RodJacobian(NamedTuple):
    """Rod equations of B and C at (v, z), and their derivatives, on the circle |v| = l_a.

    ``gap_k = (|v + w_k|^2 - l_k^2) / 2``; ``rod_k`` is its derivative by the direction of rod A,
    ``turn_k`` by the platform angle, ``drive_k`` by the crank angle [m^2]. ``determinant`` is
    ``rod_b turn_c - rod_c turn_b`` [m^4].
    """

    gap_b: Number
    gap_c: Number
    rod_b: Number
    rod_c: Number
    turn_b: Number
    turn_c: Number
    drive_b: Number
    drive_c: Number
    determinant: Number


def rod_jacobian(linkage: Linkage, pins: CrankPins, z: Number, v: Number) -> RodJacobian:
    """Evaluate the rod equations of B and C with all first derivatives."""
    zd_b, zd_c = z * linkage.platform_b, z * linkage.platform_c
    r_b = v + zd_b - (pins.b - pins.a)
    r_c = v + zd_c - (pins.c - pins.a)
    # conj(p) q = p . q + i (p x q)
    bar_b, bar_c = r_b.conjugate(), r_c.conjugate()
    rod_b, rod_c = -(bar_b * v).imag, -(bar_c * v).imag
    turn_b, turn_c = -(bar_b * zd_b).imag, -(bar_c * zd_c).imag
    return RodJacobian(
        0.5 * ((bar_b * r_b).real - linkage.rods[1] ** 2),
        0.5 * ((bar_c * r_c).real - linkage.rods[2] ** 2),
        rod_b,
        rod_c,
        turn_b,
        turn_c,
        -(bar_b * (pins.b_rate - pins.a_rate)).real,
        -(bar_c * (pins.c_rate - pins.a_rate)).real,
        rod_b * turn_c - rod_c * turn_b,
    )


def singularity_unit(linkage: Linkage) -> float:
    """Divisor [m^4] that makes ``RodJacobian.determinant`` the dimensionless singularity measure.

    With it the measure is the determinant of the three rod lines, each written as its unit
    direction and its moment about a point over the platform radius.
    """
    return linkage.rods[0] * linkage.rods[1] * linkage.rods[2] * linkage.platform_radius
