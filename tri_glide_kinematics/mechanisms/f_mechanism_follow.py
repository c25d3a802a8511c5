"""Follow one branch of the curve of positions, arc by arc, without ever leaving it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from tri_glide_kinematics.errors import BranchLostError
from tri_glide_kinematics.mechanisms.f_mechanism_curve import (
    Curve,
    Frame,
    Gradients,
    Vector,
    distance,
    dot,
    tube,
)
from tri_glide_kinematics.mechanisms.f_mechanism_singular import (
    branch_directions,
    find_bifurcation,
    turning_point,
)

# Another branch this near [rad] is a reason to look for a bifurcation ahead.
_SUSPICIOUS_RADIUS = 5e-3
# The bifurcation may be this many times farther, since branches may cross at a small angle.
_SEARCH = 300.0
# Below this radius the branch cannot be told from another one any more.
_SMALLEST_RADIUS = 1e-9
_HALVINGS = 40


@dataclass(frozen=True)
class Arc:
    """A piece of the curve along which the drive runs one way only.

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


def follow(
    curve: Curve, x: Vector, sense: float, largest_step: float
) -> Iterator[Arc | Turning | Bifurcation]:
    """Walk along the curve from ``x``; ``sense`` is +1 or -1 along ``Frame.tangent``.

    The walk never ends by itself unless at a bifurcation that cannot be passed.

    Raises:
        BranchLostError: where the curve is singular, and the way on is not unique.
    """
    frame = curve.frame(x)
    searched = math.inf
    while True:
        if frame is None:
            raise BranchLostError(curve.drive.crank_angles(x[2])[0])
        ball = 1.0 / frame.across if frame.across else math.inf
        if ball < _SMALLEST_RADIUS:
            raise BranchLostError(curve.drive.crank_angles(frame.x[2])[0])
        if ball < min(_SUSPICIOUS_RADIUS, 0.1 * searched):
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
        x, at, h, radius = _advance(curve, frame, sense, largest_step)
        following = curve.frame(x, at)
        if following is None:
            raise BranchLostError(curve.drive.crank_angles(x[2])[0])
        start_tangent, end_tangent = (
            _scaled(frame.tangent, sense),
            _scaled(following.tangent, sense),
        )
        if (frame.tangent[2] > 0.0) == (following.tangent[2] > 0.0):
            yield Arc(frame, 0.0, h, radius, frame.x, x, start_tangent, end_tangent)
        else:
            point, middle = turning_point(curve, frame, h)
            at_point = curve.frame(point)
            tangent = _scaled(at_point.tangent, sense) if at_point else start_tangent
            yield Arc(frame, 0.0, middle, radius, frame.x, point, start_tangent, tangent)
            yield Turning(point)
            yield Arc(frame, middle, h, radius, point, x, tangent, end_tangent)
        frame = following


def _advance(
    curve: Curve, frame: Frame, sense: float, largest_step: float
) -> tuple[Vector, Gradients, float, float]:
    """Next point, its gradients, its signed tangential coordinate and the radius of the tube."""
    step, radius, _ = tube(frame, largest_step)
    for _ in range(_HALVINGS):
        corrected = curve.correct(frame, sense * step)
        if corrected is not None and distance(corrected[0], ahead(frame, sense * step)) <= radius:
            return corrected[0], corrected[1], sense * step, radius
        step *= 0.5
    raise BranchLostError(curve.drive.crank_angles(frame.x[2])[0])


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
    point = find_bifurcation(curve, frame.x, _SEARCH / frame.across)
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
    helper = min(
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), key=lambda e: abs(dot(e, along))
    )
    first = _difference(helper, _scaled(along, dot(helper, along)))
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
