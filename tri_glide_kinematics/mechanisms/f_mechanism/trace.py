"""One branch of an F-mechanism followed over its drive, with what happens on the way."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms.f_mechanism.curve import (
    STANDSTILL,
    Arc,
    Curve,
    Drive,
    EventKind,
    Passed,
    follow,
    leading_sense,
    zero_on_arc,
)
from tri_glide_kinematics.mechanisms.f_mechanism.positions import FMechanismPose, pose_at, pose_of
from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import (
    CONVERGED,
    Linkage,
    Number,
    as_points,
    direction,
    newton_step,
    pins_at,
    position_of,
    refined,
    rod_jacobian,
    singularity,
    states,
)
from tri_glide_kinematics.vectors import FloatArray, Point, Vector3
from tri_glide_kinematics.wording import number_text


class NotAPoseError(KinematicsError):
    """A pose does not belong to the mechanism at the given crank angle."""

    def __init__(self, crank_angle: float, gap: float) -> None:
        """Store the ``crank_angle`` [rad] and the rod length ``gap`` [m] that is left there."""
        super().__init__(
            f"pose is not a position of this mechanism at crank_angle = "
            f"{number_text(crank_angle)} rad: a rod length is wrong by {number_text(gap, 3)} m"
        )
        self.crank_angle = crank_angle
        self.gap = gap


@dataclass(frozen=True)
class FMechanismEvent:
    """An event on a branch; the last one of a trace says why it ended.

    Attributes:
        kind: turning point (the cranks must reverse), bifurcation (another branch crosses),
            singular (no unique way on: an isolated position, or a branch that is singular along
            more than a point), end of the requested range, or closed (back in the starting
            position).
        crank_angle: angle of crank A, counted on from the start [rad].
        phase_b: phase shift of crank B there [rad].
        phase_c: phase shift of crank C there [rad].
        pose: position there.
        index: number of samples of the trace that lie before it.
    """

    kind: EventKind
    crank_angle: float
    phase_b: float
    phase_c: float
    pose: FMechanismPose
    index: int


@dataclass(frozen=True, eq=False)
class FMechanismTrace:
    """Samples along one branch, in the order in which they are passed.

    Attributes:
        crank_angle: angle of crank A, counted on over full turns, shape (m,) [rad].
        phase_b: phase shift of crank B, shape (m,) [rad].
        phase_c: phase shift of crank C, shape (m,) [rad].
        angle: platform angle, continuous over full turns, shape (m,) [rad].
        position: origin of the platform frame, shape (m, 2) [m].
        crank_pins: A1, B1, C1, shape (m, 3, 2) [m].
        platform_joints: A2, B2, C2, shape (m, 3, 2) [m].
        angular_velocity: per unit crank speed at fixed phases, shape (m,) [rad/rad].
        velocity: of the origin, likewise, shape (m, 2) [m/rad].
        residual: largest deviation of a rod length, shape (m,) [m].
        singularity: as in FMechanismPose, shape (m,).
        events: in the order in which they are passed; the last one ends the trace.
        arcs: number of arcs that the branch was followed in.
    """

    crank_angle: FloatArray
    phase_b: FloatArray
    phase_c: FloatArray
    angle: FloatArray
    position: FloatArray
    crank_pins: FloatArray
    platform_joints: FloatArray
    angular_velocity: FloatArray
    velocity: FloatArray
    residual: FloatArray
    singularity: FloatArray
    events: tuple[FMechanismEvent, ...]
    arcs: int
    linkage: Linkage

    @property
    def turning_points(self) -> tuple[FMechanismEvent, ...]:
        """The events at which the cranks reverse."""
        return self._events(EventKind.TURNING_POINT)

    @property
    def bifurcations(self) -> tuple[FMechanismEvent, ...]:
        """The events at which another branch crosses."""
        return self._events(EventKind.BIFURCATION)

    @property
    def closed(self) -> bool:
        """Whether the branch came back to its starting position."""
        return self.events[-1].kind is EventKind.CLOSED

    @property
    def turns(self) -> float:
        """Net turns of the crank from the first sample to the end."""
        return (self.events[-1].crank_angle - float(self.crank_angle[0])) / (2.0 * math.pi)

    @property
    def turns_fully(self) -> bool:
        """Whether the cranks turn through without reversing until the branch closes.

        A branch may need more than one turn to close: ``turns`` tells how many.
        """
        return self.closed and not self.turning_points and abs(round(self.turns)) >= 1

    def pose(self, index: int) -> FMechanismPose:
        """One sample as a position, for instance to start another trace from."""
        columns = self.crank_angle, self.phase_b, self.phase_c, self.angle, self.position
        crank_angle, *phases, angle, position = (column[index].tolist() for column in columns)
        linkage = replace(self.linkage, phases=(0.0, *phases))
        return pose_at(linkage, crank_angle, angle, position)

    def point(self, platform_point: Point) -> FloatArray:
        """Places in the fixed frame of a point of the platform frame [m]. Shape (m, 2) [m]."""
        return self.position + self._arms(platform_point)

    def point_velocity(self, platform_point: Point) -> FloatArray:
        """Velocities per unit crank speed of a point of the platform frame. Shape (m, 2) [m/rad].

        As ``velocity``, they are those at fixed phases.
        """
        x, y = self._arms(platform_point).T
        rates: FloatArray = self.angular_velocity[:, np.newaxis] * np.stack([-y, x], axis=-1)
        return self.velocity + rates

    def _arms(self, platform_point: Point) -> FloatArray:
        """From the platform's origin to a point of the platform. Shape (m, 2) [m]."""
        return as_points(direction(self.angle) * complex(*platform_point))

    def _events(self, kind: EventKind) -> tuple[FMechanismEvent, ...]:
        return tuple(event for event in self.events if event.kind is kind)


