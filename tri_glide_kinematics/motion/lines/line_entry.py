"""How a straight line takes over a motion that is under way, so that no slider jumps.

The motion of the sliders is divided into one along the line, which the way law continues, and a
rest, which a blend wears off: offsets of the sliders that brake to zero. The line begins where the
platform would be without them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ruckig import Synchronization

from tri_glide_kinematics.motion.aims import Aim
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.lines.straight_line import StraightLine
from tri_glide_kinematics.motion.plans import AT_REST, CubicPlan, SliderState
from tri_glide_kinematics.motion.ruckig_planner import RuckigPlanner
from tri_glide_kinematics.tri_glide.kinematics import TriGlide
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
        gain: likewise of the acceleration [m/s^2].
        blend: offsets of the sliders, None if there is no rest to wear off.
    """

    line: StraightLine
    speed: float
    gain: float
    blend: CubicPlan | None


class LineEntry:
    """Makes entries for one machine."""

    def __init__(self, machine: TriGlide) -> None:
        """Prepare ruckig for ``machine``."""
        self._machine = machine
        self._ruckig = RuckigPlanner(3)

    def resting(self, state: SliderState, aim: Aim, limits: SliderLimits) -> Entry:
        """Return the entry at rest: the blend brakes all of the motion.

        Raises:
            KinematicsError: if no line begins where the sliders rest.
        """
        blend = self._brake(state, limits, 1.0)
        return Entry(aim.fitted(aim.line(self._begin(state, blend))), 0.0, 0.0, blend)

    def moving(self, state: SliderState, aim: Aim, limits: SliderLimits, share: float) -> Entry:
        """Return the entry that keeps the motion along the line.

        Args:
            state: of the sliders.
            aim: gives the line.
            limits: of the sliders.
            share: part of the acceleration and jerk limits that the blend may use.

        Raises:
            KinematicsError: if no line begins where the platform would be.
        """
        line = aim.line(self._machine.forward(state.heights))
        speed, gain, rest = _divided(state, line, limits)
        if rest is None:
            return Entry(aim.fitted(line), speed, gain, None)
        # The rest depends on where the line begins, and this on how far the rest brakes.
        for _ in range(2):
            line = aim.line(self._begin(state, self._brake(rest, limits, share)))
            speed, gain, divided = _divided(state, line, limits)
            rest = divided or rest
        (x, y, z), (h1, h2, h3) = state.heights, line.start_heights
        offsets = (x - h1, y - h2, z - h3)
        phases = self._ruckig.to_rest_at(
            AT_REST,
            offsets,
            rest.velocities,
            rest.accelerations,
            _shared(limits, share),
            Synchronization.No,
        )
        blend = CubicPlan(SliderState(offsets, rest.velocities, rest.accelerations), phases)
        return Entry(aim.fitted(line), speed, gain, blend)

    def _brake(self, rest: SliderState, limits: SliderLimits, share: float) -> CubicPlan:
        """Return offsets with the velocities and accelerations of ``rest`` that end at zero."""
        phases = self._ruckig.to_rest(rest.velocities, rest.accelerations, _shared(limits, share))
        from_zero = CubicPlan(SliderState(AT_REST, rest.velocities, rest.accelerations), phases)
        x, y, z = from_zero.state(from_zero.duration).heights
        return CubicPlan(SliderState((-x, -y, -z), rest.velocities, rest.accelerations), phases)

    def _begin(self, state: SliderState, blend: CubicPlan) -> Vector3:
        """Return where the platform would be without the offsets of ``blend``."""
        (h1, h2, h3), (x, y, z) = state.heights, blend.state(0.0).heights
        return self._machine.forward((h1 - x, h2 - y, h3 - z))


def _divided(
    state: SliderState, line: StraightLine, limits: SliderLimits
) -> tuple[float, float, SliderState | None]:
    """Return speed and acceleration along ``line`` at its start, and what is left if it matters."""
    slopes, bends = line.start_slopes, line.start_bends
    square = sum(f * f for f in slopes)
    speed = sum(v * f for v, f in zip(state.velocities, slopes)) / square
    gain = 0.0
    if speed <= NO_VELOCITY:
        speed = 0.0
    else:
        bent = [a - speed * speed * b for a, b in zip(state.accelerations, bends)]
        gain = sum(a * f for a, f in zip(bent, slopes)) / square
        # Less than this could not be taken back before the platform goes backwards.
        jerk = min(j / max(abs(f), 1e-9) for j, f in zip(limits.jerk, slopes))
        gain = max(gain, -math.sqrt(2.0 * jerk * speed))
    (f1, f2, f3), (b1, b2, b3) = slopes, bends
    (v1, v2, v3), (a1, a2, a3) = state.velocities, state.accelerations
    bow = speed * speed
    velocities = (v1 - speed * f1, v2 - speed * f2, v3 - speed * f3)
    accelerations = (
        a1 - gain * f1 - bow * b1,
        a2 - gain * f2 - bow * b2,
        a3 - gain * f3 - bow * b3,
    )
    if max(map(abs, velocities)) <= NO_VELOCITY and max(map(abs, accelerations)) <= NO_ACCELERATION:
        return speed, gain, None
    return speed, gain, SliderState(AT_REST, velocities, accelerations)


def _shared(limits: SliderLimits, share: float) -> tuple[Vector3, Vector3, Vector3]:
    """Return the limits of ruckig for a motion that may use a part of them."""
    (a1, a2, a3), (j1, j2, j3) = limits.acceleration, limits.jerk
    return (
        limits.velocity,
        (share * a1, share * a2, share * a3),
        (share * j1, share * j2, share * j3),
    )
