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

from dataclasses import dataclass
from enum import Enum

from tri_glide_kinematics.motion.commands import Command, DriveLimits, Jog, Track
from tri_glide_kinematics.motion.plans import Plan
from tri_glide_kinematics.workspace.workspace import Workspace


class MotionPhase(Enum):
    """What the engine is doing."""

    IDLE = "idle"
    MOVING = "moving"
    JOGGING = "jogging"
    TRACKING = "tracking"
    STOPPING = "stopping"


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

    plan: Plan
    goal: Command | None
    role: PlanRole
    region: Workspace
    limits: DriveLimits
    pending: DriveLimits | None = None

    def phase(self, time: float) -> MotionPhase:
        """Return what is being done ``time`` seconds after the start of the plan."""
        if isinstance(self.goal, Track):
            return MotionPhase.TRACKING
        if time >= self.plan.duration and self.pending is None:
            return MotionPhase.IDLE
        if self.goal is None:
            return MotionPhase.STOPPING
        return MotionPhase.JOGGING if isinstance(self.goal, Jog) else MotionPhase.MOVING

    def waits(self, time: float) -> bool:
        """Return whether something is to be tried again, ``time`` seconds after the start."""
        if self.pending is not None:
            return True
        return self.role is PlanRole.EARLIER and time < self.plan.duration
