"""Plans in slider space: the sliders arrive together, on a path of the platform that is bent.

Ruckig gives the jerks. They are integrated, and every plan is compared with the limits.
"""

from __future__ import annotations

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import SliderLimitError
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.trajectory import (
    CubicPlan,
    RuckigPlanner,
    StraightPlan,
    UsableParts,
    checked,
    kept,
    total_duration,
)
from tri_glide_kinematics.vectors import Vector3


class SliderMotion:
    """Makes plans whose velocities, accelerations and jerks are inside the limits."""

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(3)
        self._leader = RuckigPlanner(1)

    def move(
        self, state: SliderState, heights: Vector3, limits: SliderLimits
    ) -> Interruptible[CubicPlan]:
        """Return the plan from ``state`` to rest at ``heights`` [m].

        From rest the sliders keep the ratio of their ways, so that the path is a straight line
        in slider space, whatever the limits; otherwise they only arrive at the same time.

        Raises:
            PlanningError: if there is none.
            SliderLimitError: if it breaks a limit, because the state already leads to that.
            AddedBoundError: if it breaks an added bound.
        """
        if state.velocities == AT_REST and state.accelerations == AT_REST:
            plan = yield from self._from_rest(state, heights, limits)
            try:
                plan.check_sliders(limits)
            except SliderLimitError as error:
                # By ruckig's rounding.
                plan = yield from self._from_rest(state, heights, limits, error.slowdown)
                plan.check_sliders(limits)
            return plan
        bounds = (limits.velocity, limits.acceleration, limits.jerk)
        plan = CubicPlan(state, self._ruckig.to_rest_at(heights, *state, bounds))
        return (yield from checked(plan, limits))

    def _from_rest(
        self, state: SliderState, heights: Vector3, limits: SliderLimits, slowdown: float = 1.0
    ) -> Interruptible[CubicPlan]:
        """Return the fastest plan along the straight line in slider space to ``heights`` [m].

        It takes ``slowdown`` times as long.

        It keeps the added bounds; whether the sliders keep theirs is for the caller to check.

        The slider with the longest way leads, under limits with which all keep theirs. (Ruckig can
        be asked to synchronize the phases itself. If the limits of the sliders differ it often does
        not, without an error, and the path bends.)

        Raises:
            PlanningError: if there is none.
        """
        w1, w2, w3 = (end - start for start, end in zip(state.heights, heights))
        longest = max(w1, w2, w3, key=abs)
        if longest == 0.0:
            return CubicPlan(state, ((), (), ()))
        ratios = (w1 / longest, w2 / longest, w3 / longest)
        velocity, acceleration, jerk = (
            min(bound / abs(ratio) for bound, ratio in zip(bounds, ratios) if ratio)
            for bounds in (limits.velocity, limits.acceleration, limits.jerk)
        )

        def plan(usable: UsableParts) -> tuple[StraightPlan, float]:
            """Return the plan with parts of the limits, and when it is fastest [s]."""
            upwards, downwards = usable.rising * acceleration, usable.braking * acceleration
            if longest < 0.0:
                upwards, downwards = downwards, upwards
            others = [downwards] if limits.added else None
            bounds = [usable.velocity * velocity], [upwards], [jerk]
            (phases,) = self._leader.to_rest_at(
                [longest], [0.0], [0.0], [0.0], bounds, downwards=others
            )
            slower = slowdown * usable.slower
            phases = [(slower * duration, each / slower**3) for duration, each in phases]
            # Four phases of seven come after that.
            fastest = total_duration(phases[:-4])
            return StraightPlan(state.heights, ratios, phases), fastest

        return (yield from kept(plan, limits))
