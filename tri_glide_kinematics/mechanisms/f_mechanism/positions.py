"""All positions of the moving triangle at given crank angles."""

from __future__ import annotations

import cmath
import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.equal_numbers import first_largest, wrapped
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms.f_mechanism.closure import (
    NODES,
    ROUNDING_ERROR,
    Closure,
    Linear,
    Mask,
    closure,
    derivatives,
    real_roots,
    row_order,
    simple_roots,
)
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
        double: likewise, shape (n, 6).
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
    double: NDArray[np.bool_]
    self_motion: NDArray[np.bool_]
    linkage: Linkage

    def pose(self, row: int, slot: int) -> FMechanismPose:
        """One position by itself.

        Raises:
            IndexError: if ``slot`` is not below ``counts[row]``.
        """
        if not 0 <= slot < self.counts[row]:
            raise IndexError(f"slot {slot} has no position: row {row} has {self.counts[row]}")
        columns = self.angle, self.position, self.double
        angle, position, double = (column[row, slot].tolist() for column in columns)
        return pose_at(self.linkage, float(self.crank_angles[row]), angle, position, double)

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
# Coordinates that differ by less are one, relative to the size.
_EQUAL_PLACES = 1e-6
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
    return tuple(sorted(poses, key=functools.cmp_to_key(functools.partial(_order, linkage.size))))


def _order(size: float, pose: FMechanismPose, other: FMechanismPose) -> int:
    """Below zero if a pose comes before another one: by angle, and by place where that is equal."""
    place = _EQUAL_PLACES * size
    pairs = zip((pose.angle, *pose.position), (other.angle, *other.position))
    differences = zip(pairs, (_EQUAL_ANGLES, place, place))
    return next((1 if p > q else -1 for (p, q), equal in differences if abs(p - q) > equal), 0)


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
    steps = [(after - before) % math.tau for before, after in zip(roots[-1:] + roots, roots)]
    longest_correction = LONGEST_CORRECTION * min(steps, default=0.0)
    for angle in roots:
        z = direction(angle)
        v, sure = _rod_vector(linkage, pins, condition, z)
        position = refined(linkage, pins, position_of(linkage, pins, z, v), 3)
        sure &= abs(position.z - z) <= longest_correction
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


def pose_at(
    linkage: Linkage, crank_angle: float, angle: float, origin: Point, double: bool = False
) -> FMechanismPose:
    """One position by its platform angle [rad] and the origin of the platform frame [m]."""
    pins, z = pins_at(linkage, linkage.crank_angles(crank_angle)), direction(angle)
    v = complex(*origin) + z * linkage.joints[0] - pins.a
    return pose_of(linkage, pins, crank_angle, position_of(linkage, pins, z, v, double))


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
        double=np.zeros((n, 6), dtype=np.bool_),
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
        for name in (*_COLUMNS, "double"):
            getattr(result, name)[row, slot] = getattr(pose, name)


# All positions at one crank angle in whole numbers: for what rounding would blur.
#
# The lengths become whole numbers of a unit far below their rounding. Then the closure condition, a
# polynomial in tan(phi / 2), is exact, and so is its sign at each place: neither the number of its
# roots nor the rod vectors at them depend on how well it is conditioned.

# A position closes to rounding if no rod is wrong by more than this, relative to the size.
CLOSES = 64.0 * float(np.finfo(np.float64).eps)

# Lengths are multiples of the size times 2^-_BITS, about; places those of 2^-_PLACE_BITS.
_BITS = 100
_PLACE_BITS = 128
_ONE = 1 << _PLACE_BITS
# Two positions may share a platform angle if the angle between w_b and w_c is below the first
# number. A position found there by Newton's method, which corrects the angle by no more than the
# second number, is the same as another one if it lies no farther from it than the third.
_PARALLEL = 1e-6
_LONGEST_CORRECTION = 1e-4
_SAME_POSITION = 1e-7
# A place at which rod A is wrong by more than this part does not belong to a fold.
_NEAR = 1e-3
# Steps to the position whose rods deviate least, from a place next to it.
_SETTLING = 2

# Coefficients, whole numbers of any size, ascending by power.
Polynomial = NDArray[np.object_]


