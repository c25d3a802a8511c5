"""How each event replaces the motion that is held: its own value and a time in, the next value out.

A new plan begins where the held one is at that time. If there is none, the held one goes on.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import NamedTuple

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.commands import (
    Command,
    DriveLimits,
    Jog,
    Move,
    path_of,
    stays_within,
)
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanRole
from tri_glide_kinematics.motion.engine.path_replanning import PathReplanning
from tri_glide_kinematics.motion.moves import (
    LONGEST_TRACKED,
    Along,
    MotionKind,
    MotionPlanner,
    own_stop,
)
from tri_glide_kinematics.motion.trajectory import (
    AT_REST,
    CubicPlan,
    LinePlan,
    PathPlan,
    SequencePlan,
    SliderState,
)
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace


class Replanned(NamedTuple):
    """What is held after an event.

    Attributes:
        held: the next value.
        refusal: why a goal that had to wait was given up; None if that did not happen.
    """

    held: HeldMotion
    refusal: KinematicsError | None = None


class Replanning:
    """Makes the next value of what is held; times are counted from the start of its plan [s]."""

    def __init__(self, workspace: Workspace, kind: MotionKind) -> None:
        """Prepare for moves of a ``kind`` inside ``workspace``."""
        self._workspace = workspace
        self._kind = kind
        self._planner = MotionPlanner(workspace, kind)
        self._paths = PathReplanning(workspace, self._planner, self.braked)

    def at_rest(self, heights: Vector3, limits: DriveLimits) -> HeldMotion:
        """Return rest at ``heights`` [m], with ``limits`` in force."""
        plan = CubicPlan(SliderState(heights, AT_REST, AT_REST), ((), (), ()))
        return HeldMotion(plan, None, PlanRole.LEADS_TO_GOAL, self._workspace, limits)

    def with_goal(self, held: HeldMotion, time: float, goal: Command) -> Interruptible[HeldMotion]:
        """Return a plan to ``goal``, or the held one with that goal if limits are pending.

        Raises:
            KinematicsError: if there is none.
        """
        path = path_of(goal)
        if path is not None and path.heights is None:
            return (yield from self._paths.with_path(held, time, path))
        if held.pending is None:
            return (yield from self._planned(held, time, goal, held.limits, or_after=True))
        return replace(held, goal=goal)

    def braked(
        self, held: HeldMotion, time: float, *, stays: bool = True
    ) -> Interruptible[HeldMotion]:
        """Return ``held`` with a plan that comes to rest as soon as possible, if there is one.

        Args:
            held: what is held; of the path that is its goal nothing leads away.
            time: when the plan begins.
            stays: whether the platform stays on its line or path where that takes little longer.
        """
        plan, left = held.plan, held.plan.duration - time
        if held.role is PlanRole.BRAKES or left <= 0.0:
            return replace(held, role=PlanRole.BRAKES)
        if held.path_plan is not None:
            return (yield from self._paths.braked(held, held.path_plan, time))
        state, region, limits = plan.at(time), self._region(held, time), held.limits.effective
        own = own_stop(state, limits)
        stopping = self._planner.stopping
        along: Along | None = None
        if not stays:
            pass
        elif isinstance(plan, PathPlan):
            along = partial(self._paths.braking_along, plan, time, held.limits)
        elif held.tracked_step is not None:
            # The braking that is held keeps the direction, or nearly.
            if left <= LONGEST_TRACKED * own.duration:
                return replace(held, role=PlanRole.BRAKES)
        elif self._kind is MotionKind.LINEAR or isinstance(plan, LinePlan):
            along = partial(stopping.along_line, state, limits, region)
        try:
            stop = yield from stopping.soonest(state, own, limits, region, left, along)
        except KinematicsError:
            return replace(held, role=PlanRole.EARLIER)
        sooner = plan if stop is None else stop
        return replace(held, plan=sooner, role=PlanRole.BRAKES)

    def tried_again(self, held: HeldMotion, time: float) -> Interruptible[Replanned]:
        """Put pending limits in force if that is possible now, and brake if not."""
        plan, refusal = held.plan, None
        if held.pending is not None:
            held, refusal = yield from self._with_pending_in_force(held, time)
        if held.plan is plan and held.waits(time):
            held = yield from self.braked(held, time)
        return Replanned(held, refusal)

    def _with_pending_in_force(self, held: HeldMotion, time: float) -> Interruptible[Replanned]:
        """Put pending limits in force if the motion can go on inside them."""
        limits, goal = held.pending, held.goal
        assert limits is not None
        if held.followed is not None and held.followed.is_paused:
            goal = None
        resting = time >= held.plan.duration
        if not resting and goal is not None:
            if stays_within(held.plan.at(time), limits.effective):
                try:
                    planned = self._planned(held, time, goal, limits, or_after=False)
                    return Replanned((yield from planned))
                except KinematicsError:
                    pass
        if resting or limits == held.limits or held.plan.keeps_limits(limits.effective, time):
            held = replace(held, limits=limits, pending=None)
            if goal is not None and held.role is not PlanRole.LEADS_TO_GOAL:
                return (yield from self._resumed(held, time, goal))
        return Replanned(held)

    def _resumed(self, held: HeldMotion, time: float, goal: Command) -> Interruptible[Replanned]:
        """Go on to a goal that had to wait; if there is no way, give it up with the reason."""
        if held.followed is not None:
            return (yield from self.continued(held, time))
        try:
            planned = self._planned(held, time, goal, held.limits, or_after=True)
            return Replanned((yield from planned))
        except KinematicsError as error:
            return Replanned(replace(held, goal=None), error)

    def _planned(
        self, held: HeldMotion, time: float, goal: Command, limits: DriveLimits, *, or_after: bool
    ) -> Interruptible[HeldMotion]:
        """Return a plan that leads to ``goal``.

        Args:
            held: what is held.
            time: when the plan begins.
            goal: to be reached.
            limits: for all of the plan.
            or_after: whether the held plan may come first, if there is no better way.

        Raises:
            KinematicsError: if there is none.
        """
        path = path_of(goal)
        if path is not None:
            return (yield from self._paths.on_path(held, time, path, limits))
        state, moving = held.plan.at(time), time < held.plan.duration
        region = self._region(held, time)
        assert isinstance(goal, Move | Jog), "a moving target is tracked, never planned"
        after = SequencePlan((held.plan,), time) if or_after else None
        plan = yield from goal.planned(self._planner, state, limits, region, moving, after)
        return HeldMotion(plan, goal, PlanRole.LEADS_TO_GOAL, region, limits)

    def continued(self, held: HeldMotion, time: float) -> Interruptible[Replanned]:
        """Return the next part of the path that is followed; give it up if there is none."""
        goal = held.followed
        assert goal is not None
        try:
            return Replanned((yield from self._paths.on_path(held, time, goal, held.limits)))
        except KinematicsError as error:
            if time < held.plan.duration:
                return Replanned(replace(held, goal=replace(goal, from_rest=True)))
            return Replanned(replace(held, goal=None), error)

    def _region(self, held: HeldMotion, time: float) -> Workspace:
        """Return where the platform may be on a way that begins at a ``time``."""
        moving = time < held.plan.duration
        return self._planner.region(held.plan.at(time), held.region if moving else None)
