"""Dimensions of an F-mechanism, and its crank pins at given crank angles.

Points of the plane are complex numbers. Formulas take plain numbers and numpy arrays of them
alike, so that one position and a million have the same formulas.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

# Scalars and arrays run through the same lines: Python complex/float, or numpy arrays of them.
Number = Any


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
        unit: power of two that makes the size a number from 0.5 to 1 [1/m]. Products of many
            lengths are formed of lengths times it, so that none is lost at any scale.
        reach: twice the longest rod, which no two platform joints and their pins exceed in a
            position: they are no farther from congruent than that [m].
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
    unit: float = field(init=False)
    reach: float = field(init=False)

    def __post_init__(self) -> None:
        """Compute what every solution needs."""
        object.__setattr__(self, "platform_b", self.joints[1] - self.joints[0])
        object.__setattr__(self, "platform_c", self.joints[2] - self.joints[0])
        object.__setattr__(self, "unit", math.ldexp(1.0, -math.frexp(self.size)[1]))
        object.__setattr__(self, "reach", 2.0 * max(self.rods))

    def crank_angles(self, crank_angle: Number) -> tuple[Number, Number, Number]:
        """Angles of the three cranks when crank A stands at ``crank_angle`` [rad]."""
        (speed_a, speed_b, speed_c), (phase_a, phase_b, phase_c) = self.speeds, self.phases
        return (
            speed_a * crank_angle + phase_a,
            speed_b * crank_angle + phase_b,
            speed_c * crank_angle + phase_c,
        )


class CrankPins(NamedTuple):
    """Crank pins A1, B1, C1 [m] and their derivatives by the angle of crank A [m/rad]."""

    a: Number
    b: Number
    c: Number
    a_rate: Number
    b_rate: Number
    c_rate: Number


def direction(angle: Number) -> Number:
    """Unit number exp(i angle) of an angle [rad]."""
    if not isinstance(angle, np.ndarray):
        return cmath.rect(1.0, angle)
    unit = np.empty(angle.shape, dtype=np.complex128)
    np.cos(angle, out=unit.real)
    np.sin(angle, out=unit.imag)
    return unit


def pins_at(linkage: Linkage, crank_angles: tuple[Number, Number, Number]) -> CrankPins:
    """Crank pins when cranks A, B and C stand at ``crank_angles`` [rad]."""
    (a0, b0, c0), (a, b, c) = linkage.pivots, linkage.cranks
    psi_a, psi_b, psi_c = crank_angles
    arm_a, arm_b, arm_c = a * direction(psi_a), b * direction(psi_b), c * direction(psi_c)
    speed_a, speed_b, speed_c = linkage.speeds
    return CrankPins(
        a0 + arm_a,
        b0 + arm_b,
        c0 + arm_c,
        1j * speed_a * arm_a,
        1j * speed_b * arm_b,
        1j * speed_c * arm_c,
    )
