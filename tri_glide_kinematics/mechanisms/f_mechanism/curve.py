"""The positions of an F-mechanism as a smooth curve over its drive, and the walk along it."""

from __future__ import annotations

import cmath
import enum
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import (
    Complex,
    Linkage,
    Number,
    RodJacobian,
    direction,
    pins_at,
    rod_jacobian,
)
from tri_glide_kinematics.vectors import (
    FloatArray,
    Vector3,
    combined,
    cross,
    dot,
    minus,
    scaled,
    three,
)

# The positions of an F-mechanism as a smooth curve over its drive.
#
# A point of the curve is x = (direction of rod A, platform angle, drive), all in [rad]. Rod A keeps
# its length by itself; the two other rod equations g_b(x) = g_c(x) = 0 define the curve. Both are
# sums of cosines of linear functions of x, so all their derivatives have bounds that hold
# everywhere. With them a ball about a point of the curve is found in which the curve is one arc:
# whatever solution lies in that ball is on the same branch.

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
    they become shifts across it, and their derivatives compare with one.

    Attributes:
        x: the point.
        tangent: unit tangent, oriented by the cross product of the gradients.
        curvature: second derivative of the curve by the tangential coordinate.
        along: size of the second derivatives along the curve, which is that of the curvature.
        mixed: size of the mixed second derivatives.
        across: size of the second derivatives across the curve; its inverse tells how far away
            another branch may be.
        third: bound of the third derivatives everywhere.
    """

    x: Vector3
    tangent: Vector3
    curvature: Vector3
    along: float
    mixed: float
    across: float
    third: float


class Curve:
    """The rod equations of one mechanism along one drive."""

    def __init__(self, linkage: Linkage, drive: Drive) -> None:
        """Write the rod equations as sums of cosines."""
        self.linkage = linkage
        self.drive = drive
        a0, b0, c0 = linkage.pivots
        # Nothing depends on where the mechanism lies, and far away digits would be lost.
        self._centred = replace(linkage, pivots=(0j, b0 - a0, c0 - a0))
        products, waves = zip(*(self._cosines(rod) for rod in (1, 2)))
        self._products, self._waves = np.array(products), np.array(waves)
        thirds = abs(self._products) * np.linalg.norm(self._waves, axis=2) ** 3
        self._third_b, self._third_c = thirds.sum(axis=1).tolist()
        self._tolerance = linkage.size * min(
            ON_CURVE * linkage.size, _ON_CURVE_OF_SHORT_RODS * linkage.reach
        )

    def _cosines(self, rod: int) -> tuple[Complex, FloatArray]:
        """A rod equation as a constant and the sum of ``Re(product exp(i wave . x))``.

        Its rod is the sum of five vectors, each of which turns with x, so that half its square has
        ten products of two of them. Shapes (10,) [m^2], (10, 3).
        """
        linkage, rates = self._centred, self.drive.rates
        cranks = np.multiply(linkage.cranks, direction(np.array(self.drive.start)))
        platform = linkage.joints[rod] - linkage.joints[0]
        vectors = np.array(
            [linkage.rods[0], platform, -linkage.pivots[rod], cranks[0], -cranks[rod]]
        )
        turns = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 0), (0, 0, rates[0]), (0, 0, rates[rod])])
        first, second = np.triu_indices(5, 1)
        return vectors[first] * vectors[second].conj(), turns[first] - turns[second]

    def gradients(self, x: Vector3) -> RodJacobian:
        """Rod equations and their gradients; ``drive`` is s."""
        alpha, phi, s = x
        pins = pins_at(self._centred, self.drive.crank_angles(s), self.drive.rates)
        v, z = cmath.rect(self.linkage.rods[0], alpha), cmath.rect(1.0, phi)
        return rod_jacobian(self._centred, pins, z, v)

    def hessians(self, x: Vector3) -> FloatArray:
        """Second derivatives of both rod equations, shape (2, 3, 3)."""
        waves = self._waves
        cosines = (self._products * np.exp(1j * (waves @ x))).real[:, np.newaxis]
        hessians: FloatArray = -(cosines * waves.swapaxes(1, 2)) @ waves
        return hessians

    def frame(self, x: Vector3, at: RodJacobian | None = None) -> Frame | None:
        """Tangent, normals and bounds at a point of the curve; None where it is singular."""
        at = self.gradients(x) if at is None else at
        scale = self.linkage.unit**2
        b, c = scaled(at.b, scale), scaled(at.c, scale)
        normal = cross(b, c)
        size = math.sqrt(dot(normal, normal))
        if size == 0.0:
            return None
        tangent = scaled(normal, 1.0 / size)
        # The shifts across the curve that one of both equations takes, the other one being kept.
        shift_b = scaled(cross(c, tangent), scale / size)
        shift_c = scaled(cross(tangent, b), scale / size)
        bends = np.array((shift_b, shift_c)).T @ self.hessians(x).reshape(2, 9)
        images = bends.reshape(3, 3, 3) @ tangent
        turn_x, turn_y, turn_z = (images @ tangent).tolist()
        along = turn_x * turn_x + turn_y * turn_y + turn_z * turn_z
        mixed = float(np.vdot(images, images)) - along
        across = float(np.vdot(bends, bends)) - along - 2.0 * mixed
        third = self._third_b * math.sqrt(dot(shift_b, shift_b))
        third += self._third_c * math.sqrt(dot(shift_c, shift_c))
        return Frame(
            x,
            tangent,
            (-turn_x, -turn_y, -turn_z),
            math.sqrt(along),
            math.sqrt(max(mixed, 0.0)),
            math.sqrt(max(across, 0.0)),
            third,
        )

    def correct(self, frame: Frame, h: float) -> tuple[Vector3, RodJacobian] | None:
        """Point of the curve in the plane at the tangential coordinate ``h`` of ``frame``."""
        x = combined(1.0, ahead(frame, h), 0.5 * h * h, frame.curvature)
        for _ in range(_ITERATIONS):
            at = self.gradients(x)
            if max(abs(at.gap_b), abs(at.gap_c)) <= self._tolerance:
                return x, at
            determinant = dot(cross(at.b, at.c), frame.tangent)
            if determinant == 0.0:
                return None
            shift_b, shift_c = cross(at.c, frame.tangent), cross(frame.tangent, at.b)
            step = combined(at.gap_b / determinant, shift_b, at.gap_c / determinant, shift_c)
            x = minus(x, step)
            if dot(step, step) < 1e-30:
                return x, at
        return None


def ahead(frame: Frame, h: float) -> Vector3:
    """Point on the tangent of ``frame`` at ``h``."""
    return combined(1.0, frame.x, h, frame.tangent)


# Follow one branch of the curve of positions, arc by arc, without ever leaving it.

# How far the curve of positions is proven to be one arc: a tube about its tangent.

# Change of the Jacobian that a tube allows at most; must stay below one.
LARGEST_CHANGE = 0.7
# Radius of a tube, as a multiple of the deviation of the curve from its tangent.
TUBE_WIDTH = 3.0
# Least part to which the length of a tube is reduced where two turning points merge.
SHORTEST_TUBE = 1e-3


class Tube(NamedTuple):
    """A cylinder about the tangent in which the curve is one arc from end to end.

    Attributes:
        length: along the tangent.
        radius: across it.
        sure: whether it is proven that the drive reverses at most once in it.
    """

    length: float
    radius: float
    sure: bool


def tube(frame: Frame, longest: float) -> Tube:
    """Longest tube about the tangent of ``frame`` in which the curve is proven to be one arc.

    In a tube of length h and radius r the Jacobian across the curve deviates from the identity by
    no more than

        change = mixed h + across r + third (h^2 + r^2) / 2.

    Below one this makes the solution at each tangential coordinate unique. The slope of the arc is
    at most

        slope = (along h + mixed r + third (h^2 + r^2) / 2) / (1 - change),

    and its integral below r keeps the arc inside. The drive does not reverse while the slope is
    less than the slope of the tangent against planes of constant drive. Beside a turning point the
    second derivative of the drive keeps its sign instead, so that it reverses at most once.
    """
    across_drive = math.hypot(frame.tangent[0], frame.tangent[1])
    bend = abs(frame.curvature[2])
    length = min(
        longest,
        0.5 / (frame.mixed + 1e-300),
        math.sqrt(0.4 / (frame.across * frame.along + 1e-300)),
        math.sqrt(1.0 / (frame.third + 1e-300)),
    )
    widest = None
    while widest is None or length > SHORTEST_TUBE * widest.length:
        radius = TUBE_WIDTH * length * length * (0.5 * frame.along + length * frame.third / 6.0)
        square = length * length + radius * radius
        change = frame.mixed * length + frame.across * radius + 0.5 * frame.third * square
        drift = 0.5 * frame.along * length + frame.mixed * radius
        drift += frame.third * (length * length / 6.0 + 0.5 * radius * radius)
        if change < LARGEST_CHANGE and length * drift <= (1.0 - change) * radius:
            widest = widest or Tube(length, radius, False)
            slope = frame.along * length + frame.mixed * radius + 0.5 * frame.third * square
            slope /= 1.0 - change
            variation = (
                frame.third * math.sqrt(square) * (1.0 + slope * slope)
                + 2.0 * frame.mixed * slope
                + frame.across * slope * slope
                + change * frame.along
            ) / (1.0 - change)
            runs_on = slope * across_drive < abs(frame.tangent[2])
            if runs_on or variation * across_drive < bend:
                return Tube(length, radius, True)
        length *= 0.8
    return widest._replace(length=length)


# Singular places of the curve of positions: turning points and bifurcations.


# Bounds of loops that end by their tolerance before, but for rounding.
_BISECTIONS = 80
_BIFURCATION_STEPS = 30
# Residual of the bifurcation equations, lengths relative to the size, that counts as zero.
_EXACT = 1e-11


def zero_on_arc(
    curve: Curve,
    frame: Frame,
    near: Vector3,
    ends: tuple[float, float],
    values: tuple[float, float],
    function: Callable[[Vector3, RodJacobian], float],
) -> Vector3:
    """The point of an arc at which a function of the point and its gradients is zero.

    Args:
        curve: the curve.
        frame: in whose tube the arc lies.
        near: the end that is next to the point, which it is if the arc cannot be divided.
        ends: tangential coordinates of the ends of the arc.
        values: of the function there.
        function: rises all along the arc, or falls.
    """
    (low, high), (at_low, at_high) = ends, values
    rising = at_high > at_low
    x = near
    for _ in range(_BISECTIONS):
        if abs(high - low) < 1e-15:
            break
        spread = at_low - at_high
        h = low + (high - low) * at_low / spread if spread else low
        if not min(low, high) < h < max(low, high):
            h = 0.5 * (low + high)
        corrected = curve.correct(frame, h)
        if corrected is None:
            break
        x, value = corrected[0], function(*corrected)
        # Halving the value at the end that stays (Illinois) keeps the secant from creeping.
        if (value < 0.0) == rising:
            low, at_low, at_high = h, value, 0.5 * at_high
        else:
            high, at_high, at_low = h, value, 0.5 * at_low
    return x


def find_bifurcation(curve: Curve, start: Vector3, reach: float) -> Vector3 | None:
    """The point within ``reach`` of ``start`` where the gradients are dependent, or None.

    A branch that merely passes close by another has no such point: the equations, five for four
    unknowns, then have no solution.
    """
    scale = curve.linkage.size**2
    x = np.array(start)
    at = curve.gradients(start)
    left = np.linalg.svd(np.array([at.b, at.c]))[0][:, -1]
    mix = math.atan2(left[1], left[0])
    for _ in range(_BIFURCATION_STEPS):
        point = (float(x[0]), float(x[1]), float(x[2]))
        at = curve.gradients(point)
        h_b, h_c = curve.hessians(point) / scale
        b, c = np.array(at.b) / scale, np.array(at.c) / scale
        cosine, sine = math.cos(mix), math.sin(mix)
        residual = np.concatenate([[at.gap_b / scale, at.gap_c / scale], cosine * b + sine * c])
        jacobian = np.zeros((5, 4))
        jacobian[0, :3], jacobian[1, :3] = b, c
        jacobian[2:, :3] = cosine * h_b + sine * h_c
        jacobian[2:, 3] = cosine * c - sine * b
        step = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        x, mix = x - step[:3], mix - float(step[3])
        if math.dist((x[0], x[1], x[2]), start) > 2.0 * reach:
            return None
        if np.max(np.abs(step)) < 1e-14:
            break
    if np.max(np.abs(residual)) > _EXACT or math.dist(point, start) > reach:
        return None
    return point


def branch_directions(curve: Curve, x: Vector3) -> tuple[Vector3, Vector3] | None:
    """Unit tangents of the two branches that cross at a bifurcation; None if they do not cross.

    They are the zeros of the second derivative of that combination of the rod equations whose
    gradient vanishes, on the plane that both gradients leave free.
    """
    at = curve.gradients(x)
    scale = curve.linkage.size**2
    left, _, right = np.linalg.svd(np.array([at.b, at.c]) / scale)
    h_b, h_c = curve.hessians(x) / scale
    plane = right[1:]
    form = plane @ (left[0, 1] * h_b + left[1, 1] * h_c) @ plane.T
    values, vectors = np.linalg.eigh(form)
    if values[0] * values[1] >= 0.0 or min(abs(values)) < 1e-9 * max(abs(values)):
        return None
    along, across = math.sqrt(values[1]), math.sqrt(-values[0])
    first = (along * vectors[:, 0] + across * vectors[:, 1]) @ plane
    second = (along * vectors[:, 0] - across * vectors[:, 1]) @ plane
    return _unit(first), _unit(second)


def _unit(vector: FloatArray) -> Vector3:
    return three(vector / np.linalg.norm(vector))


# The walk from arc to arc.

# A start whose drive is slower than this along the curve is a turning point.
STANDSTILL = 1e-6
# Another branch this near [rad] is a reason to look for a bifurcation ahead.
_SUSPICIOUS_RADIUS = 5e-3
# The search is repeated whenever the other branch has come nearer by this factor.
_NEARER = 0.25
# A bifurcation is stepped over from no farther away than this [rad].
_LONGEST_PASSAGE = 0.05
# Below this radius the branch cannot be told from another one any more.
_SMALLEST_RADIUS = 3e-8
# A leg of 5000 arcs must cover this length [rad]; on a branch that is nearly singular throughout it
# does not.
_LEG = 5000
_LEG_LENGTH = 0.01
# A step is halved so often until its end lies in the tube: down to 1e-12 of it.
_HALVINGS = 40


@dataclass(frozen=True)
class Arc:
    """A part of the curve along which the drive runs in one direction only.

    Attributes:
        frame: frame in whose tube the arc lies, or None beside a bifurcation.
        low: tangential coordinate of the start in that frame.
        high: tangential coordinate of the end.
        radius: radius of the tube.
        start: first point.
        end: last point.
        start_tangent: unit tangent at the start, in the sense of motion.
        end_tangent: likewise at the end.
    """

    frame: Frame | None
    low: float
    high: float
    radius: float
    start: Vector3
    end: Vector3
    start_tangent: Vector3
    end_tangent: Vector3


class EventKind(enum.Enum):
    """An event of a followed branch."""

    TURNING_POINT = "turning point"
    BIFURCATION = "bifurcation"
    SINGULAR = "singular"
    END = "end of the range"
    CLOSED = "closed"


class Passed(NamedTuple):
    """What happens at a ``point``: the drive reverses, branches cross, or no way on is unique.

    The branch is ``passable`` if the walk can go on beyond it.
    """

    kind: EventKind
    point: Vector3
    passable: bool


def follow(curve: Curve, x: Vector3, sense: float, largest_step: float) -> Iterator[Arc | Passed]:
    """Walk along the curve from ``x``; ``sense`` is +1 or -1 along ``Frame.tangent``.

    A start that is a turning point is not reported as one: ``sense`` tells to which side of it the
    walk leads. The walk never ends by itself unless at a bifurcation that cannot be passed, or
    where the curve is singular along more than a point.
    """
    frame = curve.frame(x)
    searched = math.inf
    covered = _LEG_LENGTH
    # At a turning point only rounding tells which way the drive runs.
    standing = frame is not None and abs(frame.tangent[2]) < STANDSTILL
    for count in itertools.count():
        if count % _LEG == 0:
            stuck, covered = covered < _LEG_LENGTH, 0.0
        if frame is None or stuck:
            yield Passed(EventKind.SINGULAR, frame.x if frame else x, False)
            return
        ball = 1.0 / frame.across if frame.across else math.inf
        if ball < _SMALLEST_RADIUS:
            yield Passed(EventKind.SINGULAR, frame.x, False)
            return
        if ball < min(_SUSPICIOUS_RADIUS, _NEARER * searched):
            searched = ball
            passage = _bifurcation_ahead(curve, frame, sense)
            if passage is not None:
                arcs, bifurcation, frame, sense = passage
                yield arcs[0]
                yield bifurcation
                if not bifurcation.passable:
                    return
                yield arcs[1]
                searched = math.inf
                continue
        if ball > _SUSPICIOUS_RADIUS:
            searched = math.inf
        advanced = _advance(curve, frame, sense, largest_step)
        following = curve.frame(*advanced[:2]) if advanced else None
        if advanced is None or following is None:
            yield Passed(EventKind.SINGULAR, frame.x, False)
            return
        x, at, h, radius = advanced
        covered += abs(h)
        start_tangent, end_tangent = (
            scaled(frame.tangent, sense),
            scaled(following.tangent, sense),
        )
        if standing or (frame.tangent[2] > 0.0) == (following.tangent[2] > 0.0):
            yield Arc(frame, 0.0, h, radius, frame.x, x, start_tangent, end_tangent)
        else:
            ends, slopes = (0.0, h), (curve.gradients(frame.x).determinant, at.determinant)
            point = zero_on_arc(curve, frame, x, ends, slopes, lambda _, at: at.determinant)
            middle = dot(minus(point, frame.x), frame.tangent)
            at_point = curve.frame(point)
            tangent = scaled(at_point.tangent, sense) if at_point else start_tangent
            yield Arc(frame, 0.0, middle, radius, frame.x, point, start_tangent, tangent)
            yield Passed(EventKind.TURNING_POINT, point, True)
            yield Arc(frame, middle, h, radius, point, x, tangent, end_tangent)
        frame = following
        standing = False


def leading_sense(first: Frame) -> float:
    """Sense along the tangent in which a branch is followed: the drive rises.

    From a turning point, where the branch lies to either side, the platform angle rises.
    """
    swing, turn, drive = first.tangent
    if abs(drive) < STANDSTILL:
        drive = turn if abs(turn) > STANDSTILL else swing
    return math.copysign(1.0, drive)


def _advance(
    curve: Curve, frame: Frame, sense: float, largest_step: float
) -> tuple[Vector3, RodJacobian, float, float] | None:
    """Next point, its gradients, its signed tangential coordinate and the radius of the tube."""
    step, radius, _ = tube(frame, largest_step)
    for _ in range(_HALVINGS):
        corrected = curve.correct(frame, sense * step)
        if corrected is not None and math.dist(corrected[0], ahead(frame, sense * step)) <= radius:
            return corrected[0], corrected[1], sense * step, radius
        step *= 0.5
    return None


def _bifurcation_ahead(
    curve: Curve, frame: Frame, sense: float
) -> tuple[tuple[Arc, Arc], Passed, Frame, float] | None:
    """Step over a bifurcation just ahead, keeping the direction; None if there is none."""
    point = find_bifurcation(curve, frame.x, _LONGEST_PASSAGE)
    if point is None:
        return None
    gap = math.dist(point, frame.x)
    if gap == 0.0:
        return None
    incoming = scaled(frame.tangent, sense)
    direction = scaled(minus(point, frame.x), 1.0 / gap)
    if dot(direction, incoming) <= 0.9:
        return None
    directions = branch_directions(curve, point)
    if directions is None:
        stay = _straight(frame.x, point, incoming, incoming)
        return (stay, stay), Passed(EventKind.BIFURCATION, point, False), frame, sense
    along = max(directions, key=lambda branch: abs(dot(branch, incoming)))
    along = scaled(along, math.copysign(1.0, dot(along, incoming)))
    # The branch is known once its bends are small against the angle between both branches.
    margin = 0.2 * math.sqrt(max(0.0, 1.0 - dot(*directions) ** 2))
    if max(math.dist(incoming, along), math.dist(direction, along)) > margin:
        return None
    landed = _land_beyond(curve, point, along, gap, margin)
    if landed is None:
        return None
    beyond, sense = landed
    leaving = scaled(beyond.tangent, sense)
    arcs = (
        _straight(frame.x, point, incoming, along),
        _straight(point, beyond.x, along, leaving),
    )
    return arcs, Passed(EventKind.BIFURCATION, point, True), beyond, sense


def _straight(start: Vector3, end: Vector3, leaving: Vector3, arriving: Vector3) -> Arc:
    return Arc(None, 0.0, 0.0, math.dist(start, end), start, end, leaving, arriving)


def _land_beyond(
    curve: Curve, point: Vector3, along: Vector3, length: float, tolerance: float
) -> tuple[Frame, float] | None:
    """Frame and sense of the branch at ``length`` beyond a bifurcation in direction ``along``."""
    plane = Frame(point, along, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.0)
    corrected = curve.correct(plane, length)
    if corrected is None or math.dist(corrected[0], ahead(plane, length)) > tolerance * length:
        return None
    frame = curve.frame(*corrected)
    if frame is None:
        return None
    sense = math.copysign(1.0, dot(frame.tangent, along))
    if math.dist(scaled(frame.tangent, sense), along) > tolerance:
        return None
    return frame, sense
