"""The positions of an F-mechanism as a smooth curve over its drive.

A point of the curve is x = (direction of rod A, platform angle, drive), all in [rad]. Rod A keeps
its length by itself; the two other rod equations g_b(x) = g_c(x) = 0 define the curve. Both are
sums of cosines of linear functions of x, so all their derivatives have bounds that hold
everywhere. With them a ball about a point of the curve is found in which the curve is one arc:
whatever solution lies in that ball is on the same branch.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import (
    CrankPins,
    Linkage,
    Number,
    RodJacobian,
    pins_at,
    rod_jacobian,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3, combined, cross, dot, minus, scaled

# Gap of the rod equations relative to the square of the size at which a point is on the curve; with
# rods that are short against the size it is relative to the size and the reach.
ON_CURVE = 2e-15
_ON_CURVE_OF_SHORT_RODS = 1e-14
# Steps of Newton's method from an arc to the curve, or the step along the arc was too long.
_ITERATIONS = 12


@dataclass(frozen=True)
class Drive:
    """A straight path of the three crank angles: ``start + rates * s``.

    Attributes:
        start: crank angles of A, B, C at s = 0 [rad].
        rates: their derivatives by s, the largest of absolute value one.
    """

    start: Vector3
    rates: Vector3

    def crank_angles(self, s: Number) -> tuple[Number, Number, Number]:
        """Crank angles of A, B, C at ``s`` [rad], a number or an array."""
        (a, b, c), (rate_a, rate_b, rate_c) = self.start, self.rates
        return a + rate_a * s, b + rate_b * s, c + rate_c * s


class Frame(NamedTuple):
    """The curve at one of its points, in coordinates along and across it.

    The rod equations are multiplied by the inverse of their Jacobian across the curve, so that
    their derivatives compare with one.

    Attributes:
        x: the point.
        tangent: unit tangent, oriented by the cross product of the gradients.
        normal_1: unit normal.
        normal_2: unit normal.
        curvature: second derivatives of the two normal coordinates by the tangential one.
        along: size of the second derivatives along the curve, which is that of the curvature.
        mixed: size of the mixed second derivatives.
        across: size of the second derivatives across the curve; its inverse tells how far away
            another branch may be.
        third: bound of the third derivatives everywhere.
    """

    x: Vector3
    tangent: Vector3
    normal_1: Vector3
    normal_2: Vector3
    curvature: tuple[float, float]
    along: float
    mixed: float
    across: float
    third: float


class Curve:
    """The rod equations of one mechanism along one drive."""

    def __init__(self, linkage: Linkage, drive: Drive) -> None:
        """Precompute the bounds of the third derivatives."""
        self.linkage = linkage
        self.drive = drive
        a0, b0, c0 = linkage.pivots
        # Nothing depends on where the mechanism lies, and far away digits would be lost.
        self._centred = replace(linkage, pivots=(0j, b0 - a0, c0 - a0))
        self._third_b = self._third_derivative(1, linkage.platform_b, b0 - a0)
        self._third_c = self._third_derivative(2, linkage.platform_c, c0 - a0)
        self._tolerance = linkage.size * min(
            ON_CURVE * linkage.size, _ON_CURVE_OF_SHORT_RODS * linkage.reach
        )

    def _third_derivative(self, rod: int, platform: complex, offset: complex) -> float:
        """Bound of the third derivative of a rod equation.

        A term ``A cos(k . x)`` contributes A |k|^3.
        """
        rod_a, crank_a, crank = (
            self.linkage.rods[0],
            self.linkage.cranks[0],
            self.linkage.cranks[rod],
        )
        rate_a, rate = abs(self.drive.rates[0]), abs(self.drive.rates[rod])
        difference = abs(self.drive.rates[0] - self.drive.rates[rod])
        arm, base = abs(platform), abs(offset)
        with_cranks = crank_a * (1.0 + rate_a**2) ** 1.5 + crank * (1.0 + rate**2) ** 1.5
        bound: float = (
            rod_a * arm * 2.0**1.5
            + (rod_a + arm) * (base + with_cranks)
            + base * (crank_a * rate_a**3 + crank * rate**3)
            + crank_a * crank * difference**3
        )
        return bound

    def _at(self, x: Vector3) -> tuple[complex, complex, CrankPins]:
        """Vector of rod A, direction of the platform and crank pins at a point."""
        alpha, phi, s = x
        pins = pins_at(self._centred, self.drive.crank_angles(s), self.drive.rates)
        return cmath.rect(self.linkage.rods[0], alpha), cmath.rect(1.0, phi), pins

    def gradients(self, x: Vector3) -> RodJacobian:
        """Rod equations and their gradients; ``drive`` is s."""
        v, z, pins = self._at(x)
        return rod_jacobian(self._centred, pins, z, v)

    def hessians(self, x: Vector3) -> FloatArray:
        """Second derivatives of both rod equations, shape (2, 3, 3)."""
        v, z, pins = self._at(x)
        rate_a, rate_b, rate_c = self.drive.rates
        bend = 1j * rate_a * pins.a_rate
        d_b, d_c = self.linkage.platform_b, self.linkage.platform_c
        e_b, b_rate = pins.b - pins.a, pins.b_rate - pins.a_rate
        e_c, c_rate = pins.c - pins.a, pins.c_rate - pins.a_rate
        return np.array(
            [
                _hessian(v, z * d_b, e_b, b_rate, 1j * rate_b * pins.b_rate - bend),
                _hessian(v, z * d_c, e_c, c_rate, 1j * rate_c * pins.c_rate - bend),
            ]
        )

    def frame(self, x: Vector3, at: RodJacobian | None = None) -> Frame | None:
        """Tangent, normals and bounds at a point of the curve; None where it is singular."""
        at = self.gradients(x) if at is None else at
        b, c = at.b, at.c
        a11 = math.sqrt(dot(b, b))
        if a11 == 0.0:
            return None
        n1 = scaled(b, 1.0 / a11)
        a21 = dot(c, n1)
        rest = minus(c, scaled(n1, a21))
        a22 = math.sqrt(dot(rest, rest))
        if a22 == 0.0:
            return None
        n2 = scaled(rest, 1.0 / a22)
        tangent = cross(n1, n2)
        ratio = a21 / a22
        inverse = np.array([[1.0 / a11, 0.0], [-ratio / a11, 1.0 / a22]])
        bends = (inverse @ self.hessians(x).reshape(2, 9)).reshape(2, 3, 3)
        third_1 = self._third_b / a11
        third_2 = self._third_c / a22 + abs(ratio) * third_1
        images = bends @ tangent
        curve_1, curve_2 = (images @ tangent).tolist()
        along = curve_1 * curve_1 + curve_2 * curve_2
        mixed = float(np.vdot(images, images)) - along
        across = float(np.vdot(bends, bends)) - along - 2.0 * mixed
        return Frame(
            x,
            tangent,
            n1,
            n2,
            (-curve_1, -curve_2),
            math.sqrt(along),
            math.sqrt(max(mixed, 0.0)),
            math.sqrt(max(across, 0.0)),
            math.hypot(third_1, third_2),
        )

    def correct(self, frame: Frame, h: float) -> tuple[Vector3, RodJacobian] | None:
        """Point of the curve in the plane at the tangential coordinate ``h`` of ``frame``."""
        y1, y2 = 0.5 * h * h * frame.curvature[0], 0.5 * h * h * frame.curvature[1]
        for _ in range(_ITERATIONS):
            across = combined(y1, frame.normal_1, y2, frame.normal_2)
            x = combined(1.0, ahead(frame, h), 1.0, across)
            at = self.gradients(x)
            if max(abs(at.gap_b), abs(at.gap_c)) <= self._tolerance:
                return x, at
            b, c = at.b, at.c
            b1, b2 = dot(b, frame.normal_1), dot(b, frame.normal_2)
            c1, c2 = dot(c, frame.normal_1), dot(c, frame.normal_2)
            determinant = b1 * c2 - b2 * c1
            if determinant == 0.0:
                return None
            step_1 = (at.gap_c * b2 - at.gap_b * c2) / determinant
            step_2 = (at.gap_b * c1 - at.gap_c * b1) / determinant
            y1, y2 = y1 + step_1, y2 + step_2
            if abs(step_1) + abs(step_2) < 1e-15:
                return x, at
        return None


def ahead(frame: Frame, h: float) -> Vector3:
    """Point on the tangent of ``frame`` at ``h``."""
    return combined(1.0, frame.x, h, frame.tangent)


def _hessian(v: complex, zd: complex, e: complex, e1: complex, e2: complex) -> list[list[float]]:
    """Second derivatives of |v + zd - e|^2 / 2, with e1 and e2 the derivatives of e."""
    r = v + zd - e
    turn, swing = (v.conjugate() * zd).real, (e1.conjugate() * v).imag
    spin = (e1.conjugate() * zd).imag
    return [
        [-(v.conjugate() * (zd - e)).real, turn, swing],
        [turn, -(zd.conjugate() * (v - e)).real, spin],
        [swing, spin, abs(e1) ** 2 - (r.conjugate() * e2).real],
    ]