class _Vector(NamedTuple):
    """A plane vector of whole numbers, with the products of complex numbers."""

    x: int
    y: int

    def turned(self, other: _Vector) -> _Vector:
        """Conjugate of this one times ``other``: the scalar and the cross product."""
        return _Vector(
            self.x * other.x + self.y * other.y,
            self.x * other.y - self.y * other.x,
        )


# Eight vectors of whole numbers of one length, more than the closure condition has roots.
_LENGTH = 5
_TURNS = [_Vector(x, y) for x, y in ((5, 0), (0, 5), (-5, 0), (0, -5))]
_TURNS += [_Vector(x, y) for x, y in ((3, 4), (-4, 3), (-3, -4), (4, -3))]


class _WholeClosure:
    """The closure condition by t = tan(phi / 2), a polynomial of whole numbers.

    phi is counted from where the condition is far from zero half a turn away, so that no root is at
    infinity. Everything is multiplied by powers of 1 + t^2, which make it a polynomial.
    """

    def __init__(self, linkage: Linkage, pins: CrankPins) -> None:
        """Form the polynomials from d_b, d_c (``arms``), e_b, e_c (``ways``) and the rods."""
        digits = _BITS - math.frexp(linkage.size)[1]

        def whole(length: float) -> int:
            return int(math.ldexp(length, digits))

        def vector(point: complex, turn: _Vector) -> _Vector:
            return turn.turned(_Vector(whole(point.real), whole(point.imag)))

        polynomial = closure(linkage, pins).polynomial
        opposite = [-complex(turn.x, -turn.y) / _LENGTH for turn in _TURNS]
        turn = _TURNS[first_largest([abs(derivatives(polynomial, z)[0]) for z in opposite])]
        self.start = complex(turn.x, -turn.y) / _LENGTH
        self.unit = math.ldexp(1.0, -digits) / _LENGTH
        square_a, square_b, square_c = ((_LENGTH * whole(rod)) ** 2 for rod in linkage.rods)
        d_b, d_c = arms = vector(linkage.platform_b, turn), vector(linkage.platform_c, turn)
        e_b, e_c = ways = vector(pins.b - pins.a, _TURNS[0]), vector(pins.c - pins.a, _TURNS[0])
        s_b, s_c = square_b - square_a, square_c - square_a
        turn_b, turn_c = e_b.turned(d_b), e_c.turned(d_c)
        cross_bc, cross_cb = e_c.turned(d_b), e_b.turned(d_c)
        both = d_b.turned(d_c)
        both = _Vector(*(p + q for p, q in zip(both, e_b.turned(e_c))))
        b0 = s_b - d_b.turned(d_b).x - e_b.turned(e_b).x
        c0 = s_c - d_c.turned(d_c).x - e_c.turned(e_c).x
        # Twice m_b, m_c and m_b + m_c + w_b . w_c; once D.
        self.product_b = _linear(b0, 2 * turn_b.x, 2 * turn_b.y)
        self.product_c = _linear(c0, 2 * turn_c.x, 2 * turn_c.y)
        rest = _linear(
            b0 + c0 + 2 * both.x,
            2 * (turn_b.x + turn_c.x - cross_bc.x - cross_cb.x),
            2 * (turn_b.y + turn_c.y - cross_bc.y - cross_cb.y),
        )
        self.determinant = _linear(both.y, cross_bc.y - cross_cb.y, cross_cb.x - cross_bc.x)
        m_b, m_c, determinant = self.product_b, self.product_c, self.determinant
        squares = s_c * np.convolve(m_b, m_b) + s_b * np.convolve(m_c, m_c)
        squares -= 4 * square_a * np.convolve(determinant, determinant)
        self.condition = np.convolve([1, 0, 1], squares)
        self.condition -= np.convolve(np.convolve(m_b, m_c), rest)
        # The coordinates of w_k = z d_k - e_k.
        self.ways = [
            part
            for d, e in zip(arms, ways)
            for part in (_linear(-e.x, d.x, d.y), _linear(-e.y, d.y, -d.x))
        ]

    def direction(self, place: int) -> complex:
        """Direction z of the platform."""
        return self.start * rotation(2.0 * (place / _ONE))

    def rod_vector(self, place: int) -> tuple[complex, float]:
        """Vector v of rod A [m], and how far w_b and w_c are from parallel; there v is infinite."""
        m_b, m_c, cross, b_x, b_y, c_x, c_y = (
            _value(polynomial, place)
            for polynomial in (self.product_b, self.product_c, self.determinant, *self.ways)
        )
        if not cross:
            return complex(math.inf), 0.0
        norm = _ONE + (place * place >> _PLACE_BITS)
        below = 2 * norm * cross
        v = complex(
            ((m_b * c_y - m_c * b_y) << _PLACE_BITS) / below,
            ((m_c * b_x - m_b * c_x) << _PLACE_BITS) / below,
        )
        largest = max(abs(b_x), abs(b_y), abs(c_x), abs(c_y))
        return self.unit * v, abs(cross) * norm / (largest * largest << _PLACE_BITS)


