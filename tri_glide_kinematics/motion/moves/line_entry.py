"""How a straight line takes over a motion that is under way, and where the line leads.

The motion of the sliders is divided. The time scaling continues the part along the line. What is
left becomes a blend: offsets of the sliders, which decay to zero. The line begins where the
platform would be without these offsets, and leads to a position, to the edge, or to a stop.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import NoRoomError, PlanningError
from tri_glide_kinematics.motion.limits import AT_REST, EDGE_CLEARANCE, SliderLimits, SliderState
from tri_glide_kinematics.motion.trajectory import CubicPlan, RuckigPlanner, StraightLine
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Ruckig plans no more than two hours; a jog that is so slow ends after this time [s].
LONGEST_JOG = 1000.0


# Makes the line that begins at a place [m], of any length.
LineFrom = Callable[[Vector3], StraightLine]


class LineBuilder(Protocol):
    """Makes lines, and finds in a second step where they end."""

    def line(self, start: Vector3) -> StraightLine:
        """Return the line that begins at ``start`` [m], of any length."""

    def limited(self, line: StraightLine) -> Interruptible[StraightLine]:
        """Return the ``line`` with its final length, inside the workspace.

        Raises:
            KinematicsError: if there is none.
        """


class LineToPosition:
    """Lines to one position."""

    def __init__(self, region: Workspace, position: Vector3) -> None:
        """Lead to ``position`` [m] inside ``region``."""
        self._region = region
        self._position = position

    def line(self, start: Vector3) -> StraightLine:
        """Return the line from ``start`` to the position."""
        return StraightLine.between(self._region.machine.geometry, start, self._position)

    def limited(self, line: StraightLine) -> Interruptible[StraightLine]:
        """Make sure that the ``line`` stays inside the workspace."""
        yield from self._region.segment_check(line.start, self._position)
        return _known(line, self._region)


class LineToEdge:
    """Lines in one direction, up to the edge of the workspace or for a long time."""

    def __init__(self, region: Workspace, direction: Vector3, speed: float) -> None:
        """Lead along the unit vector ``direction`` inside ``region``, at a ``speed`` [m/s]."""
        self._region = region
        self._direction = direction
        limits = region.limits
        # No straight line inside the workspace is longer.
        longest = 2.0 * max(region.machine.geometry.arm_lengths) + max(
            upper - lower for lower, upper in zip(limits.lower_heights, limits.upper_heights)
        )
        self._longest = min(longest, LONGEST_JOG * speed)

    def line(self, start: Vector3) -> StraightLine:
        """Return the beginning of the line from ``start``."""
        return StraightLine(self._region.machine.geometry, start, self._direction, 0.0)

    def limited(self, line: StraightLine) -> Interruptible[StraightLine]:
        """Return the line up to the edge.

        Raises:
            NoRoomError: if the line begins there.
        """
        longest = max(self._longest, 3.0 * EDGE_CLEARANCE)
        distance = yield from self._region.exit_search(line.start, line.direction, longest)
        if distance < 2.0 * EDGE_CLEARANCE:
            raise NoRoomError(line.start, line.direction, self._edge(line))
        length = distance - EDGE_CLEARANCE
        geometry = self._region.machine.geometry
        cut = StraightLine(geometry, line.start, line.direction, length)
        return _known(cut, self._region)

    def _edge(self, line: StraightLine) -> str:
        """Return which limit is next to the start of ``line``, in words."""
        try:
            self._region.check_segment(line.start, line.point(10.0 * EDGE_CLEARANCE))
        except KinematicsError as error:
            return str(error)
        return "the edge of the workspace is near"


def _known(line: StraightLine, region: Workspace) -> StraightLine:
    """Return a ``line`` of which it is known that it stays inside the ``region``."""
    line.known_inside = region
    return line


# Velocities [m/s] and accelerations [m/s^2] below these are zero: rounding. A step of this size is
# far below what a jerk limit notices.
NO_VELOCITY = 1e-11
NO_ACCELERATION = 1e-9


class Entry(NamedTuple):
    """A motion that is under way, as a line takes it over.

    Attributes:
        line: begins where the platform would be if the blend were over.
        speed: part of the motion that goes along the line [m/s].
        acceleration: likewise [m/s^2].
        blend: offsets of the sliders; None if the line takes over all of the motion.
    """

    line: StraightLine
    speed: float
    acceleration: float
    blend: CubicPlan | None


class LineEntry:
    """Makes entries for one machine; their lines have no final length yet."""

    def __init__(self, machine: TriGlide) -> None:
        """Prepare ruckig for ``machine``."""
        self._machine = machine
        self._ruckig = RuckigPlanner(3)

    def resting(
        self, state: SliderState, line_from: LineFrom, limits: SliderLimits, fraction: float
    ) -> Entry:
        """Return the entry at rest: the blend brakes all of the motion.

        Args:
            state: of the sliders.
            line_from: makes the line.
            limits: of the sliders.
            fraction: of the acceleration and jerk limits that the blend may use.

        Raises:
            KinematicsError: if no line begins where the sliders rest.
        """
        blend = self._brake(state, limits, fraction)
        return Entry(line_from(self._begin(state, blend)), 0.0, 0.0, blend)

    def moving(
        self, state: SliderState, line_from: LineFrom, limits: SliderLimits, fraction: float
    ) -> Entry:
        """Return the entry that keeps the motion along the line.

        Args:
            state: of the sliders.
            line_from: makes the line.
            limits: of the sliders.
            fraction: of the acceleration and jerk limits that the blend may use.

        Raises:
            KinematicsError: if no line begins where the platform would be.
        """
        line = line_from(self._machine.forward(state.heights))
        speed, acceleration, residual = _divided(state, line, limits)
        if residual is None:
            return Entry(line, speed, acceleration, None)
        # The residual depends on where the line begins, and this on how far the residual brakes.
        for _ in range(2):
            line = line_from(self._begin(state, self._brake(residual, limits, fraction)))
            speed, acceleration, divided = _divided(state, line, limits)
            residual = divided or residual
        (x, y, z), (h1, h2, h3) = state.heights, line.start_heights
        offsets = (x - h1, y - h2, z - h3)
        beside = residual._replace(heights=offsets)
        less = _reduced(limits, fraction)
        phases = self._ruckig.to_rest_at(AT_REST, *beside, less, together=False)
        return Entry(line, speed, acceleration, CubicPlan(beside, phases))

    def _brake(self, residual: SliderState, limits: SliderLimits, fraction: float) -> CubicPlan:
        """Return offsets with the velocities and accelerations of ``residual`` that end at zero."""
        phases = self._ruckig.to_rest(
            residual.velocities, residual.accelerations, _reduced(limits, fraction)
        )
        from_zero = CubicPlan(residual._replace(heights=AT_REST), phases)
        x, y, z = from_zero.at(from_zero.duration).heights
        return CubicPlan(residual._replace(heights=(-x, -y, -z)), phases)

    def _begin(self, state: SliderState, blend: CubicPlan) -> Vector3:
        """Return where the platform would be without the offsets of ``blend``."""
        (h1, h2, h3), (x, y, z) = state.heights, blend.at(0.0).heights
        return self._machine.forward((h1 - x, h2 - y, h3 - z))


def check_length(
    blend: CubicPlan | None, state: SliderState, limits: SliderLimits, longest: float
) -> None:
    """Raise a PlanningError if a blend takes so long that to stop before would be better."""
    if blend is None:
        return
    stop = max(
        (abs(v) + 0.5 * abs(a) * abs(a) / j) / largest + largest / j + abs(a) / j
        for v, a, largest, j in zip(
            state.velocities, state.accelerations, limits.acceleration, limits.jerk
        )
    )
    if blend.duration > longest * stop:
        raise PlanningError("the motion before would go on for too long")


def _divided(
    state: SliderState, line: StraightLine, limits: SliderLimits
) -> tuple[float, float, SliderState | None]:
    """Return speed and acceleration along ``line`` at its start, and the residual motion if any."""
    slopes, bends = line.start_slopes, line.start_bends
    square = sum(f * f for f in slopes)
    speed = sum(v * f for v, f in zip(state.velocities, slopes)) / square
    acceleration = 0.0
    if speed <= NO_VELOCITY:
        speed = 0.0
    else:
        along = [a - speed * speed * b for a, b in zip(state.accelerations, bends)]
        acceleration = sum(a * f for a, f in zip(along, slopes)) / square
        # Less than this could not be taken back before the platform goes backwards.
        jerk = min(j / max(abs(f), 1e-9) for j, f in zip(limits.jerk, slopes))
        acceleration = max(acceleration, -math.sqrt(2.0 * jerk * speed))
    (f1, f2, f3), (b1, b2, b3) = slopes, bends
    (v1, v2, v3), (a1, a2, a3) = state.velocities, state.accelerations
    squared = speed * speed
    velocities = (v1 - speed * f1, v2 - speed * f2, v3 - speed * f3)
    accelerations = (
        a1 - acceleration * f1 - squared * b1,
        a2 - acceleration * f2 - squared * b2,
        a3 - acceleration * f3 - squared * b3,
    )
    if max(map(abs, velocities)) <= NO_VELOCITY and max(map(abs, accelerations)) <= NO_ACCELERATION:
        return speed, acceleration, None
    return speed, acceleration, SliderState(AT_REST, velocities, accelerations)


def _reduced(limits: SliderLimits, fraction: float) -> tuple[Vector3, Vector3, Vector3]:
    """Return the limits with a ``fraction`` of acceleration and jerk."""
    (a1, a2, a3), (j1, j2, j3) = limits.acceleration, limits.jerk
    return (
        limits.velocity,
        (fraction * a1, fraction * a2, fraction * a3),
        (fraction * j1, fraction * j2, fraction * j3),
    )
