"""Plans in slider space: each slider moves by itself in the common time, the platform bends along.

Ruckig gives the jerks. It is not trusted with the rest: every plan is integrated and checked here.
"""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.errors import SliderLimitError
from tri_glide_kinematics.motion.limits import QUANTITIES, RELATIVE_ROUNDING, SliderLimits
from tri_glide_kinematics.motion.plans import AT_REST, CubicPlan, SliderState
from tri_glide_kinematics.motion.ruckig_planner import RuckigPlanner
from tri_glide_kinematics.motion.sliders.straight_plan import StraightPlan
from tri_glide_kinematics.vectors import FloatArray, Vector3


class SliderMotion:
    """Makes plans whose velocities, accelerations and jerks are inside the limits."""

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(3)
        self._leader = RuckigPlanner(1)

    def move(self, state: SliderState, heights: Vector3, limits: SliderLimits) -> CubicPlan:
        """Return the plan from ``state`` to rest at ``heights`` [m].

        From rest the sliders keep the ratio of their ways, so that the path is a straight line
        in slider space, whatever the limits; otherwise they only arrive at the same time.

        Raises:
            PlanningError: if there is none.
            SliderLimitError: if it breaks a limit, because the state already leads to that.
        """
        if state.velocities == AT_REST and state.accelerations == AT_REST:
            plan = self._from_rest(state, heights, limits)
        else:
            bounds = (limits.velocity, limits.acceleration, limits.jerk)
            plan = CubicPlan(state, self._ruckig.to_rest_at(heights, *state, bounds))
        check_limits(plan, limits)
        return plan

    def _from_rest(self, state: SliderState, heights: Vector3, limits: SliderLimits) -> CubicPlan:
        """Return the fastest plan along the straight line in slider space to ``heights`` [m].

        The slider with the longest way leads, under limits with which all keep theirs. (Phases
        that ruckig synchronizes are no more than a wish: if the limits of the sliders differ, it
        often gives it up without a word, and the path bends.)

        Raises:
            PlanningError: if there is none.
        """
        w1, w2, w3 = (end - start for start, end in zip(state.heights, heights))
        longest = max(w1, w2, w3, key=abs)
        if longest == 0.0:
            return CubicPlan(state, ((), (), ()))
        shares = (w1 / longest, w2 / longest, w3 / longest)
        velocity, acceleration, jerk = (
            [min(bound / abs(share) for bound, share in zip(bounds, shares) if share)]
            for bounds in (limits.velocity, limits.acceleration, limits.jerk)
        )
        (phases,) = self._leader.to_rest_at(
            [longest], [0.0], [0.0], [0.0], (velocity, acceleration, jerk)
        )
        return StraightPlan(state.heights, shares, phases)

    def brake(self, state: SliderState, limits: SliderLimits) -> CubicPlan:
        """Return the plan that brings each slider to rest as soon as possible.

        Raises:
            PlanningError: if there is none.
            SliderLimitError: if it breaks a limit, because the state already leads to that.
        """
        jerks = self._ruckig.to_rest(
            state.velocities,
            state.accelerations,
            (limits.velocity, limits.acceleration, limits.jerk),
        )
        plan = CubicPlan(state, jerks)
        check_limits(plan, limits)
        return plan


def check_limits(plan: CubicPlan, limits: SliderLimits, since: float = 0.0) -> None:
    """Compare the exact extremes of a plan with the limits.

    Args:
        plan: to be checked.
        limits: of the sliders.
        since: what lies before this time is past, and not checked [s].

    Raises:
        SliderLimitError: if a limit is exceeded by more than rounding.
    """
    lengths, (_, velocity, acceleration, jerk) = plan.pieces_since(since)
    if not len(lengths):
        return
    time = lengths[:, np.newaxis]
    end_acceleration = acceleration + time * jerk
    end_velocity = velocity + time * (acceleration + time * jerk / 2.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        turning = np.where(
            acceleration * end_acceleration < 0.0,
            velocity - acceleration * acceleration / (2.0 * jerk),
            velocity,
        )
    peaks = (
        np.abs(np.concatenate((velocity, turning, end_velocity))).max(axis=0),
        np.abs(np.concatenate((acceleration, end_acceleration))).max(axis=0),
        np.abs(jerk).max(axis=0),
    )
    bounds = (limits.velocity, limits.acceleration, limits.jerk)
    for (quantity, unit), peak, bound in zip(QUANTITIES, peaks, bounds):
        for slider in range(3):
            if not peak[slider] <= bound[slider] * (1.0 + RELATIVE_ROUNDING):
                raise SliderLimitError(quantity, slider, float(peak[slider]), bound[slider], unit)


def height_extremes(plan: CubicPlan, since: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest height of each slider from ``since`` [s] to the end.

    They are at the ends of a piece or where the velocity, a quadratic of time, passes zero.

    Returns:
        Two arrays, each of shape (3,) [m].
    """
    final = np.array(plan.state(plan.duration).heights)[np.newaxis]
    lengths, (height, velocity, acceleration, jerk) = plan.pieces_since(since)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(acceleration * acceleration - 2.0 * jerk * velocity)
        sum_of_terms = -(acceleration + np.copysign(root, acceleration))
        turnings = np.stack((sum_of_terms / jerk, 2.0 * velocity / sum_of_terms))
        inside = (turnings > 0.0) & (turnings < lengths[:, np.newaxis])
    time = np.where(inside, turnings, 0.0)
    turns = height + time * (velocity + time * (acceleration / 2.0 + time * jerk / 6.0))
    heights = np.concatenate((final, height, *turns))
    return heights.min(axis=0), heights.max(axis=0)