def exact_positions(linkage: Linkage, pins: CrankPins) -> list[Position]:
    """All positions; those that coincide to rounding are one, which is ``double``.

    They are at the roots of the condition between its extrema, and at those extrema that close to
    rounding. It is for crank pins at which the condition does not vanish for all platform angles.
    """
    whole = _WholeClosure(linkage, pins)
    condition = whole.condition
    slope = _derivative(condition)
    # Cauchy's bound of all roots, and so of those of the derivatives.
    end = (2 + max(map(abs, condition)) // abs(condition[-1])) << _PLACE_BITS
    extrema = _roots(slope, end)
    places = [-end, *extrema, end]
    values = [_value(condition, place) for place in places]
    parallel = [
        place
        for before, at, after, place in zip(values, values[1:], values[2:], extrema)
        if _turns_back(before, at, after) and whole.rod_vector(place)[1] <= _PARALLEL
    ]
    found: list[Position] = []
    folds: list[Position] = []
    low, positive = -end, values[0] >= 0
    for place, value in zip(places[1:], values[1:]):
        fold = _at_place(linkage, pins, whole, place)
        if fold:
            position = _settled(linkage, pins, *fold)
            if residual(linkage, pins, position) <= CLOSES * linkage.size:
                folds.append(position)
                continue
        if (value >= 0) != positive:
            root = _root(condition, slope, low, place, positive)
            positive = not positive
            at_root = _at_place(linkage, pins, whole, root)
            if at_root:
                found.append(position_of(linkage, pins, *at_root, bool(folds)))
            else:
                parallel.append(root)
        elif folds:
            found.append(min(folds, key=lambda position: position.gap))
        low, folds = place, []
    for place in parallel:
        for position in _on_line(linkage, pins, whole.direction(place)):
            if not any(_same(linkage, position, other) for other in found):
                found.append(position)
    return found


def _turns_back(before: int, at: int, after: int) -> bool:
    """Whether an extremum comes nearer to zero than its neighbours, and stays on their side of it.

    An extremum beyond zero has a root on each side, where its positions are found one by one.
    """
    return (before >= 0) == (at >= 0) == (after >= 0) and abs(at) < min(abs(before), abs(after))


def _at_place(
    linkage: Linkage, pins: CrankPins, whole: _WholeClosure, place: int
) -> tuple[complex, complex] | None:
    """Direction of the platform and vector of rod A; None if its length is not that of the rod."""
    v, _ = whole.rod_vector(place)
    length = linkage.rods[0]
    if not abs(abs(v) - length) <= _NEAR * length:
        return None
    return whole.direction(place), v * (length / abs(v))


def _on_line(linkage: Linkage, pins: CrankPins, z: complex) -> list[Position]:
    """Positions where w_b and w_c are parallel, and both equations one line v . w = m.

    It meets the circle |v| = l_a in two points, or touches it in one.
    """
    w_b = z * linkage.platform_b - (pins.b - pins.a)
    w_c = z * linkage.platform_c - (pins.c - pins.a)
    radius = linkage.rods[0]
    w, rod = (w_b, linkage.rods[1]) if abs(w_b) >= abs(w_c) else (w_c, linkage.rods[2])
    if w == 0.0:
        return []
    foot = 0.5 * ((rod - radius) * (rod + radius) / abs(w) - abs(w))
    rest = (radius - foot) * (radius + foot)
    rounding = LENGTH_ROUNDING_ERROR * linkage.size * linkage.reach * radius / abs(w)
    sides = (math.sqrt(rest), -math.sqrt(rest)) if rest > rounding else (0.0,)
    found = []
    for side in sides:
        start = position_of(linkage, pins, z, complex(foot, side) * (w / abs(w)), len(sides) == 1)
        position = refined(linkage, pins, start, 20)
        closes = residual(linkage, pins, position) <= CLOSES * linkage.size
        if closes and abs(position.z - z) < _LONGEST_CORRECTION:
            found.append(position)
    return found


def _same(linkage: Linkage, position: Position, other: Position) -> bool:
    """Whether two positions are one that was found twice."""
    apart = abs(position.v - other.v) / linkage.rods[0]
    return max(abs(position.z - other.z), apart) < _SAME_POSITION


def residual(linkage: Linkage, pins: CrankPins, position: Position) -> float:
    """Largest deviation of a rod length [m]."""
    rods = _rod_vectors(linkage, pins, position.z, position.v)
    return max(abs(abs(rod) - length) for rod, length in zip(rods, linkage.rods))


def _rod_vectors(linkage: Linkage, pins: CrankPins, z: complex, v: complex) -> tuple[complex, ...]:
    return (
        v,
        v + (z * linkage.platform_b - (pins.b - pins.a)),
        v + (z * linkage.platform_c - (pins.c - pins.a)),
    )


def _settled(linkage: Linkage, pins: CrankPins, z: complex, v: complex) -> Position:
    """Position near (z, v) whose rod lengths deviate least, across the way in which it can move.

    At a fold that way is the one that the rods do not resist, and nothing changes along it.
    """
    radius = linkage.platform_radius
    arms = 0j, linkage.platform_b, linkage.platform_c
    for _ in range(_SETTLING):
        rods = _rod_vectors(linkage, pins, z, v)
        rows = []
        for rod, arm in zip(rods, arms):
            unit = rod / abs(rod) if rod else 1.0 + 0j
            moment = ((z * arm).conjugate() * unit).imag / radius
            rows.append((unit.real, unit.imag, moment))
        gaps = [abs(rod) - length for rod, length in zip(rods, linkage.rods)]
        left, strength, right = np.linalg.svd(rows)
        x, y, turn = -right[:2].T @ (left[:, :2].T @ gaps / strength[:2])
        v, z = v + complex(x, y), z * rotation(float(turn) / radius)
    return position_of(linkage, pins, z, v, True)


def _linear(constant: int, x: int, y: int) -> Polynomial:
    """``constant + Re((x + i y) z)`` times 1 + t^2."""
    return np.array([constant + x, -2 * y, constant - x], dtype=object)


def _derivative(p: Polynomial) -> Polynomial:
    return np.arange(1, len(p)) * p[1:]


def _value(p: Polynomial, place: int) -> int:
    """Value at a place, cut off after units."""
    value = 0
    for coefficient in p[::-1].tolist():
        value = (value * place >> _PLACE_BITS) + coefficient
    return value


def _roots(p: Polynomial, end: int) -> list[int]:
    """Places where a polynomial changes its sign: between its extrema it does so once or never."""
    if len(p) < 2:
        return []
    slope = _derivative(p)
    places = [-end, *_roots(slope, end), end]
    signs = [_value(p, place) >= 0 for place in places]
    return [
        _root(p, slope, low, high, positive)
        for low, high, positive, after in zip(places, places[1:], signs, signs[1:])
        if positive != after
    ]


def _root(p: Polynomial, slope: Polynomial, low: int, high: int, positive: bool) -> int:
    """A change of sign between two places; ``positive`` below it.

    By Newton's method, or halving where its steps do not become half as long each time.
    """
    place, step = (low + high) >> 1, high - low
    while high - low > 1:
        value, steepness = _value(p, place), _value(slope, place)
        if (value >= 0) == positive:
            low = place
        else:
            high = place
        longest = abs(step) >> 1
        step = -((value << _PLACE_BITS) // steepness) if steepness else high - low
        if abs(step) <= 1:
            break
        if abs(step) > longest or not low < place + step < high:
            step = ((low + high) >> 1) - place
        place += step
    return place
