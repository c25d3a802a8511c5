"""All positions of the moving triangle at given crank angles."""

from __future__ import annotations

import cmath
import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

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
    rods_on_line,
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
# A chart that is half a turn of the platform, |tan(phi / 2)| <= 1, is searched a little beyond, so
# that no pair of roots is parted, and its roots count to where those of the other chart begin.
_BEYOND = _ONE + (_ONE >> 4)
_KEPT = _ONE + (_ONE >> 40)
# An arc of platform angles no wider than this to each side of its middle lies in one chart [rad].
_WIDEST_ARC = 0.5
# Part of the linkage's size that widens the square of an arc, whose ends rounding may cut off.
_ARC_ROUNDING = 1e-9
# Both charts may give one position, on their border.
_SAME = 1e-9
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


class _Chart:
    """The closure condition over half a turn of the platform, by t = tan(phi / 2).

    In the second chart the platform is turned by half a turn, so that phi is counted from there.
    Everything is multiplied by powers of 1 + t^2, which make it a polynomial.
    """

    def __init__(
        self, arms: tuple[_Vector, _Vector], ways: tuple[_Vector, _Vector], rods: tuple[int, ...]
    ) -> None:
        """Form the polynomials from d_b, d_c (``arms``), e_b, e_c (``ways``) and the rods."""
        (d_b, d_c), (e_b, e_c) = arms, ways
        square_a, square_b, square_c = (rod * rod for rod in rods)
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

    def rod_vector(self, place: int) -> tuple[complex, float]:
        """Vector v of rod A, and how far w_b and w_c are from parallel; infinite where they are."""
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
        return v, abs(cross) * norm / (largest * largest << _PLACE_BITS)


def exact_positions(linkage: Linkage, pins: CrankPins) -> list[Position]:
    """All positions; those that coincide to rounding are one, which is ``double``.

    It is for crank pins at which the closure condition does not vanish for all platform angles.
    """
    digits = _BITS - math.frexp(linkage.size)[1]
    rods = tuple(_whole(rod, digits) for rod in linkage.rods)
    vectors = (linkage.platform_b, linkage.platform_c, pins.b - pins.a, pins.c - pins.a)
    d_b, d_c, e_b, e_c = (
        _Vector(_whole(vector.real, digits), _whole(vector.imag, digits)) for vector in vectors
    )
    found: list[Position] = []
    for span in _spans(linkage, pins):
        arms = tuple(_Vector(span.sense * d.x, span.sense * d.y) for d in (d_b, d_c))
        search = _Search(linkage, pins, _Chart((arms[0], arms[1]), (e_b, e_c), rods), span, digits)
        for position in search.positions():
            _add(linkage, found, position, _SAME)
    return found


class _Span(NamedTuple):
    """The part of a chart that is searched.

    Attributes:
        sense: +1, or -1 where phi is counted from half a turn.
        low: first place.
        high: last place.
        kept: largest place that counts.
    """

    sense: int
    low: int
    high: int
    kept: int


def _spans(linkage: Linkage, pins: CrankPins) -> list[_Span]:
    """The range to be searched: the circle, or the narrow arc in which the rods allow positions.

    Two platform joints are as far from each other as their pins but for both rods, so the platform
    has turned from there by no more than an arc, which the law of cosines gives.
    """
    arms = 0j, linkage.platform_b, linkage.platform_c
    ways = 0j, pins.b - pins.a, pins.c - pins.a
    narrowest, middle = math.inf, 0.0
    for i, j in ((0, 1), (0, 2), (1, 2)):
        arm, way = arms[j] - arms[i], ways[j] - ways[i]
        reach, gap = linkage.rods[i] + linkage.rods[j], abs(abs(arm) - abs(way))
        product = abs(arm) * abs(way)
        allowed = reach * (reach + _ARC_ROUNDING * linkage.size) - gap * gap
        if allowed < narrowest * product:
            narrowest, middle = allowed / product, cmath.phase(way * arm.conjugate())
    if narrowest < 0.0:
        return []
    half = math.asin(min(1.0, 0.5 * math.sqrt(narrowest))) * 2.0
    if not half <= _WIDEST_ARC:
        return [_Span(sense, -_BEYOND, _BEYOND, _KEPT) for sense in (1, -1)]
    sense = 1 if math.cos(middle) >= 0.0 else -1
    middle = math.remainder(middle if sense == 1 else middle + math.pi, math.tau)
    low, high = (
        int(math.ldexp(math.tan(0.5 * angle), _PLACE_BITS))
        for angle in (middle - half, middle + half)
    )
    return [_Span(sense, low, high, max(-low, high))]


