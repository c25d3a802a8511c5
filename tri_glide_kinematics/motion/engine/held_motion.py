"""What the engine holds: a plan, what it is for, and its limits. One value, never half done.

``Replanning`` replaces it as a whole, in one of these ways:

============================  =======================  ========  ==============================
what happens                  plan                     goal      pending limits
============================  =======================  ========  ==============================
start at measured heights     no motion                none      none, in force from now on
a goal                        leads to it              new       none
a goal while limits wait      as it was                new       as they were
a goal with another shaper    brakes                   new       new, with that shaper
stop                          brakes                   none      as they were
a moving target               as it was, or brakes     new       as they were
a step of tracking            step, then braking       same      none, the newest in force
new limits that can be kept   leads to the goal        same      none, in force from now on
new limits that cannot        brakes                   same      new
limits that can be kept now   leads to the goal        same      none, in force from now on
a goal that has no plan then  as it was                none      none
============================  =======================  ========  ==============================

A braking that would break a limit just now is tried again; meanwhile the earlier plan goes on,
which ends at rest as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.motion.engine.commands import Command, MotionPhase
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.trajectory import (
    PathHeights,
    PathPlan,
    Planned,
    SliderLimits,
    SliderState,
    TrackedStep,
    Trajectory,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Workspace

if TYPE_CHECKING:
    from tri_glide_kinematics.tri_glide import TriGlide

# What a path asks for is multiplied by no more than this.
LARGEST_PATH_SPEED_SCALE = 2.0

# What a shaper leaves of velocities, accelerations and jerks to plans, as a rule; of added bounds,
# what it leaves of velocities or accelerations.
LEFT_TO_PLANS = (1.0, 0.98, 0.95)


@dataclass(frozen=True)
class DriveLimits:
    """Limits of the sliders, how much of their velocities is used, and how motion is shaped.

    Attributes:
        sliders: limits before the scale.
        speed_scale: in (0, 1].
        path_speed_scale: factor of the platform speeds that paths ask for, in (0, 2]; it is no
            factor of any limit.
        shaper: of the platform's motion; None for none.
        planned: what plans keep so that what the shaper makes of them keeps the limits; None where
            that is the same.
    """

    sliders: SliderLimits
    speed_scale: float
    path_speed_scale: float = 1.0
    shaper: Shaper | None = None
    planned: Planned | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """Check the scales.

        Raises:
            NotFiniteError: if one is NaN or infinite.
            OutOfBoundsError: if one is not in its interval.
        """
        largest = {"speed_scale": 1.0, "path_speed_scale": LARGEST_PATH_SPEED_SCALE}
        for name, bound in largest.items():
            scale = positive(name, getattr(self, name))
            if scale > bound:
                raise OutOfBoundsError(name, scale, f"at most {bound:g}")
            object.__setattr__(self, name, scale)

    @cached_property
    def scaled(self) -> SliderLimits:
        """Limits after the scale."""
        return self.sliders.with_velocity_scaled(self.speed_scale)

    @cached_property
    def effective(self) -> SliderLimits:
        """Limits that plans keep."""
        return self.planned.limits if self.planned is not None else self.scaled

    @property
    def of_path_speeds(self) -> float:
        """Factor of the platform speeds that paths ask for."""
        return self.speed_scale * self.path_speed_scale

    @cached_property
    def cut(self) -> float:
        """Part that plans let bends be cut by, of what the tolerances of a path leave."""
        return self.planned.cut if self.planned is not None else 1.0

    def leaving(
        self, planned: Planned | None = None, present: SliderState | None = None
    ) -> DriveLimits:
        """Return the same, with limits for plans that leave something to the shaper.

        Args:
            planned: what they keep; without it, what nearly always suffices.
            present: where they begin in motion: they leave no more than this state lets them.
        """
        if self.shaper is None:
            return self
        if planned is None:
            added = (each.times(LEFT_TO_PLANS[each.order - 1]) for each in self.scaled.added)
            planned = Planned(self.scaled.times(*LEFT_TO_PLANS).with_added(*added))
        if present is not None:
            planned = planned._replace(limits=_raised(planned.limits, present, self.scaled))
        return replace(self, planned=planned)

    @cached_property
    def held_back(self) -> float:
        """How long after the end of a plan the shaper still moves the platform [s]."""
        return self.shaper.duration if self.shaper is not None else 0.0


def stays_within(state: SliderState, limits: SliderLimits) -> bool:
    """Return whether the sliders can stay inside ``limits`` from this ``state`` on."""
    return all(
        abs(a) <= largest and abs(v) + (a * a / (2.0 * jerk) if a * v > 0.0 else 0.0) <= speed
        for v, a, speed, largest, jerk in zip(
            state.velocities,
            state.accelerations,
            limits.velocity,
            limits.acceleration,
            limits.jerk,
        )
    )


def _raised(lower: SliderLimits, state: SliderState, limits: SliderLimits) -> SliderLimits:
    """Return ``lower`` limits, raised as far as the sliders cannot stay inside them from a state.

    A braking cannot begin beyond the limits that it is planned for. They are raised to ``limits``
    at most.
    """
    velocities, accelerations = np.array(state.velocities), np.array(state.accelerations)
    gets_faster = velocities * accelerations > 0.0
    reached = np.abs(velocities) + gets_faster * accelerations**2 / (2.0 * lower.table[2])
    table = lower.table.copy()
    raised = np.maximum(table[:2], (reached, np.abs(accelerations)))
    table[:2] = np.minimum(raised, limits.table[:2])
    return limits.with_table(table).with_added(*(each.raised(state) for each in lower.added))


class PlanRole(Enum):
    """What the held plan does for the goal."""

    LEADS_TO_GOAL = "leads to the goal"
    BRAKES = "comes to rest first"
    EARLIER = "is an earlier one, as no braking keeps the limits just now"


@dataclass(frozen=True, eq=False)
class FollowedPath:
    """How far the path is that is the goal.

    Attributes:
        heights: of the sliders on the path as driven.
        place: from which the way goes on where no plan on the path is held [m].
        is_paused: whether to rest on the way.
        from_rest: whether the next part can only be planned from rest.
    """

    heights: PathHeights
    place: float = 0.0
    is_paused: bool = False
    from_rest: bool = False

    @property
    def end(self) -> Vector3:
        """Where the platform is to rest at last [m]."""
        x, y, z = self.heights.driven.segments.points[-1].tolist()
        return x, y, z


@dataclass(frozen=True)
class HeldMotion:
    """A verified plan to rest, what it is for, and the limits.

    Attributes:
        plan: that is carried out.
        goal: what was commanded last; None for a stop.
        role: what the plan does for the goal. It leads there, unless there is no goal or limits
            are pending.
        region: where the plan was checked to stay.
        limits: in force.
        pending: limits that wait until the motion can keep them, or until the shaper is empty and
            another one can take its place; None if there are none.
        path: that is the goal; None if that is no path, or there is none.
    """

    plan: Trajectory
    goal: Command | None
    role: PlanRole
    region: Workspace
    limits: DriveLimits
    pending: DriveLimits | None = None
    path: FollowedPath | None = None

    def with_goal(self, goal: Command | None, **changes: Any) -> HeldMotion:
        """Return this with another goal, which is no path yet, and with other ``changes``."""
        return replace(self, goal=goal, path=None, **changes)

    def on(self, path: FollowedPath) -> HeldMotion:
        """Return this somewhere else on its ``path``."""
        return replace(self, path=path)

    @property
    def brakes(self) -> bool:
        """Whether the plan comes to rest first."""
        return self.role is PlanRole.BRAKES

    def left_to_brake(self) -> HeldMotion:
        """Return this with its plan as a braking."""
        return replace(self, role=PlanRole.BRAKES)

    def waiting_to_brake(self) -> HeldMotion:
        """Return this with its plan as an earlier one, until there is a braking."""
        return replace(self, role=PlanRole.EARLIER)

    @cached_property
    def rests_at(self) -> float:
        """When nothing moves any more, after the start of the plan [s]."""
        return self.plan.duration + self.limits.held_back

    def phase(self, time: float) -> MotionPhase:
        """Return what is being done ``time`` seconds after the start of the plan."""
        rests = time >= self.rests_at and self.pending is None
        if self.path is not None:
            return self._phase_on_path(self.path, rests)
        goal = self.goal
        if goal is None:
            return MotionPhase.IDLE if rests else MotionPhase.STOPPING
        return MotionPhase.IDLE if rests and goal.has_end else goal.phase

    def _phase_on_path(self, path: FollowedPath, rests: bool) -> MotionPhase:
        if rests and self.ends_path:
            return MotionPhase.IDLE
        if path.is_paused:
            return MotionPhase.PAUSED if rests else MotionPhase.STOPPING
        return MotionPhase.FOLLOWING

    @property
    def destination(self) -> Vector3 | None:
        """Where the platform is to rest at last [m]; None if nobody knows."""
        if self.path is not None:
            return self.path.end
        return self.goal.destination if self.goal is not None else None

    @property
    def tracked_step(self) -> TrackedStep | None:
        """The held plan, if it is a step of tracking and the braking after it."""
        return self.plan if isinstance(self.plan, TrackedStep) else None

    @property
    def path_plan(self) -> PathPlan | None:
        """The held plan, if it leads along the path that is the goal."""
        plan, path = self.plan, self.path
        if not isinstance(plan, PathPlan) or path is None:
            return None
        return plan if plan.heights.driven is path.heights.driven else None

    @property
    def ends_path(self) -> bool:
        """Whether the plan leads to the end of the path that is the goal."""
        plan = self.path_plan
        return plan is not None and plan.ends_path

    @property
    def goes_on_at(self) -> float:
        """When the next part of the path is to begin [s]; infinite where there is none."""
        path = self.path
        if path is None or path.is_paused or self.ends_path:
            return math.inf
        plan = self.path_plan
        if plan is None or path.from_rest or self.role is not PlanRole.LEADS_TO_GOAL:
            return self.rests_at
        # A shaper has to be empty at a stop, as it would cut the corner.
        return plan.continue_at if plan.continue_at < plan.duration else self.rests_at

    def place(self, time: float) -> float:
        """Return how far along the path the platform is, or where it left it [m]; NaN without."""
        plan = self.path_plan
        if plan is not None:
            return plan.place(time)
        return self.path.place if self.path is not None else math.nan

    def remaining(self, time: float) -> float:
        """Return the time to the end of what was asked for; inf where it is not known [s].

        It is known where the plan leads there, and of a stop, which may be over sooner.
        """
        if self.phase(time) is MotionPhase.IDLE:
            return 0.0
        goal, path = self.goal, self.path
        is_known = goal is None
        if goal is not None and self.role is PlanRole.LEADS_TO_GOAL:
            # A tracked step is followed by the next one.
            is_known = goal.has_end and self.tracked_step is None
        if path is not None:
            is_known = is_known and self.ends_path and not path.is_paused
        if not is_known or self.pending is not None:
            return math.inf
        return self.rests_at - time

    def places(self, machine: TriGlide) -> FloatArray | None:
        """Return places that the platform passes on its way to the goal.

        Args:
            machine: whose sliders move.

        Returns:
            Shape (n, 3) [m]; None if it may come anywhere.
        """
        if self.goal is not None and self.goal.leads_anywhere:
            return None
        places = self.plan.places(machine)
        if self.path is None:
            return places
        of_path = self.path.heights.driven.places()
        return None if of_path is None else np.concatenate((places, of_path))

    def waits(self, time: float) -> bool:
        """Return whether something is to be tried again, ``time`` seconds after the start."""
        if self.pending is not None:
            return True
        return self.role is PlanRole.EARLIER and time < self.plan.duration
