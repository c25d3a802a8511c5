"""Follow one branch of the curve of positions, arc by arc, without ever leaving it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

from tri_glide_kinematics.mechanisms.f_mechanism.following.arc_proof import tube
from tri_glide_kinematics.mechanisms.f_mechanism.following.curve import (
    Curve,
    Frame,
    Gradients,
    Vector,
    distance,
    dot,
)
from tri_glide_kinematics.mechanisms.f_mechanism.following.singular import (
    branch_directions,
    find_bifurcation,
    turning_point,
)

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
# So many arcs must cover this length [rad]; a branch that is nearly singular throughout does not.
_LEG = 5000
_LEG_LENGTH = 0.01
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
    start: Vector
    end: Vector
    start_tangent: Vector
    end_tangent: Vector


@dataclass(frozen=True)
class Turning:
    """The drive reverses at ``point``."""

    point: Vector


@dataclass(frozen=True)
class Bifurcation:
    """Two branches cross at ``point``; ``passable`` if the one followed goes on beyond it."""

    point: Vector
    passable: bool


@dataclass(frozen=True)
class Singular:
    """There is no unique way on from ``point``."""

    point: Vector


def follow(
    curve: Curve, x: Vector, sense: float, largest_step: float
) -> Iterator[Arc | Turning | Bifurcation | Singular]:
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
            yield Singular(frame.x if frame else x)
            return
        ball = 1.0 / frame.across if frame.across else math.inf
        if ball < _SMALLEST_RADIUS:
            yield Singular(frame.x)
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
            yield Singular(frame.x)
            return
        x, _, h, radius = advanced
        covered += abs(h)
        start_tangent, end_tangent = (
            _scaled(frame.tangent, sense),
            _scaled(following.tangent, sense),
        )
        if standing or (frame.tangent[2] > 0.0) == (following.tangent[2] > 0.0):
            yield Arc(frame, 0.0, h, radius, frame.x, x, start_tangent, end_tangent)
        else:
            point, middle = turning_point(curve, frame, h)
            at_point = curve.frame(point)
            tangent = _scaled(at_point.tangent, sense) if at_point else start_tangent
            yield Arc(frame, 0.0, middle, radius, frame.x, point, start_tangent, tangent)
            yield Turning(point)
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
) -> tuple[Vector, Gradients, float, float] | None:
    """Next point, its gradients, its signed tangential coordinate and the radius of the tube."""
    step, radius, _ = tube(frame, largest_step)
    for _ in range(_HALVINGS):
        corrected = curve.correct(frame, sense * step)
        if corrected is not None and distance(corrected[0], ahead(frame, sense * step)) <= radius:
            return corrected[0], corrected[1], sense * step, radius
        step *= 0.5
    return None


def ahead(frame: Frame, h: float) -> Vector:
    """Point on the tangent of ``frame`` at ``h``."""
    (x0, x1, x2), (t0, t1, t2) = frame.x, frame.tangent
    return x0 + h * t0, x1 + h * t1, x2 + h * t2


def _scaled(vector: Vector, factor: float) -> Vector:
    return factor * vector[0], factor * vector[1], factor * vector[2]


def _difference(p: Vector, q: Vector) -> Vector:
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def _bifurcation_ahead(
    curve: Curve, frame: Frame, sense: float
) -> tuple[tuple[Arc, Arc], Bifurcation, Frame, float] | None:
    """Step over a bifurcation just ahead, keeping the direction; None if there is none."""
    point = find_bifurcation(curve, frame.x, _LONGEST_PASSAGE)
    if point is None:
        return None
    gap = distance(point, frame.x)
    if gap == 0.0:
        return None
    incoming = _scaled(frame.tangent, sense)
    direction = _scaled(_difference(point, frame.x), 1.0 / gap)
    if dot(direction, incoming) <= 0.9:
        return None
    directions = branch_directions(curve, point)
    if directions is None:
        stay = _straight(frame.x, point, incoming, incoming)
        return (stay, stay), Bifurcation(point, False), frame, sense
    along = max(directions, key=lambda branch: abs(dot(branch, incoming)))
    along = _scaled(along, math.copysign(1.0, dot(along, incoming)))
    # The branch is known once its bends are small against the angle between both branches.
    margin = 0.2 * math.sqrt(max(0.0, 1.0 - dot(*directions) ** 2))
    if max(distance(incoming, along), distance(direction, along)) > margin:
        return None
    landed = _land_beyond(curve, point, along, gap, margin)
    if landed is None:
        return None
    beyond, sense = landed
    leaving = _scaled(beyond.tangent, sense)
    arcs = (
        _straight(frame.x, point, incoming, along),
        _straight(point, beyond.x, along, leaving),
    )
    return arcs, Bifurcation(point, True), beyond, sense


def _straight(start: Vector, end: Vector, leaving: Vector, arriving: Vector) -> Arc:
    return Arc(None, 0.0, 0.0, distance(start, end), start, end, leaving, arriving)


def _land_beyond(
    curve: Curve, point: Vector, along: Vector, length: float, tolerance: float
) -> tuple[Frame, float] | None:
    """Frame and sense of the branch at ``length`` beyond a bifurcation in direction ``along``."""
    # The plane across the direction: a frame without curvature does as the coordinate system.
    axis = min(
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), key=lambda e: abs(dot(e, along))
    )
    first = _difference(axis, _scaled(along, dot(axis, along)))
    first = _scaled(first, 1.0 / math.sqrt(dot(first, first)))
    second = (
        along[1] * first[2] - along[2] * first[1],
        along[2] * first[0] - along[0] * first[2],
        along[0] * first[1] - along[1] * first[0],
    )
    plane = Frame(point, along, first, second, (0.0, 0.0), 0.0, 0.0, 0.0, 0.0)
    corrected = curve.correct(plane, length)
    if corrected is None or distance(corrected[0], ahead(plane, length)) > tolerance * length:
        return None
    frame = curve.frame(*corrected)
    if frame is None:
        return None
    sense = math.copysign(1.0, dot(frame.tangent, along))
    if distance(_scaled(frame.tangent, sense), along) > tolerance:
        return None
    return frame, sense
