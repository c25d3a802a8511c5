"""What the engine holds: a plan, what it is for, and its limits. One value, never half done.

``Replanning`` replaces it as a whole, in one of these ways:

============================  =======================  ========  ==============================
what happens                  plan                     goal      pending limits
============================  =======================  ========  ==============================
start at measured heights     no motion                none      none, in force from now on
a goal                        leads to it              new       none
a goal while limits wait      as it was                new       as they were
a goal with another shaper    brakes                   new       new, with that shaper
a goal no shaped plan is for  as it was                new       those in force: tried again
stop                          brakes                   none      as they were
a moving target               as it was, or brakes     new       as they were
a step of tracking            step, then braking       same      none, the newest in force
a sooner plan on a line       leads to the goal        same      none
new limits that can be kept   leads to the goal        same      none, in force from now on
new limits that cannot        brakes                   same      new
limits that can be kept now   leads to the goal        same      none, in force from now on
a goal that has no plan then  as it was                none      none
============================  =======================  ========  ==============================

A braking that would break a limit just now is tried again; meanwhile the earlier plan goes on,
which ends at rest as well.

``PlanHolder`` holds one after the other, with the time that has passed in its plan, and what the
shaper makes. Plans are made, held and replaced as without a shaper; it is the mean of their
platform positions that is driven. So the past belongs to the motion as long as the shaper lasts,
and a plan may only replace the held one if what is driven then keeps all limits, from the first
setpoint to rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from tri_glide_kinematics.motion.engine.commands import Command, MotionPhase, Transfer
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
from tri_glide_kinematics.motion.errors import NotStartedError
from tri_glide_kinematics.motion.limits import SampledPlan, SliderState
from tri_glide_kinematics.motion.path import DrivenPath
from tri_glide_kinematics.motion.shaped import DrivenPart, ShapedTrajectory
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.trajectory import (
    LinePlan,
    PathHeights,
    PathPlan,
    TrackedStep,
    Trajectory,
)
from tri_glide_kinematics.motion.transfer import TransferPlan
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Workspace


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


class HeldTransfer(NamedTuple):
    """A transfer that is the goal.

    Attributes:
        goal: what is asked for.
        plan: that is held of it.
    """

    goal: Transfer
    plan: TransferPlan


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
        quick: the plan, if it is a line from rest that was found quickly, until one that is sooner
            at its end has been looked for.
    """

    plan: Trajectory
    goal: Command | None
    role: PlanRole
    region: Workspace
    limits: DriveLimits
    pending: DriveLimits | None = None
    path: FollowedPath | None = None
    quick: LinePlan | None = None

    def with_goal(self, goal: Command | None, **changes: Any) -> HeldMotion:
        """Return this with another goal, which is no path yet, and with other ``changes``."""
        return replace(self, goal=goal, path=None, **changes)

    def with_goal_for_later(self, goal: Command) -> HeldMotion:
        """Return this with a ``goal`` that waits for limits: the plan leads somewhere else."""
        held = self.with_goal(goal)
        return held if held.brakes else held.waiting_to_brake()

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
        if self.goal is None:
            return None
        transfer = self.transfer
        return self.goal.destination if transfer is None else transfer.plan.end

    @property
    def transfer_plan(self) -> TransferPlan | None:
        """The held plan, if it is one of a transfer, be that the goal or not any more."""
        return self.plan if isinstance(self.plan, TransferPlan) else None

    @property
    def transfer(self) -> HeldTransfer | None:
        """The transfer that is the goal, if the held plan is one of it."""
        goal, plan = self.goal, self.transfer_plan
        if plan is None or not isinstance(goal, Transfer):
            return None
        return HeldTransfer(goal, plan)

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
    def may_be_sooner(self) -> bool:
        """Whether a plan that is sooner at the goal is to be looked for."""
        is_free = self.pending is None and self.limits.shaper is None
        return self.quick is self.plan and is_free and self.role is PlanRole.LEADS_TO_GOAL

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
        if self.goal is not None and self.goal.destination_unknown:
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


