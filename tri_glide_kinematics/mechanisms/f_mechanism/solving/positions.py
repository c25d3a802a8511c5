"""All positions of the moving triangle at one crank angle."""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.mechanisms.errors import SelfMotionError
from tri_glide_kinematics.mechanisms.f_mechanism.results.pose import FMechanismPose
from tri_glide_kinematics.mechanisms.f_mechanism.solving.cells import NODES
from tri_glide_kinematics.mechanisms.f_mechanism.solving.closure import ROUNDING, Closure, closure
from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import (
    CrankPins,
    Linkage,
    Number,
    direction,
    pins_at,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import (
    RodJacobian,
    motion,
    newton_step,
    rod_jacobian,
    rotation,
    singularity_unit,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.roots import real_roots
from tri_glide_kinematics.rounding import wrapped
from tri_glide_kinematics.vectors import Point

# Below this determinant, relative to the lengths in it, the linear system for v loses so many
# digits that v is taken from the circle of rod A and one linear equation instead.
DEGENERATE = 1e-4
# Gaps of the rod equations, relative to the square of the size: reached by Newton's method, and
# still accepted where it cannot converge (singular positions).
CONVERGED = 1e-14
_ACCEPTED = 1e-11
# Newton's method may correct a root of F by this much [rad]; anything farther is another position.
_LONGEST_CORRECTION = 1e-4
_LONGEST_STEP = 0.01
_SAME_POSITION = 1e-7
# Platform angles of two positions that differ by less are one; the platform is translated [rad].
_EQUAL_ANGLES = 1e-9
# Rounding of products of lengths, relative to the same power of the size.
_LENGTH_ROUNDING = 32.0 * float(np.finfo(np.float64).eps)
# Agreement of lengths that makes a mechanism special, relative to the size.
SPECIAL = 1e-12


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


def poses_at(linkage: Linkage, crank_angle: float) -> tuple[FMechanismPose, ...]:
    """All positions at one crank angle, ascending by platform angle.

    Raises:
        SelfMotionError: if the platform can move while the cranks stand still.
    """
    pins = pins_at(linkage, linkage.crank_angles(crank_angle))
    poses = [
        pose_of(linkage, pins, crank_angle, position)
        for position in positions(linkage, pins, crank_angle)
    ]
    if len(poses) > 1:
        _put_in_order(linkage, poses)
    return tuple(poses)


def _put_in_order(linkage: Linkage, poses: list[FMechanismPose]) -> None:
    """Sort by platform angle; positions with the same angle by the place of the platform."""

    def place(pose: FMechanismPose) -> tuple[float, float]:
        x, y = pose.position
        return round(x / linkage.size, 6), round(y / linkage.size, 6)

    poses.sort(key=lambda pose: pose.angle)
    first = 0
    for after in range(1, len(poses) + 1):
        if after == len(poses) or poses[after].angle - poses[after - 1].angle > _EQUAL_ANGLES:
            poses[first:after] = sorted(poses[first:after], key=place)
            first = after


def positions(linkage: Linkage, pins: CrankPins, crank_angle: float) -> list[Position]:
    """Solve the closure condition; every root is refined on the rod equations themselves."""
    condition = closure(linkage, pins)
    polynomial = condition.polynomial
    tolerance = ROUNDING * condition.scale
    if special_pins(linkage, pins, condition):
        if _assembles_somewhere(linkage, pins, condition):
            raise SelfMotionError(crank_angle)
        return []
    found: list[Position] = []
    degenerate = False
    for root in real_roots(polynomial, tolerance):
        z = direction(root.angle)
        determinant = condition.determinant.at(z)
        w_b = z * linkage.platform_b - (pins.b - pins.a)
        w_c = z * linkage.platform_c - (pins.c - pins.a)
        m_b, m_c = condition.product_b.at(z), condition.product_c.at(z)
        if abs(determinant) > DEGENERATE * linkage.size * max(abs(w_b), abs(w_c)):
            v = -1j * (m_b * w_c - m_c * w_b) / determinant
            v *= linkage.rods[0] / abs(v)
            found.append(refined(linkage, pins, position_of(linkage, pins, z, v, root.double), 3))
            continue
        degenerate = True
        w, m = (w_b, m_b) if abs(w_b) >= abs(w_c) else (w_c, m_c)
        candidates = _rod_on_line(linkage, w, m)
        for v in candidates:
            start = position_of(linkage, pins, z, v, len(candidates) == 1)
            position = refined(linkage, pins, start, 20)
            near = abs(position.z - z) < _LONGEST_CORRECTION
            if near and position.gap <= _ACCEPTED * linkage.size**2:
                found.append(position)
    return _distinct(linkage, found) if degenerate else found


def special_pins(linkage: Linkage, pins: CrankPins, condition: Closure) -> Number:
    """Whether a self-motion is possible by the crank pins alone; numbers or arrays alike.

    Either the closure condition vanishes identically, or the crank pins are congruent to the
    platform joints and the rods are equal: then the rods form parallelograms, along which the
    platform can translate.
    """
    polynomial = condition.polynomial
    largest = sum(map(abs, polynomial))
    vanishes = largest <= ROUNDING * condition.scale
    if max(linkage.rods) - min(linkage.rods) > SPECIAL * linkage.size:
        return vanishes
    tolerance = SPECIAL * linkage.size
    e_b, e_c = pins.b - pins.a, pins.c - pins.a
    d_b, d_c = linkage.platform_b, linkage.platform_c
    return vanishes | (
        (abs(e_b * d_c - e_c * d_b) <= tolerance * linkage.size)
        & (abs(abs(e_b) - abs(d_b)) <= tolerance)
        & (abs(abs(e_c) - abs(d_c)) <= tolerance)
    )


def _assembles_somewhere(linkage: Linkage, pins: CrankPins, condition: Closure) -> bool:
    """Whether a vanishing closure condition belongs to positions that exist.

    With a determinant that does not vanish each platform angle has its v. With one that vanishes
    everywhere, rod A must reach the line that the one independent equation leaves for v.
    """
    determinant = condition.determinant
    if abs(determinant.constant) + abs(determinant.first) > _LENGTH_ROUNDING * linkage.size**2:
        return True
    z = direction(NODES)
    w_b = z * linkage.platform_b - (pins.b - pins.a)
    w_c = z * linkage.platform_c - (pins.c - pins.a)
    radius, slack = linkage.rods[0], _LENGTH_ROUNDING * linkage.size**2
    reached = (abs(condition.product_b.at(z)) <= radius * abs(w_b) + slack) & (
        abs(condition.product_c.at(z)) <= radius * abs(w_c) + slack
    )
    return bool(np.any(reached))


def _rod_on_line(linkage: Linkage, w: complex, m: float) -> list[complex]:
    """Rod vectors v on the circle |v| = l_a and the line v . w = m; one if it is tangent."""
    square = abs(w) ** 2
    radius = linkage.rods[0]
    rest = radius * radius * square - m * m
    if square == 0.0 or rest < -1e-9 * linkage.size**4:
        return []
    if rest <= _LENGTH_ROUNDING * linkage.size**4:
        return [m * w / square]
    half_chord = math.sqrt(rest)
    return [(m + 1j * side) * w / square for side in (half_chord, -half_chord)]


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
    for _ in range(iterations):
        if gap <= CONVERGED * linkage.size**2 or position.jacobian.determinant == 0.0:
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


def _distinct(linkage: Linkage, found: list[Position]) -> list[Position]:
    """Drop repetitions: beside a degenerate system two roots lead to the same two positions."""
    kept: list[Position] = []
    for position in found:
        if not any(
            abs(position.z - other.z) < _SAME_POSITION
            and abs(position.v - other.v) < _SAME_POSITION * linkage.size
            for other in kept
        ):
            kept.append(position)
    return kept


def pose_of(
    linkage: Linkage, pins: CrankPins, crank_angle: float, position: Position
) -> FMechanismPose:
    """Joints, rates, residual and singularity measure of one position."""
    z, v, jacobian, double = position
    determinant = jacobian.determinant
    inverse = 1.0 / determinant if determinant else math.inf
    origin, joints, velocity, turn_rate = motion(linkage, pins, z, v, jacobian, inverse)
    residual = max(
        abs(abs(joint - pin) - length) for joint, pin, length in zip(joints, pins, linkage.rods)
    )
    return FMechanismPose(
        crank_angle,
        wrapped(cmath.phase(z)),
        (origin.real, origin.imag),
        (_point(pins.a), _point(pins.b), _point(pins.c)),
        (_point(joints[0]), _point(joints[1]), _point(joints[2])),
        turn_rate,
        (velocity.real, velocity.imag),
        residual,
        determinant / singularity_unit(linkage),
        double,
    )


def _point(number: complex) -> Point:
    return number.real, number.imag
