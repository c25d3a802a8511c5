"""All positions of the moving triangle at one crank angle."""

from __future__ import annotations

import cmath
import math

import numpy as np

from tri_glide_kinematics.mechanisms.errors import SelfMotionError
from tri_glide_kinematics.mechanisms.f_mechanism.results import FMechanismPose
from tri_glide_kinematics.mechanisms.f_mechanism.solving.cells import NODES
from tri_glide_kinematics.mechanisms.f_mechanism.solving.closure import ROUNDING, Closure, closure
from tri_glide_kinematics.mechanisms.f_mechanism.solving.exact import exact_positions
from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import (
    CrankPins,
    Linkage,
    Number,
    direction,
    pins_at,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import (
    Position,
    motion,
    position_of,
    refined,
    singularity_unit,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.roots import real_roots
from tri_glide_kinematics.rounding import wrapped
from tri_glide_kinematics.vectors import Point

# Below this determinant, relative to the lengths in it, the linear system for v loses so many
# digits that the positions are found in whole numbers.
DEGENERATE = 1e-6
# Newton's method may correct a root of F by this part of the distance to the next one: so no two of
# them become one position.
LONGEST_CORRECTION = 0.01
# Platform angles of two positions that differ by less are one; the platform is translated [rad].
_EQUAL_ANGLES = 1e-9
# Largest rod residual of a position, relative to the size.
RESIDUAL = 1e-12
# Rounding of products of two lengths, relative to the square of the size.
_LENGTH_ROUNDING = 32.0 * float(np.finfo(np.float64).eps)
# Agreement of lengths that makes a mechanism special, relative to the size.
SPECIAL = 1e-12


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
    """Solve the closure condition; every root is refined on the rod equations themselves.

    Where rounding leaves a doubt about a root, all are found anew in whole numbers.
    """
    condition = closure(linkage, pins)
    if special_pins(linkage, pins, condition):
        if _assembles_somewhere(linkage, pins, condition):
            raise SelfMotionError(crank_angle)
        return []
    if condition.noisy:
        return exact_positions(linkage, pins)
    roots = real_roots(condition.polynomial, ROUNDING * condition.scale)
    simple = (
        None
        if any(root.double for root in roots)
        else _refined_roots(linkage, pins, condition, [root.angle for root in roots])
    )
    return exact_positions(linkage, pins) if simple is None else simple


def _refined_roots(
    linkage: Linkage, pins: CrankPins, condition: Closure, angles: list[float]
) -> list[Position] | None:
    """Positions at the given platform angles, ascending; None where rounding leaves a doubt."""
    found: list[Position] = []
    least = DEGENERATE * linkage.unit**2 * linkage.reach
    largest_gap = RESIDUAL * linkage.size * min(linkage.rods)
    before = angles[-1] - math.tau if angles else 0.0
    for index, angle in enumerate(angles):
        after = angles[index + 1] if index + 1 < len(angles) else angles[0] + math.tau
        z = direction(angle)
        determinant = condition.determinant.at(z)
        w_b = z * linkage.platform_b - (pins.b - pins.a)
        w_c = z * linkage.platform_c - (pins.c - pins.a)
        longest = max(abs(w_b), abs(w_c))
        if not abs(determinant) > least * longest:
            return None
        m_b, m_c = condition.product_b.at(z), condition.product_c.at(z)
        v = -1j * (m_b * w_c - m_c * w_b) / determinant
        v *= linkage.rods[0] / abs(v)
        position = refined(linkage, pins, position_of(linkage, pins, z, v), 3)
        correction = abs(position.z - z)
        if correction > LONGEST_CORRECTION * min(angle - before, after - angle):
            return None
        if not position.gap <= largest_gap:
            return None
        found.append(position)
        before = angle
    return found


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
    if abs(determinant.constant) + abs(determinant.first) > _LENGTH_ROUNDING:
        return True
    z, unit = direction(NODES), linkage.unit
    w_b = unit * (z * linkage.platform_b - (pins.b - pins.a))
    w_c = unit * (z * linkage.platform_c - (pins.c - pins.a))
    radius, slack = unit * linkage.rods[0], _LENGTH_ROUNDING
    reached = (abs(condition.product_b.at(z)) <= radius * abs(w_b) + slack) & (
        abs(condition.product_c.at(z)) <= radius * abs(w_c) + slack
    )
    return bool(np.any(reached))


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
