"""How a straight line takes over a motion that is under way, so that no slider jumps.

The motion of the sliders is divided. The time scaling continues the part along the line. What is
left becomes a blend: offsets of the sliders, which decay to zero. The line begins where the
platform would be without these offsets.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.moves.line_ends import LineBuilder
from tri_glide_kinematics.motion.trajectory import (
    AT_REST,
    CubicPlan,
    PlanningError,
    RuckigPlanner,
    SliderLimits,
    SliderState,
    StraightLine,
    Synchronization,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3

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
    """Makes entries for one machine."""

    def __init__(self, machine: TriGlide) -> None:
        """Prepare ruckig for ``machine``."""
        self._machine = machine
        self._ruckig = RuckigPlanner(3)

    def resting(
        self, state: SliderState, builder: LineBuilder, limits: SliderLimits, fraction: float
    ) -> Interruptible[Entry]:
        """Return the entry at rest: the blend brakes all of the motion.

        Args:
            state: of the sliders.
            builder: makes the line.
            limits: of the sliders.
            fraction: of the acceleration and jerk limits that the blend may use.

        Raises:
            KinematicsError: if no line begins where the sliders rest.
        """
        blend = self._brake(state, limits, fraction)
        line = yield from builder.limited(builder.line(self._begin(state, blend)))
        return Entry(line, 0.0, 0.0, blend)

    def moving(
        self, state: SliderState, builder: LineBuilder, limits: SliderLimits, fraction: float
    ) -> Interruptible[Entry]:
        """Return the entry that keeps the motion along the line.

        Args:
            state: of the sliders.
            builder: makes the line.
            limits: of the sliders.
            fraction: of the acceleration and jerk limits that the blend may use.

        Raises:
            KinematicsError: if no line begins where the platform would be.
        """
        line = builder.line(self._machine.forward(state.heights))
        speed, acceleration, residual = _divided(state, line, limits)
        if residual is None:
            line = yield from builder.limited(line)
            return Entry(line, speed, acceleration, None)
        # The residual depends on where the line begins, and this on how far the residual brakes.
        for _ in range(2):
            yield
            line = builder.line(self._begin(state, self._brake(residual, limits, fraction)))
            speed, acceleration, divided = _divided(state, line, limits)
            residual = divided or residual
        yield
        (x, y, z), (h1, h2, h3) = state.heights, line.start_heights
        offsets = (x - h1, y - h2, z - h3)
        phases = self._ruckig.to_rest_at(
            AT_REST,
            offsets,
            residual.velocities,
            residual.accelerations,
            _reduced(limits, fraction),
            Synchronization.No,
        )
        blend = CubicPlan(SliderState(offsets, residual.velocities, residual.accelerations), phases)
        line = yield from builder.limited(line)
        return Entry(line, speed, acceleration, blend)

    def _brake(self, residual: SliderState, limits: SliderLimits, fraction: float) -> CubicPlan:
        """Return offsets with the velocities and accelerations of ``residual`` that end at zero."""
        phases = self._ruckig.to_rest(
            residual.velocities, residual.accelerations, _reduced(limits, fraction)
        )
        from_zero = CubicPlan(
            SliderState(AT_REST, residual.velocities, residual.accelerations), phases
        )
        x, y, z = from_zero.at(from_zero.duration).heights
        return CubicPlan(
            SliderState((-x, -y, -z), residual.velocities, residual.accelerations), phases
        )

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
