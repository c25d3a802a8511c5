"""All positions of the moving triangle at given crank angles."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.equal_numbers import directions, wrapped
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms.f_mechanism.closure import (
    ROUNDING_ERROR,
    Closure,
    Linear,
    closure,
)
from tri_glide_kinematics.mechanisms.f_mechanism.exact import exact_positions
from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import (
    LENGTH_ROUNDING_ERROR,
    CrankPins,
    Linkage,
    Number,
    Position,
    direction,
    motion,
    newton_step,
    pins_at,
    position_of,
    refined,
    rod_jacobian,
    rotation,
    singularity_unit,
)
from tri_glide_kinematics.mechanisms.f_mechanism.roots import (
    NODES,
    real_roots,
    row_order,
    simple_roots,
)
from tri_glide_kinematics.vectors import FloatArray, Point
from tri_glide_kinematics.wording import number_text


class SelfMotionError(KinematicsError):
    """The platform can move while all cranks stand still, so that it has no definite positions."""

    def __init__(self, crank_angle: float) -> None:
        """Store the ``crank_angle`` [rad] at which this happens."""
        super().__init__(
            f"crank_angle = {number_text(crank_angle)} rad: the platform can move while the cranks "
            "stand still (self-motion), so it has no finite number of positions"
        )
        self.crank_angle = crank_angle


@dataclass(frozen=True)
class FMechanismPose:
    """One position of the moving triangle, and its motion per unit crank speed.

    Where the position is singular the rates are infinite or without meaning.

    Attributes:
        crank_angle: angle of crank A [rad].
        angle: rotation phi_70 of the platform, in (-pi, pi] [rad].
        position: origin u_0 of the platform frame [m].
        crank_pins: A1, B1, C1 [m].
        platform_joints: A2, B2, C2 in the fixed frame [m].
        angular_velocity: d angle / d crank_angle [rad/rad].
        velocity: d position / d crank_angle [m/rad].
        residual: largest deviation of a rod length [m].
        singularity: signed, dimensionless determinant of the three rod lines: each row is the
            unit direction of a rod and its moment over the platform radius (root mean square
            distance of the platform joints from their centroid). It is zero exactly where the rods
            are concurrent or parallel, and of order one far from there.
        double: whether two positions coincide here to rounding (a fold, or a branching point).
    """

    crank_angle: float
    angle: float
    position: Point
    crank_pins: tuple[Point, Point, Point]
    platform_joints: tuple[Point, Point, Point]
    angular_velocity: float
    velocity: Point
    residual: float
    singularity: float
    double: bool

    def point(self, platform_point: Point) -> Point:
        """Place in the fixed frame of a point given in the platform frame [m]."""
        x, y = platform_point
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return (
            float(self.position[0] + cosine * x - sine * y),
            float(self.position[1] + sine * x + cosine * y),
        )

    def point_velocity(self, platform_point: Point) -> Point:
        """Velocity per unit crank speed of a point given in the platform frame [m/rad]."""
        x, y = self.point(platform_point)
        return (
            self.velocity[0] - self.angular_velocity * (y - self.position[1]),
            self.velocity[1] + self.angular_velocity * (x - self.position[0]),
        )


@dataclass(frozen=True, eq=False)
class FMechanismPoses:
    """All positions at many crank angles; places without a position hold NaN.

    Attributes:
        crank_angles: shape (n,) [rad].
        counts: number of positions, shape (n,).
        angle: platform angles, ascending in each row, shape (n, 6) [rad].
        position: origins of the platform frame, shape (n, 6, 2) [m].
        angular_velocity: shape (n, 6) [rad/rad].
        velocity: of the origin, shape (n, 6, 2) [m/rad].
        residual: largest deviation of a rod length, shape (n, 6) [m].
        singularity: as in FMechanismPose, shape (n, 6).
        self_motion: rows in which the platform can move with the cranks at rest, so that there is
            no finite number of positions; their count is 0. Shape (n,).
        linkage: dimensions of the mechanism.
    """

    crank_angles: FloatArray
    counts: NDArray[np.int64]
    angle: FloatArray
    position: FloatArray
    angular_velocity: FloatArray
    velocity: FloatArray
    residual: FloatArray
    singularity: FloatArray
    self_motion: NDArray[np.bool_]
    linkage: Linkage

    def platform_joints(self) -> FloatArray:
        """A2, B2, C2 in the fixed frame, shape (n, 6, 3, 2) [m]."""
        joints = np.array([(joint.real, joint.imag) for joint in self.linkage.joints])
        cosine, sine = np.cos(self.angle)[..., np.newaxis], np.sin(self.angle)[..., np.newaxis]
        x = cosine * joints[:, 0] - sine * joints[:, 1]
        y = sine * joints[:, 0] + cosine * joints[:, 1]
        places: FloatArray = self.position[..., np.newaxis, :] + np.stack([x, y], axis=-1)
        return places

    def crank_pins(self) -> FloatArray:
        """A1, B1, C1, shape (n, 3, 2) [m]."""
        pins = pins_at(self.linkage, self.linkage.crank_angles(self.crank_angles))
        places = np.stack([pins.a, pins.b, pins.c], axis=-1)
        return np.stack([places.real, places.imag], axis=-1)


# All positions of the moving triangle at one crank angle.

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
    roots = real_roots(condition.polynomial, ROUNDING_ERROR * condition.scale)
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
    vanishes = largest <= ROUNDING_ERROR * condition.scale
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
    if abs(determinant.constant) + abs(determinant.first) > LENGTH_ROUNDING_ERROR:
        return True
    z, unit = direction(NODES), linkage.unit
    w_b = unit * (z * linkage.platform_b - (pins.b - pins.a))
    w_c = unit * (z * linkage.platform_c - (pins.c - pins.a))
    radius, slack = unit * linkage.rods[0], LENGTH_ROUNDING_ERROR
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


# All positions of the moving triangle at many crank angles at once.
#
# The same steps as for one crank angle, on flat arrays with one entry for each root. Rows with a
# special case in them (a double root, a degenerate linear system, a self-motion) are rare, and are
# solved one by one.

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Rows solved together: their samples fit into the processor's cache.
_CHUNK = 1024


def solve_batch(linkage: Linkage, crank_angles: FloatArray) -> FMechanismPoses:
    """All positions at the given crank angles, shape (n,) [rad]."""
    n = len(crank_angles)
    result = FMechanismPoses(
        crank_angles=crank_angles,
        counts=np.zeros(n, dtype=np.int64),
        angle=np.full((n, 6), np.nan),
        position=np.full((n, 6, 2), np.nan),
        angular_velocity=np.full((n, 6), np.nan),
        velocity=np.full((n, 6, 2), np.nan),
        residual=np.full((n, 6), np.nan),
        singularity=np.full((n, 6), np.nan),
        self_motion=np.zeros(n, dtype=np.bool_),
        linkage=linkage,
    )
    for first in range(0, n, _CHUNK):
        rows = slice(first, min(first + _CHUNK, n))
        special = _solve_chunk(linkage, crank_angles[rows], result, first)
        for row in (first + np.flatnonzero(special)).tolist():
            _solve_row(linkage, result, row)
    return result


def _solve_chunk(linkage: Linkage, angles: FloatArray, result: FMechanismPoses, first: int) -> Mask:
    """Write the positions of ordinary rows to ``result``; return which rows are special."""
    pins = pins_at(linkage, linkage.crank_angles(angles))
    condition = closure(linkage, pins)
    tolerance = ROUNDING_ERROR * condition.scale
    special: Mask = special_pins(linkage, pins, condition) | condition.noisy
    roots = simple_roots(condition.polynomial, tolerance, special)

    row = roots.row
    z = direction(roots.angle)
    pins = CrankPins(*(part[row] for part in pins))
    v, degenerate = _rod_vectors(linkage, pins, condition, row, z)
    with np.errstate(divide="ignore", invalid="ignore"):
        swing, turn = newton_step(rod_jacobian(linkage, pins, z, v))
        z, v = z * rotation(turn), v * rotation(swing)
        jacobian = rod_jacobian(linkage, pins, z, v)
        inverse = 1.0 / jacobian.determinant
        origin, joints, velocity, turn_rate = motion(linkage, pins, z, v, jacobian, inverse)
        gaps = [abs(abs(q - p) - length) for q, p, length in zip(joints, pins, linkage.rods)]
        residual = np.maximum(np.maximum(gaps[0], gaps[1]), gaps[2])
        failed = degenerate | ~(residual <= RESIDUAL * linkage.size)
        failed |= ~(abs(turn) <= LONGEST_CORRECTION * _apart(row, roots.angle))
    special[row[failed]] = True

    angle = directions(z)
    ordinary = np.flatnonzero(~special[row])
    ordinary = ordinary[row_order(row[ordinary], angle[ordinary])]
    row = row[ordinary]
    counts = np.bincount(row, minlength=len(angles))
    slot = np.arange(len(row)) - (np.cumsum(counts) - counts)[row]
    place = (first + row, slot)
    result.counts[first : first + len(angles)] = counts
    result.angle[place] = angle[ordinary]
    result.position[place] = _points(origin[ordinary])
    result.angular_velocity[place] = turn_rate[ordinary]
    result.velocity[place] = _points(velocity[ordinary])
    result.residual[place] = residual[ordinary]
    result.singularity[place] = jacobian.determinant[ordinary] / singularity_unit(linkage)
    return special


def _solve_row(linkage: Linkage, result: FMechanismPoses, row: int) -> None:
    """Solve one row by itself."""
    try:
        poses = poses_at(linkage, float(result.crank_angles[row]))
    except SelfMotionError:
        result.self_motion[row] = True
        return
    result.counts[row] = len(poses)
    for slot, pose in enumerate(poses):
        result.angle[row, slot] = pose.angle
        result.position[row, slot] = pose.position
        result.angular_velocity[row, slot] = pose.angular_velocity
        result.velocity[row, slot] = pose.velocity
        result.residual[row, slot] = pose.residual
        result.singularity[row, slot] = pose.singularity


def _points(numbers: Complex) -> FloatArray:
    return numbers.view(np.float64).reshape(-1, 2)


def _apart(row: Index, angle: FloatArray) -> FloatArray:
    """Distance of each root to the next one in its row, or to the ends of the circle [rad]."""
    steps = np.full(len(row) + 1, np.pi)
    steps[1:-1] = np.where(row[1:] == row[:-1], angle[1:] - angle[:-1], np.pi)
    apart: FloatArray = np.minimum(steps[:-1], steps[1:])
    return apart


def _rod_vectors(
    linkage: Linkage, pins: CrankPins, condition: Closure, row: Index, z: Complex
) -> tuple[Complex, Mask]:
    """Rod vectors v of the roots ``z``, and where the linear system for them is degenerate."""
    determinant, m_b, m_c = (
        Linear(part.constant[row], part.first[row]).at(z)
        for part in (condition.determinant, condition.product_b, condition.product_c)
    )
    w_b = z * linkage.platform_b - (pins.b - pins.a)
    w_c = z * linkage.platform_c - (pins.c - pins.a)
    largest = np.maximum(abs(w_b), abs(w_c))
    least = DEGENERATE * linkage.unit**2 * linkage.reach
    degenerate = ~(abs(determinant) > least * largest)
    # Only the direction is needed: its length is that of rod A, its sense that of D.
    v = (m_b * w_c - m_c * w_b) * (-1j * np.sign(determinant))
    with np.errstate(divide="ignore", invalid="ignore"):
        v *= linkage.rods[0] / abs(v)
    return v, degenerate