class PathProgress(NamedTuple):
    """How far a path is driven.

    Attributes:
        segment: number of the present one, from 0.
        way: driven from the start of the path [m].
        way_remaining: to its end [m].
        time_remaining: as far as it is planned; beyond that, at the mean speed of what is; NaN
            where nothing of it is planned [s].
        deviation: the largest distance from the path as programmed may be this, up to here [m].
    """

    segment: int
    way: float
    way_remaining: float
    time_remaining: float
    deviation: float


def progress(heights: PathHeights, place: float, plan: Trajectory, time: float) -> PathProgress:
    """Return how far the path is driven.

    Args:
        heights: on the path.
        place: where the platform is, or left it [m].
        plan: that is carried out.
        time: that has passed in it [s].
    """
    driven = heights.driven
    way = _way(heights, place)
    remaining = max(plan.duration - time, 0.0)
    left = driven.arc_length.total - way
    if not isinstance(plan, PathPlan):
        # It leads to where the path begins, or stands still on it.
        remaining = math.nan if left > 0.0 else 0.0
    elif plan.heights.driven is heights.driven and not plan.ends_path:
        planned = _way(heights, plan.place(plan.duration)) - way
        rest = left - planned
        speed = planned / remaining if remaining > 0.0 else 0.0
        remaining = remaining + rest / speed if speed > 0.0 else math.nan
    segment = int(driven.segment_of(place))
    return PathProgress(segment, way, left, remaining, driven.deviation_up_to(place))


def _way(heights: PathHeights, place: float) -> float:
    return float(heights.driven.ways(np.array([place]))[0])


class ShapedMotion:
    """The shaped motion of the plans that are held one after the other.

    Attributes:
        time: since the newest of them is held [s].
    """

    def __init__(self, machine: TriGlide, shaper: Shaper, driven: Sequence[DrivenPart]) -> None:
        """Begin with what is ``driven``, seen from now."""
        self._machine = machine
        self._trajectory = ShapedTrajectory(machine, shaper, driven)
        self.time = 0.0

    @classmethod
    def from_rest(
        cls, machine: TriGlide, shaper: Shaper, plan: Trajectory, time: float
    ) -> ShapedMotion:
        """Return the motion of a ``plan`` that begins at rest, ``time`` seconds after its start."""
        return cls(machine, shaper, [DrivenPart(-time, plan, 0.0)])

    @property
    def shaper(self) -> Shaper:
        """Its impulses."""
        return self._trajectory.shaper

    def followed_by(self, plan: Trajectory, elapsed: float) -> ShapedMotion:
        """Return the motion that goes on with another ``plan``, of which some time is past [s]."""
        parts = self._with(plan, -elapsed)
        return ShapedMotion(self._machine, self.shaper, parts)

    def going_on(self, plan: Trajectory, lead: float) -> ShapedTrajectory:
        """Return the motion, from now on, if a ``plan`` takes over in ``lead`` seconds.

        If it is the plan that is held, that goes on as it is.
        """
        parts = self._driven
        if plan is not parts[-1].plan:
            parts = self._with(plan, lead)
        return ShapedTrajectory(self._machine, self.shaper, parts)

    @property
    def _driven(self) -> list[DrivenPart]:
        """All parts, seen from now."""
        return [part._replace(begin=part.begin - self.time) for part in self._trajectory.driven]

    def _with(self, plan: Trajectory, lead: float) -> list[DrivenPart]:
        """Return the parts that still count, seen from now, and another plan behind them."""
        parts = [part for part in self._driven if part.begin < lead]
        ends = [part.begin for part in parts[1:]]
        forgotten = sum(end < -self.shaper.duration for end in ends)
        return [*parts[forgotten:], DrivenPart(lead, plan, 0.0)]

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds from now."""
        return self._trajectory.at(self.time + time)

    @property
    def place(self) -> float:
        """How far along the path of the newest plan the platform is, as the mean of places [m]."""
        return self._trajectory.place(self.time)

    @property
    def time_to_rest(self) -> float:
        """Time until the platform rests [s]."""
        return max(self._trajectory.duration - self.time, 0.0)

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at ``times`` from now on. Shape (n,) [s]."""
        return self._trajectory.sample(self.time + times)._replace(times=times)