class _Search:
    """The positions in one chart."""

    def __init__(
        self, linkage: Linkage, pins: CrankPins, chart: _Chart, span: _Span, digits: int
    ) -> None:
        self.linkage = linkage
        self.pins = pins
        self.chart = chart
        self.span = span
        self.digits = digits
        self.closes = CLOSES * linkage.size

    def positions(self) -> list[Position]:
        """Roots of the condition between its extrema, and those extrema that close to rounding."""
        condition = self.chart.condition
        slope = _derivative(condition)
        extrema = _roots(slope, self.span)
        found: list[Position] = []
        folds: list[Position] = []
        low, kept = self.span.low, self.span.kept
        positive = _value(condition, low) >= 0
        for place in (*extrema, self.span.high):
            fold = self._fold(place) if place < self.span.high else None
            if fold:
                folds.append(fold)
                continue
            if (_value(condition, place) >= 0) != positive:
                root = _root(condition, slope, low, place, positive)
                positive = not positive
                if abs(root) <= kept:
                    found += self._at_root(root, bool(folds))
            elif folds:
                found.append(min(folds, key=lambda position: position.gap))
            low, folds = place, []
        for place in extrema:
            if abs(place) <= kept and self.chart.rod_vector(place)[1] <= _PARALLEL:
                for position in self._on_line(place):
                    _add(self.linkage, found, position, _SAME_POSITION)
        return found

    def _direction(self, place: int) -> complex:
        """Direction z of the platform."""
        return self.span.sense * rotation(2.0 * (place / _ONE))

    def _rod_vector(self, place: int) -> complex | None:
        """Vector v of rod A [m]; None if its length is not that of the rod."""
        v, _ = self.chart.rod_vector(place)
        v *= math.ldexp(1.0, -self.digits)
        return v if abs(abs(v) - self.linkage.rods[0]) <= _NEAR * self.linkage.rods[0] else None

    def _at_root(self, place: int, double: bool) -> list[Position]:
        """The position at a root; both where the rod vectors of two share its platform angle."""
        v = self._rod_vector(place)
        if v is None:
            return self._on_line(place)
        v *= self.linkage.rods[0] / abs(v)
        return [position_of(self.linkage, self.pins, self._direction(place), v, double)]

    def _fold(self, place: int) -> Position | None:
        """The position at an extremum of the condition if it closes to rounding there."""
        v = self._rod_vector(place) if abs(place) <= self.span.kept else None
        if v is None:
            return None
        position = _settled(self.linkage, self.pins, self._direction(place), v)
        return position if residual(self.linkage, self.pins, position) <= self.closes else None

    def _on_line(self, place: int) -> list[Position]:
        """Positions where w_b and w_c are parallel, on the line that both equations are there."""
        linkage, pins, z = self.linkage, self.pins, self._direction(place)
        w_b = z * linkage.platform_b - (pins.b - pins.a)
        w_c = z * linkage.platform_c - (pins.c - pins.a)
        w, rod = (w_b, linkage.rods[1]) if abs(w_b) >= abs(w_c) else (w_c, linkage.rods[2])
        m = 0.5 * ((rod - linkage.rods[0]) * (rod + linkage.rods[0]) - abs(w) ** 2)
        candidates = rods_on_line(linkage, w, m)
        found = []
        for v in candidates:
            start = position_of(linkage, pins, z, v, len(candidates) == 1)
            position = refined(linkage, pins, start, 20)
            near = abs(position.z - z) < _LONGEST_CORRECTION
            if near and residual(linkage, pins, position) <= self.closes:
                found.append(position)
        return found


def _add(linkage: Linkage, found: list[Position], position: Position, same: float) -> None:
    """Add a position if it is not among those that were ``found`` before."""
    if not any(
        abs(position.z - other.z) < same and abs(position.v - other.v) < same * linkage.rods[0]
        for other in found
    ):
        found.append(position)


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


def _whole(length: float, digits: int) -> int:
    return int(math.ldexp(length, digits))


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


def _roots(p: Polynomial, span: _Span) -> list[int]:
    """Places where a polynomial changes its sign: between its extrema it does so once or never."""
    if len(p) < 2:
        return []
    slope = _derivative(p)
    places = [span.low, *_roots(slope, span), span.high]
    signs = [_value(p, place) >= 0 for place in places]
    return [
        _root(p, slope, low, high, positive)
        for low, high, positive, after in zip(places, places[1:], signs, signs[1:])
        if positive != after
    ]


def _root(p: Polynomial, slope: Polynomial, low: int, high: int, positive: bool) -> int:
    """A change of sign between two places, by Newton's method or halving; ``positive`` below it."""
    place = (low + high) >> 1
    while high - low > 1:
        value, steepness = _value(p, place), _value(slope, place)
        if (value >= 0) == positive:
            low = place
        else:
            high = place
        following = place - (value << _PLACE_BITS) // steepness if steepness else low
        if abs(following - place) <= 1:
            break
        place = following if low < following < high else (low + high) >> 1
    return place
