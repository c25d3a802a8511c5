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
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import Linkage, Number
from tri_glide_kinematics.vectors import Vector3, dot

# Symmetric matrix: entries 00, 11, 22, 01, 02, 12.
Symmetric = tuple[float, float, float, float, float, float]

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


class Gradients(NamedTuple):
    """Values [m^2] and gradients of the two rod equations at a point."""

    gap_b: float
    gap_c: float
    b: Vector3
    c: Vector3


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
        self._offset_b, self._offset_c = b0 - a0, c0 - a0
        self._third_b = self._third_derivative(1, linkage.platform_b, self._offset_b)
        self._third_c = self._third_derivative(2, linkage.platform_c, self._offset_c)
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

    def gradients(self, x: Vector3) -> Gradients:
        """Rod equations and their gradients."""
        linkage, drive = self.linkage, self.drive
        alpha, phi, s = x
        v, z = cmath.rect(linkage.rods[0], alpha), cmath.rect(1.0, phi)
        (psi_a, psi_b, psi_c), (rate_a, rate_b, rate_c) = drive.start, drive.rates
        arm_a = cmath.rect(linkage.cranks[0], psi_a + rate_a * s)
        arm_b = cmath.rect(linkage.cranks[1], psi_b + rate_b * s)
        arm_c = cmath.rect(linkage.cranks[2], psi_c + rate_c * s)
        zd_b, zd_c = z * linkage.platform_b, z * linkage.platform_c
        bar_b = (v + zd_b - (self._offset_b + arm_b - arm_a)).conjugate()
        bar_c = (v + zd_c - (self._offset_c + arm_c - arm_a)).conjugate()
        rate = rate_a * arm_a
        return Gradients(
            0.5 * (bar_b.real**2 + bar_b.imag**2 - linkage.rods[1] ** 2),
            0.5 * (bar_c.real**2 + bar_c.imag**2 - linkage.rods[2] ** 2),
            (-(bar_b * v).imag, -(bar_b * zd_b).imag, (bar_b * (rate_b * arm_b - rate)).imag),
            (-(bar_c * v).imag, -(bar_c * zd_c).imag, (bar_c * (rate_c * arm_c - rate)).imag),
        )

    def hessians(self, x: Vector3) -> tuple[Symmetric, Symmetric]:
        """Second derivatives of both rod equations."""
        linkage, drive = self.linkage, self.drive
        alpha, phi, s = x
        v, z = cmath.rect(linkage.rods[0], alpha), cmath.rect(1.0, phi)
        psi_a, psi_b, psi_c = drive.crank_angles(s)
        rate_a, rate_b, rate_c = drive.rates
        arm_a = cmath.rect(linkage.cranks[0], psi_a)
        arm_b = cmath.rect(linkage.cranks[1], psi_b)
        arm_c = cmath.rect(linkage.cranks[2], psi_c)
        first, second = rate_a * arm_a, rate_a**2 * arm_a
        return (
            _hessian(
                v,
                z * linkage.platform_b,
                self._offset_b + arm_b - arm_a,
                1j * (rate_b * arm_b - first),
                second - rate_b**2 * arm_b,
            ),
            _hessian(
                v,
                z * linkage.platform_c,
                self._offset_c + arm_c - arm_a,
                1j * (rate_c * arm_c - first),
                second - rate_c**2 * arm_c,
            ),
        )

    def frame(self, x: Vector3, at: Gradients | None = None) -> Frame | None:
        """Tangent, normals and bounds at a point of the curve; None where it is singular."""
        at = self.gradients(x) if at is None else at
        b, c = at.b, at.c
        a11 = math.sqrt(dot(b, b))
        if a11 == 0.0:
            return None
        n1 = (b[0] / a11, b[1] / a11, b[2] / a11)
        a21 = dot(c, n1)
        rest = (c[0] - a21 * n1[0], c[1] - a21 * n1[1], c[2] - a21 * n1[2])
        a22 = math.sqrt(dot(rest, rest))
        if a22 == 0.0:
            return None
        n2 = (rest[0] / a22, rest[1] / a22, rest[2] / a22)
        tangent = (
            n1[1] * n2[2] - n1[2] * n2[1],
            n1[2] * n2[0] - n1[0] * n2[2],
            n1[0] * n2[1] - n1[1] * n2[0],
        )
        hessian_b, hessian_c = self.hessians(x)
        ratio = a21 / a22
        first = [h / a11 for h in hessian_b]
        second = [h / a22 - ratio * f for h, f in zip(hessian_c, first)]
        third_1 = self._third_b / a11
        third_2 = self._third_c / a22 + abs(ratio) * third_1
        image_1, image_2 = _times(first, tangent), _times(second, tangent)
        curvature = -dot(image_1, tangent), -dot(image_2, tangent)
        along = curvature[0] ** 2 + curvature[1] ** 2
        mixed = dot(image_1, image_1) + dot(image_2, image_2) - along
        across = _square(first) + _square(second) - along - 2.0 * mixed
        return Frame(
            x,
            tangent,
            n1,
            n2,
            curvature,
            math.sqrt(along),
            math.sqrt(max(mixed, 0.0)),
            math.sqrt(max(across, 0.0)),
            math.hypot(third_1, third_2),
        )

    def correct(self, frame: Frame, h: float) -> tuple[Vector3, Gradients] | None:
        """Point of the curve in the plane at the tangential coordinate ``h`` of ``frame``."""
        (x0, x1, x2), (t0, t1, t2) = frame.x, frame.tangent
        (p0, p1, p2), (q0, q1, q2) = frame.normal_1, frame.normal_2
        y1, y2 = 0.5 * h * h * frame.curvature[0], 0.5 * h * h * frame.curvature[1]
        for _ in range(_ITERATIONS):
            x = (
                x0 + h * t0 + y1 * p0 + y2 * q0,
                x1 + h * t1 + y1 * p1 + y2 * q1,
                x2 + h * t2 + y1 * p2 + y2 * q2,
            )
            at = self.gradients(x)
            if max(abs(at.gap_b), abs(at.gap_c)) <= self._tolerance:
                return x, at
            b1, b2 = dot(at.b, frame.normal_1), dot(at.b, frame.normal_2)
            c1, c2 = dot(at.c, frame.normal_1), dot(at.c, frame.normal_2)
            determinant = b1 * c2 - b2 * c1
            if determinant == 0.0:
                return None
            step_1 = (at.gap_c * b2 - at.gap_b * c2) / determinant
            step_2 = (at.gap_b * c1 - at.gap_c * b1) / determinant
            y1, y2 = y1 + step_1, y2 + step_2
            if abs(step_1) + abs(step_2) < 1e-15:
                return x, at
        return None