class PlanHolder:
    """Holds one plan after the other, with the time that has passed in it.

    Attributes:
        motion: what is held; None before the start.
        shaped: what the shaper makes of it; None without a shaper.
        time: that has passed in its plan [s].
        elapsed: time that the engine was stepped by [s].
        plan_number: counts the plans held so far: a new number is a new plan.
        first_limits: for the start.
    """

    def __init__(self, machine: TriGlide, limits: DriveLimits) -> None:
        """Hold nothing yet of a ``machine``; ``limits`` are for the start."""
        self._machine = machine
        self.motion: HeldMotion | None = None
        self.shaped: ShapedMotion | None = None
        self.time = 0.0
        self.elapsed = 0.0
        self.plan_number = 0
        self.first_limits = limits

    @property
    def held(self) -> HeldMotion:
        """What is held.

        Raises:
            NotStartedError: before the start.
        """
        if self.motion is None:
            raise NotStartedError
        return self.motion

    def check_started(self) -> None:
        """Check that something is held.

        Raises:
            NotStartedError: before the start.
        """
        if self.motion is None:
            raise NotStartedError

    @property
    def limits(self) -> DriveLimits:
        """Limits in force."""
        return self.motion.limits if self.motion else self.first_limits

    @property
    def newest_limits(self) -> DriveLimits:
        """Limits that are asked for; they may still be pending."""
        pending = self.motion.pending if self.motion else None
        return pending or self.limits

    @property
    def time_to_rest(self) -> float:
        """Time until the held plan is at rest, at its goal or before [s]."""
        if self.shaped is not None:
            return self.shaped.time_to_rest
        return max(self.motion.plan.duration - self.time, 0.0) if self.motion else 0.0

    @property
    def target(self) -> Vector3 | None:
        """Position of the platform that is being moved to or was reached [m]."""
        return self.motion.destination if self.motion else None

    @property
    def driven_path(self) -> DrivenPath | None:
        """The path that is followed, or was followed last; None without one."""
        path = self.motion.path if self.motion else None
        return path.heights.driven if path is not None else None

    @property
    def path_progress(self) -> PathProgress | None:
        """How far the path is driven that is followed, or was followed last; None without one."""
        held = self.motion
        if held is None or held.path is None:
            return None
        return progress(held.path.heights, held.place(self.time), held.plan, self.time)

    @property
    def path_place(self) -> float:
        """How far along the path as driven the setpoint is; NaN where it is on no path [m]."""
        plan = self.motion.path_plan if self.motion else None
        if plan is None:
            return math.nan
        return plan.place(self.time) if self.shaped is None else self.shaped.place

    @property
    def state(self) -> SliderState:
        """Present setpoint.

        Raises:
            NotStartedError: before the start.
        """
        held = self.held
        return held.plan.at(self.time) if self.shaped is None else self.shaped.at(0.0)

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints of the held plan at ``times`` from now on. Shape (n,) [s].

        Raises:
            NotStartedError: before the start.
        """
        times = np.asarray(times, dtype=np.float64)
        if self.shaped is not None:
            return self.shaped.sample(times)
        return self.held.plan.sample(self.time + times)._replace(times=times)

    def hold(self, held: HeldMotion, elapsed: float = 0.0) -> None:
        """Hold something else; of a new plan ``elapsed`` seconds are past already."""
        last, time, number, shaped = self.motion, self.time, self.plan_number, self.shaped
        if last is None or held.plan is not last.plan:
            time = elapsed
            # The steps of tracking are one motion.
            if last is None or last.tracked_step is None or held.tracked_step is None:
                number += 1
            if shaped is not None:
                shaped = shaped.followed_by(held.plan, elapsed)
        shaper = held.limits.shaper
        if shaper is None:
            shaped = None
        elif shaped is None or shaped.shaper is not shaper:
            # A shaper is put in force at rest, and so it is empty.
            if time >= held.plan.duration:
                time = max(time, held.rests_at)
            shaped = ShapedMotion.from_rest(self._machine, shaper, held.plan, time)
        # All of it, or nothing, whatever fails before.
        self.motion, self.time, self.plan_number, self.shaped = held, time, number, shaped
