"""Plans on straight platform lines: from rest, of jogs, and to a stop.

However a plan was found, it is compared with the limits as a whole before it is handed out. Whether
it stays inside the workspace is for the caller to check.
"""

from __future__ import annotations

import math

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.moves.blends import LineEntry, check_length
from tri_glide_kinematics.motion.moves.jog_timing import NORM as JOG_NORM
from tri_glide_kinematics.motion.moves.jog_timing import JogFactors, JogTiming
from tri_glide_kinematics.motion.moves.line_ends import LineBuilder, LineToStop
from tri_glide_kinematics.motion.moves.line_timing import LineTiming
from tri_glide_kinematics.motion.moves.parametrisation import parametrise
from tri_glide_kinematics.motion.trajectory import (
    RELATIVE_ROUNDING,
    LinePlan,
    PlanningError,
    SliderLimits,
    SliderState,
    StraightLine,
    derivative_bounds,
    slowdown,
)
from tri_glide_kinematics.tri_glide import TriGlide

# A blend may take this many times as long as a stop, as a jog is to follow the hand.
LONGEST_JOG_BLEND = 2.0

# A jog has more to adapt: two ramps and the speed in between.
JOG_ATTEMPTS = 4


class LinearMotion:
    """Finds plans on straight lines for one machine; keeps nothing of a motion."""

    def __init__(self, machine: TriGlide) -> None:
        """Prepare ruckig for ``machine``."""
        self._machine = machine
        self._entry = LineEntry(machine)
        self._timing = LineTiming()
        self._jogs = JogTiming()

    def from_rest(self, line: StraightLine, limits: SliderLimits) -> Interruptible[LinePlan]:
        """Return the shortest plan found from rest at the start of ``line`` to rest at its end.

        Args:
            line: of positive length.
            limits: of the sliders.

        Raises:
            PlanningError: if the line comes so close to the reach of an arm that none is found.
        """
        scaling = yield from self._timing.from_rest(line, limits)
        return LinePlan(line, scaling)

    def jog(
        self,
        state: SliderState,
        builder: LineBuilder,
        limits: SliderLimits,
        fraction: float,
        platform_speed: float,
    ) -> Interruptible[LinePlan]:
        """Return a plan that goes over to steady speed along a line, and to rest at its end.

        Args:
            state: of the sliders, at rest or in motion.
            builder: makes the line.
            limits: of the sliders.
            fraction: of acceleration and jerk for the blend; the line gets what is left.
            platform_speed: largest speed of the platform once it is on the line [m/s].

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        entry = yield from self._entry.moving(state, builder, limits, fraction)
        check_length(entry.blend, state, limits, LONGEST_JOG_BLEND)
        yield
        parametrisation = parametrise(entry.line, limits, JOG_NORM, platform_speed)
        factors = JogFactors(begin=1.0 - fraction)
        for _ in range(JOG_ATTEMPTS):
            yield
            timed = self._jogs.time_scaling(entry, parametrisation, factors)
            yield
            slowdowns = slowdown(derivative_bounds(entry.line, timed.scaling, entry.blend), limits)
            if slowdowns.max() <= 1.0 + RELATIVE_ROUNDING:
                break
            factors = factors.after(timed, slowdowns)
        scaling = timed.scaling
        if entry.blend is None and entry.speed == 0.0:
            scaling = scaling.slower(max(float(slowdowns.max()), 1.0))
        yield
        return _checked(LinePlan(entry.line, scaling, entry.blend), limits)

    def brake(
        self,
        state: SliderState,
        limits: SliderLimits,
        fraction: float,
        beside: float,
        longest: float = math.inf,
    ) -> Interruptible[LinePlan]:
        """Return a plan that comes to rest along the direction in which the platform moves.

        Args:
            state: of the sliders, in motion.
            limits: of the sliders.
            fraction: of acceleration and jerk that is used.
            beside: part of it that leads onto the line, where the platform is beside it.
            longest: time that it may take [s].

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        _, velocity = self._machine.forward_velocity(state.heights, state.velocities)
        speed = math.hypot(*velocity)
        if speed == 0.0:
            raise PlanningError("the platform moves in no direction")
        x, y, z = velocity
        builder = LineToStop(self._machine.geometry, (x / speed, y / speed, z / speed))
        entry = yield from self._entry.moving(state, builder, limits, beside * fraction)
        yield
        if entry.blend is not None:
            if entry.blend.duration > longest:
                raise PlanningError("the motion beside the line would go on for too long")
            fraction *= 1.0 - beside
        scaling = self._timing.braking(entry, limits, fraction, longest)
        yield
        return _checked(LinePlan(entry.line, scaling, entry.blend), limits)


def _checked(plan: LinePlan, limits: SliderLimits) -> LinePlan:
    """Return the ``plan`` if it keeps the ``limits``."""
    plan.check_limits(limits)
    return plan