# Rod gap of a start, relative to the size, that is still corrected instead of refused.
_NEAR_POSE = 1e-6
# Singularity below which a position is nearly singular.
NEARLY_SINGULAR = 1e-4
# A branch is closed if it comes back to its start within this [rad, size].
_CLOSED = 1e-8


def straight_drive(
    linkage: Linkage, crank_angle: float, change: tuple[float, float, float]
) -> tuple[Drive, float]:
    """Drive from the phases of ``linkage`` along ``change`` of crank angle and phases [rad].

    Returns:
        The drive, and the value of s at which the change is complete.
    """
    length = max(map(abs, change))
    turned = np.add(np.multiply(linkage.speeds, change[0]), (0.0, *change[1:]))
    rate_a, rate_b, rate_c = (turned / (length or 1.0)).tolist()
    return Drive(linkage.crank_angles(crank_angle), (rate_a, rate_b, rate_c)), length


def starting_point(curve: Curve, angle: float, origin: complex) -> Vector3:
    """Point of the curve at s = 0 from the platform's ``angle`` [rad] and its ``origin`` [m].

    Where the mechanism is closed already to rounding, as with each pose that was solved for,
    nothing is left to refine.

    Raises:
        NotAPoseError: if the pose does not close the mechanism there.
    """
    linkage = curve.linkage
    pins = pins_at(linkage, curve.drive.start)
    z = direction(angle)
    joints = [origin + z * joint for joint in linkage.joints]
    gap = max(
        abs(abs(joint - pin) - length) for joint, pin, length in zip(joints, pins, linkage.rods)
    )
    if not gap <= _NEAR_POSE * linkage.size:
        raise NotAPoseError(curve.drive.start[0], gap)
    v = joints[0] - pins.a
    if gap > CONVERGED * linkage.size:
        start = position_of(linkage, pins, z, v * linkage.rods[0] / abs(v))
        z, v, *_ = refined(linkage, pins, start, 8)
    return cmath.phase(v), cmath.phase(z), 0.0


# Values of the drive closer than this are one: an arc meets its end to rounding only [rad].
SPLIT = 1e-12


