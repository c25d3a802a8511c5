"""What the engine holds: a plan, what it is for, and its limits. One value, never half done.

``Replanning`` replaces it as a whole, in one of these ways:

============================  =======================  ========  ==============================
what happens                  plan                     goal      pending limits
============================  =======================  ========  ==============================
start at measured heights     no motion                none      none, in force from now on
a goal                        leads to it              new       none
a goal while limits wait      as it was                new       as they were
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
from dataclasses import dataclass
from enum import Enum

from tri_glide_kinematics.motion.engine.commands import (
    Command,
    DriveLimits,
    Follow,
    Jog,
    MotionPhase,
    Track,
    path_of,
)
from tri_glide_kinematics.motion.trajectory import PathPlan, TrackedStep, Trajectory
from tri_glide_kinematics.workspace import Workspace


class PlanRole(Enum):
    """What the held plan does for the goal."""

    LEADS_TO_GOAL = "leads to the goal"
    BRAKES = "comes to rest first"
    EARLIER = "is an earlier one, as no braking keeps the limits just now"


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
        pending: limits that wait until the motion can keep them; None if there are none.
    """

    plan: Trajectory
    goal: Command | None
    role: PlanRole
    region: Workspace
    limits: DriveLimits
    pending: DriveLimits | None = None

    def phase(self, time: float) -> MotionPhase:
        """Return what is being done ``time`` seconds after the start of the plan."""
        goal = self.goal
        if isinstance(goal, Follow):
            return self._phase_on_path(goal, time)
        # Who follows a target has no end.
        if time >= self.plan.duration and self.pending is None and not isinstance(goal, Track):
            return MotionPhase.IDLE
        return MotionPhase.STOPPING if goal is None else goal.phase

    def _phase_on_path(self, goal: Follow, time: float) -> MotionPhase:
        rests = time >= self.plan.duration and self.pending is None
        if rests and self.ends_path:
            return MotionPhase.IDLE
        if goal.is_paused:
            return MotionPhase.PAUSED if rests else MotionPhase.STOPPING
        return MotionPhase.FOLLOWING

    @property
    def followed(self) -> Follow | None:
        """The path that is the goal; None if that is another, or none."""
        return path_of(self.goal)

    @property
    def jog(self) -> Jog | None:
        """The jog that is the goal; None if that is another, or none."""
        return self.goal if isinstance(self.goal, Jog) else None

    @property
    def tracked_target(self) -> Track | None:
        """The moving target that is the goal; None if that is another, or none."""
        return self.goal if isinstance(self.goal, Track) else None

    @property
    def tracked_step(self) -> TrackedStep | None:
        """The held plan, if it is a step of tracking and the braking after it."""
        return self.plan if isinstance(self.plan, TrackedStep) else None

    @property
    def path_plan(self) -> PathPlan | None:
        """The held plan, if it leads along the path that is the goal."""
        plan, goal = self.plan, self.followed
        if not isinstance(plan, PathPlan) or goal is None or goal.heights is None:
            return None
        return plan if plan.heights.driven is goal.heights.driven else None

    @property
    def ends_path(self) -> bool:
        """Whether the plan leads to the end of the path that is the goal."""
        plan = self.path_plan
        return plan is not None and plan.ends_path

    @property
    def goes_on_at(self) -> float:
        """When the next part of the path is to begin [s]; infinite where there is none."""
        goal = self.followed
        if goal is None or goal.is_paused or self.ends_path:
            return math.inf
        plan = self.path_plan
        if plan is None or goal.from_rest or self.role is not PlanRole.LEADS_TO_GOAL:
            return self.plan.duration
        return plan.continue_at

    def place(self, time: float) -> float:
        """Return how far along the path the platform is, or where it left it [m]; NaN without."""
        plan = self.path_plan
        if plan is not None:
            return plan.place(time)
        return self.followed.place if self.followed is not None else math.nan

    def remaining(self, time: float) -> float:
        """Return the time to the end of what was asked for; inf where it is not known [s].

        It is known where the plan leads there, and of a stop, which may be over sooner.
        """
        if self.phase(time) is MotionPhase.IDLE:
            return 0.0
        is_known = self.goal is None or self.role is PlanRole.LEADS_TO_GOAL
        if self.followed is not None:
            is_known = is_known and self.ends_path and not self.followed.is_paused
        elif self.jog is not None:
            # A tracked step is followed by the next one.
            is_known = is_known and self.tracked_step is None
        elif self.tracked_target is not None:
            is_known = False
        return self.plan.duration - time if is_known and self.pending is None else math.inf

    def waits(self, time: float) -> bool:
        """Return whether something is to be tried again, ``time`` seconds after the start."""
        if self.pending is not None:
            return True
        return self.role is PlanRole.EARLIER and time < self.plan.duration
