"""Plans on straight platform lines: from rest, in mid-motion, and to a stop.

Every plan is bounded as a whole by ``line_demand`` before it is handed out; how it was found is
of no consequence for the limits. Whether it stays inside the workspace is for the caller to check.
"""

from __future__ import annotations

import math

import numpy as np

from tri_glide_kinematics.errors import PlanningError, SliderLimitError
from tri_glide_kinematics.limits import QUANTITIES, RELATIVE_ROUNDING, SliderLimits
from tri_glide_kinematics.planning.aims import Aim, StopAim
from tri_glide_kinematics.planning.line_demand import line_demand
from tri_glide_kinematics.planning.line_entry import LineEntry
from tri_glide_kinematics.planning.line_plan import LinePlan
from tri_glide_kinematics.planning.line_timing import LineTiming
from tri_glide_kinematics.planning.phases import shortest_piece, with_knots_of
from tri_glide_kinematics.planning.plans import SliderState
from tri_glide_kinematics.planning.straight_line import StraightLine
from tri_glide_kinematics.tri_glide import TriGlide

# Speed against the direction of a line that is rounding [m/s].
NO_BACKWARD_SPEED = 1e-8

# In mid-motion a law cannot be stretched, as its first speed is given. It is planned again, slower,
# so often and to that factor at most.
ATTEMPTS = 3
LEAST_HASTE = 0.5

# Which part of a braking is over when a new line begins, tried one after the other.
DELAYS = (0.5, 0.75)


class LinearMotion:
    """Finds plans on straight lines for one machine; holds ruckig and nothing of the motion."""

    def __init__(self, machine: TriGlide) -> None:
        """Prepare ruckig for ``machine``."""
        self._machine = machine
        self._entry = LineEntry(machine)
        self._timing = LineTiming()

    def from_rest(
        self, line: StraightLine, limits: SliderLimits, platform_speed: float = math.inf
    ) -> LinePlan:
        """Return the shortest plan found from rest at the start of ``line`` to rest at its end.

        Args:
            line: of positive length.
            limits: of the sliders.
            platform_speed: largest speed of the platform [m/s].

        Raises:
            PlanningError: if ruckig finds none.
        """
        return LinePlan(line, self._timing.from_rest(line, limits, platform_speed))

    def in_motion(
        self,
        state: SliderState,
        aim: Aim,
        limits: SliderLimits,
        share: float,
        platform_speed: float = math.inf,
    ) -> LinePlan:
        """Return a plan that goes over from ``state`` to a line without stopping.

        Args:
            state: of the sliders.
            aim: gives the line.
            limits: of the sliders.
            share: part of acceleration and jerk for the blend; the line gets the rest.
            platform_speed: largest speed of the platform once it is on the line [m/s].

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        entry = self._entry.moving(state, aim, limits, share)
        refusal: SliderLimitError | None = None
        haste = 1.0
        for _ in range(ATTEMPTS):
            law = self._timing.in_motion(entry, limits, platform_speed, 1.0 - share, haste)
            try:
                return _checked(LinePlan(entry.line, law, entry.blend), limits)
            except SliderLimitError as error:
                refusal = error
                haste /= 1.02 * error.slowdown
                if haste < LEAST_HASTE:
                    break
        assert refusal is not None
        raise refusal

    def delayed(
        self, state: SliderState, aim: Aim, limits: SliderLimits, platform_speed: float = math.inf
    ) -> LinePlan:
        """Return a plan that brakes, and begins with the line before all sliders rest.

        Args:
            state: of the sliders.
            aim: gives the line.
            limits: of the sliders.
            platform_speed: largest speed of the platform once it is on the line [m/s].

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        entry = self._entry.resting(state, aim, limits)
        assert entry.blend is not None
        shortest = shortest_piece(entry.line.length, max(limits.acceleration))
        undelayed = self._timing.from_rest(entry.line, limits, platform_speed)
        refusal: SliderLimitError | None = None
        for delay in DELAYS:
            law = undelayed.delayed(delay * entry.blend.duration)
            times = law.times.tolist()
            if entry.blend.duration > times[-1]:
                times.append(entry.blend.duration)
            law = law.with_knots(np.array(with_knots_of(times, entry.blend, shortest)))
            try:
                return _checked(LinePlan(entry.line, law, entry.blend), limits)
            except SliderLimitError as error:
                refusal = error
        assert refusal is not None
        raise refusal

    def brake(self, state: SliderState, limits: SliderLimits, part: float) -> LinePlan:
        """Return a plan that comes to rest along the direction in which the platform moves.

        Args:
            state: of the sliders, in motion.
            limits: of the sliders.
            part: of acceleration and jerk that is used.

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        _, velocity = self._machine.forward_velocity(state.heights, state.velocities)
        speed = math.hypot(*velocity)
        if speed == 0.0:
            raise PlanningError("the platform moves in no direction")
        x, y, z = velocity
        aim = StopAim(self._machine.geometry, (x / speed, y / speed, z / speed))
        entry = self._entry.moving(state, aim, limits, 1.0 - part)
        law = self._timing.braking(entry, limits, part)
        return _checked(LinePlan(entry.line, law, entry.blend), limits)


def _checked(plan: LinePlan, limits: SliderLimits) -> LinePlan:
    """Return the ``plan`` if it is inside the limits; raise what ``check_line`` does otherwise."""
    check_line(plan, limits)
    return plan


def check_line(plan: LinePlan, limits: SliderLimits, since: float = 0.0) -> None:
    """Compare bounds of what a plan asks of the sliders with their limits.

    Args:
        plan: to be checked.
        limits: of the sliders.
        since: pieces that end before this time are past, and not checked [s].

    Raises:
        SliderLimitError: if a limit may be exceeded.
        PlanningError: if the platform would go back along the line.
    """
    # A braking may lead out of reach; the NaN that this gives fails every comparison below.
    with np.errstate(invalid="ignore"):
        demand = line_demand(plan.line, plan.law.since(since), plan.blend)
    if not demand.backwards <= NO_BACKWARD_SPEED:
        raise PlanningError("the platform cannot stop before the end of the line")
    bounds = (limits.velocity, limits.acceleration, limits.jerk)
    for (quantity, unit), values, bound in zip(QUANTITIES, demand, bounds):
        peaks = values.max(axis=0)
        ratios = peaks / np.array(bound)
        worst = int(ratios.argmax())
        if not ratios[worst] <= 1.0 + RELATIVE_ROUNDING:
            raise SliderLimitError(quantity, worst, float(peaks[worst]), bound[worst], unit)
