"""The rod equations of an F-mechanism, with its dimensions as complex numbers.

Points of the plane are complex numbers. Formulas take plain numbers and numpy arrays of them
alike, so that one position and a million have the same formulas.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.equal_numbers import directions
from tri_glide_kinematics.vectors import FloatArray, Vector3

Complex = NDArray[np.complex128]

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


def pins_at(
    linkage: Linkage, crank_angles: tuple[Number, Number, Number], rates: Vector3 | None = None
) -> CrankPins:
    """Crank pins when cranks A, B and C stand at ``crank_angles`` [rad].

    Their derivatives are those by the angle of crank A, or by what changes the three crank angles
    at ``rates``.
    """
    (a0, b0, c0), (a, b, c) = linkage.pivots, linkage.cranks
    psi_a, psi_b, psi_c = crank_angles
    arm_a, arm_b, arm_c = a * direction(psi_a), b * direction(psi_b), c * direction(psi_c)
    rate_a, rate_b, rate_c = linkage.speeds if rates is None else rates
    return CrankPins(
        a0 + arm_a,
        b0 + arm_b,
        c0 + arm_c,
        1j * rate_a * arm_a,
        1j * rate_b * arm_b,
        1j * rate_c * arm_c,
    )


# Gaps of the rod equations, relative to the size and the reach: reached by Newton's method.
CONVERGED = 1e-14
# Newton's method gives up before a longer step: its start was too far from a position [rad].
_LONGEST_STEP = 0.01
# Rounding error of products of lengths, relative to them.
LENGTH_ROUNDING_ERROR = 32.0 * float(np.finfo(np.float64).eps)


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

    @property
    def b(self) -> tuple[Number, Number, Number]:
        """Gradient of the rod equation of B."""
        return self.rod_b, self.turn_b, self.drive_b

    @property
    def c(self) -> tuple[Number, Number, Number]:
        """Gradient of the rod equation of C."""
        return self.rod_c, self.turn_c, self.drive_c


def rod_jacobian(linkage: Linkage, pins: CrankPins, z: Number, v: Number) -> RodJacobian:
    """Evaluate the rod equations of B and C with all first derivatives."""
    zd_b, zd_c = z * linkage.platform_b, z * linkage.platform_c
    r_b = v + zd_b - (pins.b - pins.a)
    r_c = v + zd_c - (pins.c - pins.a)
    # conj(p) q = p . q + i (p x q)
    bar_b, bar_c = r_b.conjugate(), r_c.conjugate()
    _, length_b, length_c = linkage.rods
    rod_b, rod_c = -(bar_b * v).imag, -(bar_c * v).imag
    turn_b, turn_c = -(bar_b * zd_b).imag, -(bar_c * zd_c).imag
    return RodJacobian(
        0.5 * ((bar_b * r_b).real - length_b * length_b),
        0.5 * ((bar_c * r_c).real - length_c * length_c),
        rod_b,
        rod_c,
        turn_b,
        turn_c,
        -(bar_b * (pins.b_rate - pins.a_rate)).real,
        -(bar_c * (pins.c_rate - pins.a_rate)).real,
        rod_b * turn_c - rod_c * turn_b,
    )


def newton_step(jacobian: RodJacobian) -> tuple[Number, Number]:
    """Corrections of the rod direction and the platform angle [rad], numbers or arrays alike."""
    gap_b, gap_c, rod_b, rod_c, turn_b, turn_c, _, _, determinant = jacobian
    return (
        (gap_c * turn_b - gap_b * turn_c) / determinant,
        (gap_b * rod_c - gap_c * rod_b) / determinant,
    )


class States(NamedTuple):
    """Positions of the platform with their motion per unit crank speed, one entry for each.

    Attributes:
        angle: of the platform, in (-pi, pi]. Shape (k,) [rad].
        position: origin of the platform frame. Shape (k, 2) [m].
        platform_joints: A2, B2, C2. Shape (k, 3, 2) [m].
        angular_velocity: Shape (k,) [rad/rad].
        velocity: of the origin. Shape (k, 2) [m/rad].
        residual: largest deviation of a rod length. Shape (k,) [m].
        singularity: as that function tells. Shape (k,).
    """

    angle: FloatArray
    position: FloatArray
    platform_joints: FloatArray
    angular_velocity: FloatArray
    velocity: FloatArray
    residual: FloatArray
    singularity: FloatArray


def motion(
    linkage: Linkage, pins: CrankPins, z: Number, v: Number, jacobian: RodJacobian, inverse: Number
) -> tuple[Number, list[Number], Number, Number, list[Number]]:
    """Platform origin, joints, velocity of the origin, angular velocity, deviations of the rods.

    ``inverse`` is the reciprocal of the Jacobian's determinant. Numbers or arrays alike.
    """
    _, _, rod_b, rod_c, turn_b, turn_c, drive_b, drive_c, _ = jacobian
    swing_rate = (drive_c * turn_b - drive_b * turn_c) * inverse
    turn_rate = (drive_b * rod_c - drive_c * rod_b) * inverse
    arm = z * linkage.joints[0]
    origin = pins.a + v - arm
    velocity = pins.a_rate + 1j * (v * swing_rate - arm * turn_rate)
    joints = [origin + z * joint for joint in linkage.joints]
    gaps = [abs(abs(joint - pin) - rod) for joint, pin, rod in zip(joints, pins, linkage.rods)]
    return origin, joints, velocity, turn_rate, gaps


def singularity(linkage: Linkage, jacobian: RodJacobian) -> Number:
    """Determinant of the three rod lines, without a unit.

    Each is written as its unit direction and its moment about a point over the platform radius.
    """
    return jacobian.determinant / math.prod((*linkage.rods, linkage.platform_radius))


def states(linkage: Linkage, pins: CrankPins, z: Complex, v: Complex) -> States:
    """Positions at the directions ``z`` and the rod vectors ``v``; singular ones have no rates."""
    jacobian = rod_jacobian(linkage, pins, z, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / jacobian.determinant
        origin, joints, velocity, turn_rate, gaps = motion(linkage, pins, z, v, jacobian, inverse)
    return States(
        directions(z),
        as_points(origin),
        as_points(np.stack(joints, axis=-1)),
        turn_rate,
        as_points(velocity),
        np.maximum(np.maximum(gaps[0], gaps[1]), gaps[2]),
        singularity(linkage, jacobian),
    )


def as_points(numbers: Complex) -> FloatArray:
    """Complex numbers as x and y along a new last axis."""
    return np.stack([numbers.real, numbers.imag], axis=-1)


class Position(NamedTuple):
    """A position of the platform.

    Attributes:
        z: direction exp(i angle) of the platform.
        v: vector of rod A [m].
        jacobian: the rod equations there, with their derivatives.
        double: whether two positions coincide here.
    """

    z: complex
    v: complex
    jacobian: RodJacobian
    double: bool

    @property
    def gap(self) -> float:
        """Largest gap of the rod equations [m^2]."""
        return max(abs(self.jacobian.gap_b), abs(self.jacobian.gap_c))


def position_of(
    linkage: Linkage, pins: CrankPins, z: complex, v: complex, double: bool = False
) -> Position:
    """Position with the rod equations at ``z`` and ``v``."""
    return Position(z, v, rod_jacobian(linkage, pins, z, v), double)


def refined(linkage: Linkage, pins: CrankPins, position: Position, iterations: int) -> Position:
    """Newton's method on the rod equations of B and C along the circle of rod A.

    Returns the best iterate. At a singular position steps that do not reduce the gap are dropped,
    so that nothing gets worse than the root of F.
    """
    gap = position.gap
    enough = CONVERGED * linkage.size * linkage.reach
    for _ in range(iterations):
        if gap <= enough or position.jacobian.determinant == 0.0:
            break
        swing, turn = newton_step(position.jacobian)
        if abs(swing) + abs(turn) > _LONGEST_STEP:
            break
        z, v = position.z * rotation(turn), position.v * rotation(swing)
        following = position_of(linkage, pins, z, v, position.double)
        next_gap = following.gap
        if next_gap >= gap:
            break
        position, gap = following, next_gap
    return position
