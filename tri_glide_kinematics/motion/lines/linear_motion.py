"""Plans on straight platform lines: from rest, in mid-motion, and to a stop.

Every plan is bounded as a whole by ``line_demand`` before it is handed out; how it was found is
of no consequence for the limits. Whether it stays inside the workspace is for the caller to check.
"""

from __future__ import annotations

import math

import numpy as np

from tri_glide_kinematics.motion.aims import Aim, StopAim
from tri_glide_kinematics.motion.errors import PlanningError, SliderLimitError
from tri_glide_kinematics.motion.limits import QUANTITIES, RELATIVE_ROUNDING, SliderLimits
from tri_glide_kinematics.motion.lines.jog_timing import SHAPE as JOG_SHAPE
from tri_glide_kinematics.motion.lines.jog_timing import JogGains, JogTiming
from tri_glide_kinematics.motion.lines.line_demand import line_demand, slowdown
from tri_glide_kinematics.motion.lines.line_entry import LineEntry
from tri_glide_kinematics.motion.lines.line_plan import LinePlan
from tri_glide_kinematics.motion.lines.line_timing import SHAPE, LineTiming
from tri_glide_kinematics.motion.lines.pacing import line_pace
from tri_glide_kinematics.motion.lines.straight_line import StraightLine
from tri_glide_kinematics.motion.phases import shortest_piece, with_knots_of
from tri_glide_kinematics.motion.plans import CubicPlan, SliderState
from tri_glide_kinematics.tri_glide.kinematics import TriGlide

# Speed against the direction of a line that is rounding [m/s].
NO_BACKWARD_SPEED = 1e-8

# In mid-motion a law cannot be stretched, as its first speed is given. It is planned again, slower,
# so often and to that factor at most.
ATTEMPTS = 3
LEAST_HASTE = 0.5
MORE_THAN_ENOUGH = 1.02

# A blend may take longer than it takes to stop, by this factor. A jog is to follow the hand.
LONGEST_BLEND = 4.0
LONGEST_JOG_BLEND = 2.0

# A jog has more to adapt: two ramps and the speed in between.
JOG_ATTEMPTS = 4

# Which part of a braking is over when a new line begins, tried one after the other.
DELAYS = (0.5, 0.75)


class LinearMotion:
    """Finds plans on straight lines for one machine; holds ruckig and nothing of the motion."""

    def __init__(self, machine: TriGlide) -> None:
        """Prepare ruckig for ``machine``."""
        self._machine = machine
        self._entry = LineEntry(machine)
        self._timing = LineTiming()
        self._jogs = JogTiming()

    def from_rest(self, line: StraightLine, limits: SliderLimits) -> LinePlan:
        """Return the shortest plan found from rest at the start of ``line`` to rest at its end.

        Args:
            line: of positive length.
            limits: of the sliders.

        Raises:
            PlanningError: if the line comes so close to the reach of an arm that none is found.
        """
        return LinePlan(line, self._timing.from_rest(line, limits))

    def in_motion(
        self, state: SliderState, aim: Aim, limits: SliderLimits, share: float
    ) -> LinePlan:
        """Return a plan that goes over from ``state`` to a line without stopping.

        Args:
            state: of the sliders.
            aim: gives the line.
            limits: of the sliders.
            share: part of acceleration and jerk for the blend; the line gets the rest.

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        entry = self._entry.moving(state, aim, limits, share)
        _check_length(entry.blend, state, limits, LONGEST_BLEND)
        paced = line_pace(entry.line, limits, SHAPE)
        haste = 1.0
        for attempt in range(ATTEMPTS):
            law = self._timing.in_motion(entry, paced, 1.0 - share, haste)
            plan = LinePlan(entry.line, law, entry.blend)
            try:
                check_line(plan, limits)
            except SliderLimitError as error:
                haste /= MORE_THAN_ENOUGH * error.slowdown
                if attempt == ATTEMPTS - 1 or haste < LEAST_HASTE:
                    raise
            else:
                return plan
        raise AssertionError("the last attempt returns or raises")

    def delayed(self, state: SliderState, aim: Aim, limits: SliderLimits) -> LinePlan:
        """Return a plan that brakes, and begins with the line before all sliders rest.

        Args:
            state: of the sliders.
            aim: gives the line.
            limits: of the sliders.

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        entry = self._entry.resting(state, aim, limits)
        assert entry.blend is not None
        shortest = shortest_piece(entry.line.length, max(limits.acceleration))
        undelayed = self._timing.from_rest(entry.line, limits)
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

    def jog(
        self,
        state: SliderState,
        aim: Aim,
        limits: SliderLimits,
        share: float,
        platform_speed: float,
    ) -> LinePlan:
        """Return a plan that goes over to steady speed along a line, and to rest at its end.

        Args:
            state: of the sliders, at rest or in motion.
            aim: gives the line.
            limits: of the sliders.
            share: part of acceleration and jerk for the blend; the line gets the rest.
            platform_speed: largest speed of the platform once it is on the line [m/s].

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        entry = self._entry.moving(state, aim, limits, share)
        _check_length(entry.blend, state, limits, LONGEST_JOG_BLEND)
        paced = line_pace(entry.line, limits, JOG_SHAPE, platform_speed)
        gains = JogGains(begin=1.0 - share)
        for _ in range(JOG_ATTEMPTS):
            timed = self._jogs.law(entry, paced, gains)
            slowdowns = slowdown(line_demand(entry.line, timed.law, entry.blend), limits)
            if slowdowns.max() <= 1.0 + RELATIVE_ROUNDING:
                break
            gains = gains.after(timed, slowdowns)
        law = timed.law
        if entry.blend is None and entry.speed == 0.0:
            law = law.slower(max(float(slowdowns.max()), 1.0))
        return _checked(LinePlan(entry.line, law, entry.blend), limits)

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


def _check_length(
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
    law = plan.law.since(since)
    with np.errstate(invalid="ignore"):
        demand = line_demand(plan.line, law, plan.blend)
    if not demand.backwards <= NO_BACKWARD_SPEED:
        raise PlanningError("the platform cannot stop before the end of the line")
    for (quantity, unit), values, bound in zip(QUANTITIES, demand[:3], limits.table):
        ratios = values / bound[:, np.newaxis]
        slider, piece = divmod(int(ratios.argmax()), ratios.shape[1])
        if not ratios[slider, piece] <= 1.0 + RELATIVE_ROUNDING:
            value, time = float(values[slider, piece]), float(law.times[piece])
            raise SliderLimitError(quantity, slider, value, float(bound[slider]), unit, time)
