"""All positions of the moving triangle at given crank angles."""

from __future__ import annotations

import cmath
import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.equal_numbers import wrapped
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms.f_mechanism.closure import (
    NODES,
    ROUNDING_ERROR,
    Closure,
    Linear,
    Mask,
    closure,
    real_roots,
    row_order,
    simple_roots,
)
from tri_glide_kinematics.mechanisms.f_mechanism.exact import exact_positions
from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import (
    LENGTH_ROUNDING_ERROR,
    CrankPins,
    Linkage,
    Number,
    Position,
    as_points,
    direction,
    motion,
    newton_step,
    pins_at,
    position_of,
    refined,
    rod_jacobian,
    rotation,
    singularity,
    states,
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
        arms = direction(self.angle)[..., np.newaxis] * np.array(self.linkage.joints)
        return self.position[..., np.newaxis, :] + as_points(arms)

    def crank_pins(self) -> FloatArray:
        """A1, B1, C1, shape (n, 3, 2) [m]."""
        pins = pins_at(self.linkage, self.linkage.crank_angles(self.crank_angles))
        return as_points(np.stack(pins[:3], axis=-1))


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
# Keeps a quotient by zero finite.
_NEARLY_ZERO = 1e-300
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
    poses.sort(key=lambda pose: pose.angle)
    if any(q.angle - p.angle <= _EQUAL_ANGLES for p, q in itertools.pairwise(poses)):
        _sort_by_place(linkage, poses)
    return tuple(poses)


def _sort_by_place(linkage: Linkage, poses: list[FMechanismPose]) -> None:
    """Sort those with the same angle by the place of the platform."""
    first = 0
    for after in range(1, len(poses) + 1):
        if after == len(poses) or poses[after].angle - poses[after - 1].angle > _EQUAL_ANGLES:
            poses[first:after] = sorted(
                poses[first:after],
                key=lambda pose: [round(part / linkage.size, 6) for part in pose.position],
            )
            first = after


def positions(linkage: Linkage, pins: CrankPins, crank_angle: float) -> list[Position]:
    """Solve the closure condition at one crank angle.

    Where rounding leaves a doubt about a root, all are found anew in whole numbers.

    Raises:
        SelfMotionError: if the platform can move while the cranks stand still.
    """
    condition = closure(linkage, pins)
    if special_pins(linkage, pins, condition):
        if _assembles_somewhere(linkage, pins, condition):
            raise SelfMotionError(crank_angle)
        return []
    roots = None
    if not condition.noisy:
        roots = real_roots(condition.polynomial, ROUNDING_ERROR * condition.scale)
    if roots is None:
        return exact_positions(linkage, pins)
    found: list[Position] = []
    largest_gap = RESIDUAL * linkage.size * min(linkage.rods)
    ends = [*roots[-1:], *roots, *roots[:1]]
    steps = [(after - before) % math.tau for before, after in itertools.pairwise(ends)]
    for angle, apart in zip(roots, map(min, steps, steps[1:])):
        z = direction(angle)
        v, sure = _rod_vector(linkage, pins, condition, z)
        position = refined(linkage, pins, position_of(linkage, pins, z, v), 3)
        sure &= abs(position.z - z) <= LONGEST_CORRECTION * apart
        if not (sure and position.gap <= largest_gap):
            return exact_positions(linkage, pins)
        found.append(position)
    return found


def _rod_vector(
    linkage: Linkage, pins: CrankPins, condition: Closure, z: Number
) -> tuple[Number, Number]:
    """Vector of rod A at a root ``z`` of F, and whether D is sure; numbers or arrays alike."""
    w_b = z * linkage.platform_b - (pins.b - pins.a)
    w_c = z * linkage.platform_c - (pins.c - pins.a)
    determinant = condition.determinant.at(z)
    least = DEGENERATE * linkage.unit**2 * linkage.reach
    sure = (abs(determinant) > least * abs(w_b)) & (abs(determinant) > least * abs(w_c))
    # Only the direction is needed: its length is that of rod A, its sense that of D.
    v = (condition.product_b.at(z) * w_c - condition.product_c.at(z) * w_b) * (-1j * determinant)
    return v * (linkage.rods[0] / (abs(v) + _NEARLY_ZERO)), sure


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
    inverse = 1.0 / jacobian.determinant if jacobian.determinant else math.inf
    origin, joints, velocity, turn_rate, gaps = motion(linkage, pins, z, v, jacobian, inverse)
    return FMechanismPose(
        crank_angle,
        wrapped(cmath.phase(z)),
        _point(origin),
        (_point(pins.a), _point(pins.b), _point(pins.c)),
        (_point(joints[0]), _point(joints[1]), _point(joints[2])),
        turn_rate,
        _point(velocity),
        max(gaps),
        singularity(linkage, jacobian),
        double,
    )


def _point(number: complex) -> Point:
    return number.real, number.imag


# All positions of the moving triangle at many crank angles at once.
#
# Rows in which rounding leaves a doubt, or the platform can move by itself, are rare, and are
# solved one by one.

# Rows solved together: their samples fit into the processor's cache.
_CHUNK = 1024
# What a position and its row in a batch have in common.
_COLUMNS = ("angle", "position", "angular_velocity", "velocity", "residual", "singularity")


def solve_batch(linkage: Linkage, crank_angles: FloatArray) -> FMechanismPoses:
    """All positions at the given crank angles, shape (n,) [rad]."""
    n = len(crank_angles)
    shapes = {name: (n, 6, 2) if name in ("position", "velocity") else (n, 6) for name in _COLUMNS}
    result = FMechanismPoses(
        crank_angles=crank_angles,
        counts=np.zeros(n, dtype=np.int64),
        self_motion=np.zeros(n, dtype=np.bool_),
        linkage=linkage,
        **{name: np.full(shape, np.nan) for name, shape in shapes.items()},
    )
    for first in range(0, n, _CHUNK):
        special = _solve_chunk(linkage, crank_angles[first : first + _CHUNK], result, first)
        for row in (first + np.flatnonzero(special)).tolist():
            _solve_row(linkage, result, row)
    return result


def _solve_chunk(linkage: Linkage, angles: FloatArray, result: FMechanismPoses, first: int) -> Mask:
    """Write the positions of ordinary rows to ``result``; return which rows are special."""
    pins = pins_at(linkage, linkage.crank_angles(angles))
    condition = closure(linkage, pins)
    special: Mask = special_pins(linkage, pins, condition) | condition.noisy
    row, roots = simple_roots(condition.polynomial, ROUNDING_ERROR * condition.scale, special)
    linear = (condition.product_b, condition.product_c, condition.determinant)
    m_b, m_c, determinant = (Linear(*(part[row] for part in each)) for each in linear)
    condition = condition._replace(product_b=m_b, product_c=m_c, determinant=determinant)
    pins = CrankPins(*(part[row] for part in pins))
    z = direction(roots)
    v, sure = _rod_vector(linkage, pins, condition, z)
    with np.errstate(divide="ignore", invalid="ignore"):
        swing, turn = newton_step(rod_jacobian(linkage, pins, z, v))
        at = states(linkage, pins, z * rotation(turn), v * rotation(swing))
    # To the next root of the row, or the most that there can be.
    steps = np.full(len(row) + 1, np.pi)
    steps[1:-1] = np.where(row[1:] == row[:-1], np.diff(roots), np.pi)
    sure &= abs(turn) <= LONGEST_CORRECTION * np.minimum(steps[:-1], steps[1:])
    special[row[~(sure & (at.residual <= RESIDUAL * linkage.size))]] = True

    ordinary = np.flatnonzero(~special[row])
    ordinary = ordinary[row_order(row[ordinary], at.angle[ordinary])]
    row = row[ordinary]
    counts = np.bincount(row, minlength=len(angles))
    slot = np.arange(len(row)) - (np.cumsum(counts) - counts)[row]
    result.counts[first : first + len(angles)] = counts
    for name in _COLUMNS:
        getattr(result, name)[first + row, slot] = getattr(at, name)[ordinary]
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
        for name in _COLUMNS:
            getattr(result, name)[row, slot] = getattr(pose, name)
