"""How a path that is followed, or its extension, replaces the motion that is held."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.commands import DriveLimits, Follow
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanRole
from tri_glide_kinematics.motion.moves import NEARLY, REACHED, MotionPlanner
from tri_glide_kinematics.motion.path_timing import PathPlanner
from tri_glide_kinematics.motion.trajectory import PathHeights, PathPlan
from tri_glide_kinematics.workspace import Workspace

# Comes to rest, from what is held and a time in it [s].
Braking = Callable[[HeldMotion, float], Interruptible[HeldMotion]]


class PathReplanning:
    """Makes the next value of what is held, where a path is the goal."""

    def __init__(self, workspace: Workspace, planner: MotionPlanner, braking: Braking) -> None:
        """Prepare for paths inside ``workspace``.

        Args:
            workspace: where the platform may be.
            planner: of the way to where a path begins.
            braking: of any other motion.
        """
        self._workspace = workspace
        self._machine = workspace.machine
        self._planner = planner
        self._paths = PathPlanner(workspace)
        self._braking = braking

    def with_path(self, held: HeldMotion, time: float, goal: Follow) -> Interruptible[HeldMotion]:
        """Return a motion with a new path as its goal, or with a longer one.

        Raises:
            KinematicsError: if the path cannot be driven.
        """
        if goal.extends:
            return (yield from self._extended(held, time, goal))
        heights = yield from self._paths.begun(goal.path)
        ready = replace(goal, heights=heights)
        if held.pending is not None:
            return replace(held, goal=ready, role=PlanRole.EARLIER)
        return (yield from self.on_path(held, time, ready, held.limits))

    def on_path(
        self, held: HeldMotion, time: float, goal: Follow, limits: DriveLimits
    ) -> Interruptible[HeldMotion]:
        """Return a plan for what comes next on the path, or on the way to it.

        Args:
            held: what is held.
            time: when the plan begins.
            goal: the path.
            limits: for all of the plan.

        Raises:
            KinematicsError: if there is none.
        """
        if goal.is_paused:
            return replace(held, goal=goal, limits=limits, pending=None)
        heights = goal.heights
        assert heights is not None
        state = held.plan.at(time)
        plan = held.path_plan if held.goal is goal else None
        if time < held.plan.duration:
            if plan is None:
                leaving = replace(held, goal=goal, role=PlanRole.EARLIER)
                return (yield from self._braking(leaving, time))
            next_plan = yield from self._going_on(plan, heights, time, limits)
            return HeldMotion(next_plan, goal, PlanRole.LEADS_TO_GOAL, self._workspace, limits)
        place = goal.place if plan is None else plan.place(time)
        if plan is not None and plan.ends_path:
            # There is nothing left to plan.
            return replace(held, role=PlanRole.LEADS_TO_GOAL, limits=limits, pending=None)
        goal = replace(goal, place=place, from_rest=False)
        x, y, z, *_ = heights.driven.state(place)
        begin = (x, y, z)
        if math.dist(begin, self._machine.forward(state.heights)) > REACHED:
            region = self._planner.region(state)
            approach = yield from self._planner.line(state, begin, limits.effective, region)
            return HeldMotion(approach, goal, PlanRole.LEADS_TO_GOAL, region, limits)
        scaled = heights.at_speed_scale(limits.speed_scale)
        next_plan = yield from self._paths.from_rest(scaled, place, limits.effective)
        return HeldMotion(next_plan, goal, PlanRole.LEADS_TO_GOAL, self._workspace, limits)

    def _going_on(
        self, plan: PathPlan, heights: PathHeights, time: float, limits: DriveLimits
    ) -> Interruptible[PathPlan]:
        scaled = heights.at_speed_scale(limits.speed_scale)
        return (yield from self._paths.going_on(plan, scaled, time, limits.effective))

    def braked(self, held: HeldMotion, plan: PathPlan, time: float) -> Interruptible[HeldMotion]:
        """Return ``held`` with a plan that comes to rest soon on the path of its ``plan``."""
        try:
            braking = yield from self._paths.brake(plan, time, held.limits.effective)
        except KinematicsError:
            return replace(held, role=PlanRole.EARLIER)
        if NEARLY * braking.duration >= plan.duration - time:
            return replace(held, role=PlanRole.BRAKES)
        return replace(held, plan=braking, role=PlanRole.BRAKES)

    def braking_along(
        self, plan: PathPlan, time: float, limits: DriveLimits, longest: float
    ) -> Interruptible[PathPlan]:
        """Return a plan that comes to rest on the path of a ``plan``, found at once or not at all.

        Args:
            plan: that is carried out.
            time: when the braking begins, in the ``plan`` [s].
            limits: that it keeps.
            longest: time that it may take [s].

        Raises:
            KinematicsError: if none is found.
        """
        return (yield from self._paths.brake_hard(plan, time, limits.effective, longest))

    def _extended(self, held: HeldMotion, time: float, goal: Follow) -> Interruptible[HeldMotion]:
        """Return ``held`` with a longer path.

        Where the held plan ends before the end of the path, it stays, and the path as it drives it.
        """
        before, plan = held.followed, held.path_plan
        assert before is not None and before.heights is not None
        if plan is None or time >= plan.duration:
            place = held.place(time)
            # At the end of a path there is nothing left to pause on.
            is_paused = before.is_paused and not held.ends_path
            before = replace(before, is_paused=is_paused)
            longer = replace(before, place=place)
            longer = yield from self._longer(longer, goal, place)
            if before.is_paused or held.pending is not None or time < held.plan.duration:
                return replace(held, goal=longer)
            return (yield from self.on_path(held, time, longer, held.limits))
        if plan.ends_path and held.pending is None and not before.is_paused:
            # To pass the end without a stop, its rounding has to begin before.
            try:
                longer = yield from self._longer(before, goal, plan.place(time))
                assert longer.heights is not None
                next_plan = yield from self._going_on(plan, longer.heights, time, held.limits)
                return replace(held, plan=next_plan, goal=longer, role=PlanRole.LEADS_TO_GOAL)
            except KinematicsError:
                pass
        longer = yield from self._longer(before, goal, plan.place(plan.duration))
        assert longer.heights is not None
        return replace(held, plan=plan.moved_to(longer.heights, time), goal=longer)

    def _longer(self, before: Follow, goal: Follow, place: float) -> Interruptible[Follow]:
        assert before.heights is not None
        heights = yield from self._paths.extended(before.heights, goal.path, place)
        return replace(before, heights=heights)