def _hessian(v: complex, zd: complex, e: complex, e1: complex, e2: complex) -> Symmetric:
    """Second derivatives of |v + zd - e|^2 / 2, with e1 and e2 the derivatives of e."""
    r = v + zd - e
    return (
        -(v.real * (zd - e).real + v.imag * (zd - e).imag),
        -(zd.real * (v - e).real + zd.imag * (v - e).imag),
        e1.real**2 + e1.imag**2 - (r.real * e2.real + r.imag * e2.imag),
        v.real * zd.real + v.imag * zd.imag,
        v.imag * e1.real - v.real * e1.imag,
        zd.imag * e1.real - zd.real * e1.imag,
    )


def _times(matrix: Sequence[float], p: Vector3) -> Vector3:
    """Symmetric matrix times vector."""
    m00, m11, m22, m01, m02, m12 = matrix
    x, y, z = p
    return m00 * x + m01 * y + m02 * z, m01 * x + m11 * y + m12 * z, m02 * x + m12 * y + m22 * z


def _square(matrix: Sequence[float]) -> float:
    """Square of the Frobenius norm of a symmetric matrix."""
    m00, m11, m22, m01, m02, m12 = matrix
    diagonal = m00 * m00 + m11 * m11 + m22 * m22
    return diagonal + 2.0 * (m01 * m01 + m02 * m02 + m12 * m12)