def passed(stations: FloatArray, start: float, stop: float) -> FloatArray:
    """Those of ascending stations that lie in (start, stop], rising or falling, in this order.

    One that is missed by rounding only belongs to the interval that ends there.
    """
    if stop > start:
        first, last = np.searchsorted(stations, (start + SPLIT, stop + SPLIT), side="right")
        return stations[first:last]
    first, last = np.searchsorted(stations, (stop - SPLIT, start - SPLIT), side="left")
    return stations[first:last][::-1]


# Points of a followed branch at requested values of the drive, all at once.

# Steps of Newton's method, and halvings before it, which are as good as its start has to be.
_NEWTON_STEPS = 4
_INVERSIONS = 30
# Gap of the rod equations, relative to the size and the reach, of a sample on the curve.
_ON_CURVE = 1e-13


def sample_arcs(curve: Curve, arcs: Sequence[Arc], requests: Sequence[FloatArray]) -> FloatArray:
    """Points (direction of rod A, platform angle, drive) of all requests, shape (m, 3) [rad].

    Each arc has its values of the drive. From the cubic through both ends of the arc a point is
    corrected at its fixed drive. It counts only if it lies in the tube and between the ends of the
    arc, where no other branch is; otherwise it is found again along the arc.
    """
    which = np.repeat(np.arange(len(arcs)), [len(request) for request in requests])
    if not which.size:
        return np.empty((0, 3))
    s = np.concatenate(requests)
    points = _cubic_points(arcs, which, s)
    pins = pins_at(curve.linkage, curve.drive.crank_angles(s))
    tolerance = _ON_CURVE * curve.linkage.size * curve.linkage.reach
    # At a singular sample the corrections are infinite; it is then found along the arc.
    with np.errstate(divide="ignore", invalid="ignore"):
        for step in range(_NEWTON_STEPS + 1):
            v, z = curve.linkage.rods[0] * direction(points[:, 0]), direction(points[:, 1])
            jacobian = rod_jacobian(curve.linkage, pins, z, v)
            gap = np.maximum(abs(jacobian.gap_b), abs(jacobian.gap_c))
            if step < _NEWTON_STEPS:
                corrections = np.stack(newton_step(jacobian), axis=1)
                points[:, :2] += np.where((gap > 0.01 * tolerance)[:, np.newaxis], corrections, 0.0)
        solved = (gap <= tolerance) & _on_arc(arcs, which, points)
    for index in np.flatnonzero(~solved).tolist():
        points[index] = point_on_arc(curve, arcs[which[index]], float(s[index]))
    return points


def point_on_arc(curve: Curve, arc: Arc, s: float) -> Vector3:
    """Point of one arc where the drive is ``s``, along the arc."""
    part = abs(s - arc.start[2]) / max(abs(arc.end[2] - arc.start[2]), 1e-300)
    if arc.frame is None or not 0.0 < part < 1.0:
        # Beside a bifurcation the arc is straight to its length squared, which is tiny.
        p, q = (1.0 - min(part, 1.0)), min(part, 1.0)
        start, end = arc.start, arc.end
        return p * start[0] + q * end[0], p * start[1] + q * end[1], s
    values = arc.start[2] - s, arc.end[2] - s
    near = arc.start if part < 0.5 else arc.end
    return zero_on_arc(curve, arc.frame, near, (arc.low, arc.high), values, lambda x, _: x[2] - s)


def _on_arc(arcs: Sequence[Arc], which: NDArray[np.int64], points: FloatArray) -> NDArray[np.bool_]:
    """Whether points lie in the tube of their arc and between its ends."""
    centre = np.array([arc.frame.x if arc.frame else arc.start for arc in arcs])[which]
    tangent = np.array([arc.frame.tangent if arc.frame else (0.0, 0.0, 0.0) for arc in arcs])[which]
    limits = np.array([(arc.radius, *sorted((arc.low, arc.high))) for arc in arcs])[which]
    radius, low, high = limits.T
    offset = points - centre
    along = np.sum(offset * tangent, axis=1)
    aside = np.sum(offset * offset, axis=1) - along * along
    inside: NDArray[np.bool_] = np.sqrt(np.maximum(aside, 0.0)) <= radius + 1e-9
    return inside & (along >= low - 1e-9) & (along <= high + 1e-9)


def _cubic_points(arcs: Sequence[Arc], which: NDArray[np.int64], s: FloatArray) -> FloatArray:
    """Points on the Hermite cubics of the arcs where the drive is ``s``."""
    start = np.array([arc.start for arc in arcs])
    end = np.array([arc.end for arc in arcs])
    chord = np.sqrt(np.sum((end - start) ** 2, axis=1))[:, np.newaxis]
    leaving = chord * np.array([arc.start_tangent for arc in arcs])
    arriving = chord * np.array([arc.end_tangent for arc in arcs])
    # x(u) = start + u (leaving + u (second + u third))
    second = 3.0 * (end - start) - 2.0 * leaving - arriving
    third = leaving + arriving - 2.0 * (end - start)
    start, leaving, second, third = (part[which] for part in (start, leaving, second, third))
    rising = end[which, 2] > start[:, 2]
    low, high = np.zeros(len(s)), np.ones(len(s))
    for _ in range(_INVERSIONS):
        u = 0.5 * (low + high)
        drive = start[:, 2] + u * (leaving[:, 2] + u * (second[:, 2] + u * third[:, 2]))
        before = (drive < s) == rising
        low, high = np.where(before, u, low), np.where(before, high, u)
    u = (0.5 * (low + high))[:, np.newaxis]
    points: FloatArray = start + u * (leaving + u * (second + u * third))
    points[:, 2] = s
    return points


def same_position(p: Vector3, q: Vector3, tolerance: float) -> bool:
    """Whether two points differ by whole turns of rod and platform only."""
    return all(abs(math.remainder(a - b, 2.0 * math.pi)) <= tolerance for a, b in zip(p[:2], q[:2]))


@dataclass(frozen=True, eq=False)
class TraceOptions:
    """The drive to follow and the samples to report.

    Attributes:
        stations: values of s at which to sample, ascending; the first and the last limit s.
        through: whether to go on through turning points and bifurcations.
        period: change of s after which the cranks stand as before; infinite if never.
        largest_step: longest arc [rad].
        patience: whose end, one item for each nearly singular arc, makes the branch a singular one.
    """

    stations: FloatArray
    through: bool
    period: float
    largest_step: float
    patience: Iterator[object] | None = None

    @property
    def closings(self) -> FloatArray:
        """Values of s at which the cranks stand as in the start."""
        if math.isinf(self.period):
            return np.zeros(1)
        low, high = self.stations[[0, -1]] / self.period
        return self.period * np.arange(math.floor(low), math.ceil(high) + 1)


class _Recorder:
    """Collects what a walk along the curve passes."""

    def __init__(self, curve: Curve, start: Vector3, options: TraceOptions) -> None:
        self.curve = curve
        self.start = start
        self.options = options
        self.closings = options.closings
        self.arcs: list[Arc] = []
        self.requests: list[FloatArray] = []
        # The start is a sample of its own, before all requests.
        self.samples = 1
        self.events: list[tuple[EventKind, Vector3, int]] = []
        self.rising = True

    def event(self, kind: EventKind, x: Vector3) -> None:
        self.events.append((kind, x, self.samples))

    def passed(self, item: Passed) -> bool:
        """Take what happens at a point; return whether the trace ends there."""
        kind, x, passable = item
        if kind is EventKind.TURNING_POINT:
            drift = math.remainder(x[2], self.options.period)
            if abs(drift) < STANDSTILL and same_position(x, self.start, 10.0 * STANDSTILL):
                kind, passable = EventKind.CLOSED, False
        self.event(kind, x)
        return not (self.options.through and passable)

    def arc(self, arc: Arc) -> bool:
        """Take the samples of an arc; return whether the trace ends in it."""
        low, high = arc.start[2], arc.end[2]
        limit = float(self.options.stations[-1 if high > low else 0])
        # A turning point that lies on the limit is still taken.
        ends = high > limit + SPLIT if high > low else high < limit - SPLIT
        closing = self._closing(arc, limit if ends else high)
        stop = closing[2] if closing else (limit if ends else high)
        self.arcs.append(arc)
        self.requests.append(passed(self.options.stations, low, stop))
        self.samples += len(self.requests[-1])
        if closing:
            self.event(EventKind.CLOSED, closing)
        elif ends:
            self.event(EventKind.END, point_on_arc(self.curve, arc, limit))
        elif self._gives_up(arc):
            self.event(EventKind.SINGULAR, arc.end)
            ends = True
        return bool(closing) or ends

    def _gives_up(self, arc: Arc) -> bool:
        """Whether one more arc that is nearly singular is too much."""
        patience = self.options.patience
        if patience is None:
            return False
        at = self.curve.gradients(arc.end)
        nearly_singular = abs(singularity(self.curve.linkage, at)) < NEARLY_SINGULAR
        return nearly_singular and next(patience, None) is None

    def _closing(self, arc: Arc, stop: float) -> Vector3 | None:
        """The point at which the arc comes back to the start, in the same direction."""
        low = arc.start[2]
        if (stop > low) != self.rising or stop == low:
            return None
        for s in passed(self.closings, low, stop).tolist():
            x = point_on_arc(self.curve, arc, s)
            if same_position(x, self.start, _CLOSED):
                return x
        return None


def trace_branch(curve: Curve, start: Vector3, options: TraceOptions) -> FMechanismTrace:
    """Follow the branch through ``start`` (at s = 0) with rising s, and sample it."""
    recorder = _Recorder(curve, start, options)
    first = curve.frame(start)
    standing = False
    sense = 1.0
    if first is not None:
        sense = leading_sense(first)
        if abs(first.tangent[2]) < STANDSTILL and first.curvature[2] < 0.0:
            # The branch lies behind this turning point.
            standing = True
            recorder.rising = False
            recorder.event(EventKind.TURNING_POINT, start)
    if options.stations[-1] <= 0.0:
        recorder.event(EventKind.END, start)
    elif options.through or not standing:
        for item in follow(curve, start, sense, options.largest_step):
            if recorder.arc(item) if isinstance(item, Arc) else recorder.passed(item):
                break
    return _assemble(recorder)


def _assemble(recorder: _Recorder) -> FMechanismTrace:
    """All samples with their joints and rates, and the events with their poses."""
    curve, linkage = recorder.curve, recorder.curve.linkage
    sampled = sample_arcs(curve, recorder.arcs, recorder.requests)
    points = np.concatenate([np.array([recorder.start]), sampled])
    pins = pins_at(linkage, curve.drive.crank_angles(points[:, 2]))
    at = states(linkage, pins, direction(points[:, 1]), linkage.rods[0] * direction(points[:, 0]))
    crank, phase_b, phase_c = _setting(curve, points[:, 2])
    return FMechanismTrace(
        crank_angle=crank,
        phase_b=phase_b,
        phase_c=phase_c,
        crank_pins=as_points(np.stack(pins[:3], axis=1)),
        events=tuple(_event(curve, *event) for event in recorder.events),
        arcs=len(recorder.arcs),
        linkage=linkage,
        # The platform angle is counted on over full turns.
        **at._replace(angle=points[:, 1].copy())._asdict(),
    )


def _setting(curve: Curve, s: Number) -> tuple[Number, Number, Number]:
    """Crank angle and phases along the drive, at a number or an array."""
    a, b, c = curve.drive.crank_angles(s)
    speeds = curve.linkage.speeds
    return a, b - speeds[1] * a, c - speeds[2] * a


def _event(curve: Curve, kind: EventKind, x: Vector3, index: int) -> FMechanismEvent:
    crank, phase_b, phase_c = _setting(curve, x[2])
    pins = pins_at(curve.linkage, curve.drive.crank_angles(x[2]))
    v, z = cmath.rect(curve.linkage.rods[0], x[0]), direction(x[1])
    double = kind in (EventKind.TURNING_POINT, EventKind.BIFURCATION)
    pose = pose_of(curve.linkage, pins, crank, position_of(curve.linkage, pins, z, v, double))
    return FMechanismEvent(kind, crank, phase_b, phase_c, pose, index)
