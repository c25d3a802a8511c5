"""How each event replaces the motion that is held: its own value and a time in, the next value out.

A new plan begins where the held one is at that time. If there is none, the held one goes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.commands import Command, Departure
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits, stays_within
from tri_glide_kinematics.motion.engine.held_motion import FollowedPath, HeldMotion, PlanRole
from tri_glide_kinematics.motion.engine.transfer_braking import TransferBraking
from tri_glide_kinematics.motion.errors import AddedBoundError, SliderLimitError
from tri_glide_kinematics.motion.limits import AT_REST, RELATIVE_ROUNDING, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import (
    LONGEST_TRACKED,
    NEARLY,
    REACHED,
    Along,
    MotionKind,
    MotionPlanner,
    own_stop,
)
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path_timing import PathPlanner
from tri_glide_kinematics.motion.shaped import SlowedPlan
from tri_glide_kinematics.motion.trajectory import (
    CubicPlan,
    LinePlan,
    PathHeights,
    PathPlan,
    SequencePlan,
    Trajectory,
    checked,
    gentler,
)
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# The held plan is slowed down on its own way if no other braking keeps all limits: in this many
# times the sliders' own stop, or in this time if that is more [s].
SLOWED, SHORTEST_SLOWED = 1.8, 0.15

# From the request to rest a stop takes at most so many times the sliders' own stop, or this time if
# that is more [s]; and as long as the shaper lasts.
LONGEST_STOP, ALWAYS_ALLOWED = 2.0, 0.2

# The held plan was accepted with one rounding error; so slowing it down may have two.
SLOWED_ROUNDING = 2.0 * RELATIVE_ROUNDING

# Comes to rest, from what is held and a time in it [s].
Braking = Callable[[HeldMotion, float], Interruptible[HeldMotion]]


def longest_stop(state: SliderState, limits: SliderLimits) -> float:
    """Return how long a stop from a ``state`` within ``limits`` may take, without a shaper [s]."""
    return max(LONGEST_STOP * own_stop(state, limits).duration, ALWAYS_ALLOWED)


def stops_in_time(held: HeldMotion, state: SliderState, time_to_rest: float) -> bool:
    """Return whether what is ``held`` is a braking that takes no longer than a stop may.

    Args:
        held: what is held.
        state: of the sliders now.
        time_to_rest: until the platform rests [s].
    """
    if held.limits.shaper is None or held.role is PlanRole.EARLIER:
        return held.role is not PlanRole.EARLIER
    # A plan is ahead of what is driven: where that gets faster its braking takes longer.
    return time_to_rest - held.limits.held_back <= longest_stop(state, held.limits.scaled)


class PathReplanning:
    """Makes the next value of what is held, where a path is the goal.

    Attributes:
        parts: plans the parts of paths, and motions along them.
    """

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
        self.parts = PathPlanner(workspace)
        self._braking = braking

    def with_path(
        self, held: HeldMotion, time: float, goal: Command, path: PlatformPath, extends: bool
    ) -> Interruptible[HeldMotion]:
        """Return a motion with a new path as its goal, or with a longer one.

        Args:
            held: what is held.
            time: when the next plan begins.
            goal: that the path is.
            path: to be followed.
            extends: whether it goes on from the end of the path that is followed.

        Raises:
            KinematicsError: if the path cannot be driven.
        """
        if extends:
            return (yield from self._extended(held, time, goal, path))
        followed = yield from self._begun(held, path)
        if held.pending is not None:
            return held.with_goal(goal, role=PlanRole.EARLIER).on(followed)
        return (yield from self.on_path(held, time, goal, followed, held.limits))

    def _begun(self, held: HeldMotion, path: PlatformPath) -> Interruptible[FollowedPath]:
        limits, shaper = held.limits.effective, held.limits.shaper
        return FollowedPath((yield from self.parts.begun(path, limits, shaper)))

    def on_path(
        self,
        held: HeldMotion,
        time: float,
        goal: Command | None,
        path: FollowedPath,
        limits: DriveLimits,
    ) -> Interruptible[HeldMotion]:
        """Return a plan for what comes next on the path, or on the way to it.

        Args:
            held: what is held.
            time: when the plan begins.
            goal: that the path is.
            path: how far it is.
            limits: for all of the plan.

        Raises:
            KinematicsError: if there is none.
        """
        if path.is_paused:
            return held.with_goal(goal, limits=limits, pending=None).on(path)
        state = held.plan.at(time)
        plan = replace(held, path=path).path_plan
        if time < held.plan.duration and plan is not None:
            next_plan = yield from self._going_on(plan, path.heights, time, limits)
            return self._leading(next_plan, goal, path, self._workspace, limits)
        if time < held.rests_at and not (plan is not None and plan.ends_path):
            # A motion to another place, or from a corner, begins where nothing moves any more.
            leaving = held.with_goal(goal, role=PlanRole.EARLIER).on(path)
            return (yield from self._braking(leaving, time))
        place = path.place if plan is None else plan.place(time)
        if plan is not None and plan.ends_path:
            # There is nothing left to plan.
            return replace(held, role=PlanRole.LEADS_TO_GOAL, limits=limits, pending=None)
        path = replace(path, place=place, from_rest=False)
        x, y, z, *_ = path.heights.driven.state(place)
        begin = (x, y, z)
        if math.dist(begin, self._machine.forward(state.heights)) > REACHED:
            region = self._planner.region(state)
            approach = yield from self._planner.line(state, begin, limits.effective, region)
            return self._leading(approach, goal, path, region, limits)
        scaled = yield from self._with_speeds(path.heights, place, limits)
        next_plan = yield from self.parts.from_rest(scaled, place, limits.effective)
        return self._leading(next_plan, goal, path, self._workspace, limits)

    @staticmethod
    def _leading(
        plan: Trajectory,
        goal: Command | None,
        path: FollowedPath,
        region: Workspace,
        limits: DriveLimits,
    ) -> HeldMotion:
        return HeldMotion(plan, goal, PlanRole.LEADS_TO_GOAL, region, limits, path=path)

    def _going_on(
        self, plan: PathPlan, heights: PathHeights, time: float, limits: DriveLimits
    ) -> Interruptible[PathPlan]:
        scaled = yield from self._with_speeds(heights, plan.place(time), limits)
        return (yield from self.parts.going_on(plan, scaled, time, limits.effective))

    def _with_speeds(
        self, heights: PathHeights, place: float, limits: DriveLimits
    ) -> Interruptible[PathHeights]:
        bounds = limits.of_path_speeds, limits.effective, limits.shaper, limits.cut, limits.rapid
        return (yield from self.parts.with_speeds(heights, place, *bounds))

    def braked(self, held: HeldMotion, plan: PathPlan, time: float) -> Interruptible[HeldMotion]:
        """Return ``held`` with a plan that comes to rest soon on the path of its ``plan``."""
        try:
            braking = yield from self.parts.brake(plan, time, held.limits.effective)
        except KinematicsError:
            return held.waiting_to_brake()
        if NEARLY * braking.duration >= plan.duration - time:
            return held.left_to_brake()
        return replace(held, plan=braking, role=PlanRole.BRAKES)

    def _extended(
        self, held: HeldMotion, time: float, goal: Command, path: PlatformPath
    ) -> Interruptible[HeldMotion]:
        """Return ``held`` with its path longer by a ``path``.

        Where the held plan ends before the end of the path, it stays, and the path as it drives it.
        """
        before, plan = held.path, held.path_plan
        assert before is not None
        if (before.heights.driven.shaped is None) is not (held.limits.shaper is None):
            # It has ended before the shaper was changed.
            followed = yield from self._begun(held, path)
            return (yield from self.on_path(held, time, goal, followed, held.limits))
        if plan is None or time >= plan.duration:
            place = held.place(time)
            # At the end of a path there is nothing left to pause on.
            is_paused = before.is_paused and not held.ends_path
            before = replace(before, is_paused=is_paused)
            longer = replace(before, place=place)
            longer = yield from self._longer(longer, path, place)
            if before.is_paused or held.pending is not None or time < held.plan.duration:
                return held.with_goal(goal).on(longer)
            return (yield from self.on_path(held, time, goal, longer, held.limits))
        if plan.ends_path and held.pending is None and not before.is_paused:
            # To pass the end without a stop, its rounding has to begin before.
            try:
                longer = yield from self._longer(before, path, plan.place(time))
                next_plan = yield from self._going_on(plan, longer.heights, time, held.limits)
                leading = held.with_goal(goal, role=PlanRole.LEADS_TO_GOAL)
                return replace(leading, plan=next_plan).on(longer)
            except KinematicsError:
                pass
        longer = yield from self._longer(before, path, plan.place(plan.duration))
        same_way = plan.moved_to(longer.heights.with_speeds_of(plan.heights), time)
        return held.with_goal(goal, plan=same_way).on(longer)

    def _longer(
        self, before: FollowedPath, path: PlatformPath, place: float
    ) -> Interruptible[FollowedPath]:
        heights = yield from self.parts.extended(before.heights, path, place)
        return replace(before, heights=heights)


class Replanned(NamedTuple):
    """What is held after an event.

    Attributes:
        held: the next value.
        refusal: why a goal that had to wait was given up; None if that did not happen.
    """

    held: HeldMotion
    refusal: KinematicsError | None = None


# Makes what is held next, from what is held and the time in it at which that begins [s].
Making = Callable[[HeldMotion, float], Interruptible[Replanned]]


class Replanning:
    """Makes the next value of what is held; times are counted from the start of its plan [s]."""

    def __init__(self, workspace: Workspace, kind: MotionKind) -> None:
        """Prepare for moves of a ``kind`` inside ``workspace``."""
        self._workspace = workspace
        self._kind = kind
        self._planner = MotionPlanner(workspace, kind)
        self._paths = PathReplanning(workspace, self._planner, self.braked)
        self._transfers = TransferBraking(workspace, self._braked_anywhere, self._slowed_on_way)

    def at_rest(self, heights: Vector3, limits: DriveLimits) -> HeldMotion:
        """Return rest at ``heights`` [m], with ``limits`` in force."""
        plan = CubicPlan(SliderState(heights, AT_REST, AT_REST), ((), (), ()))
        return HeldMotion(plan, None, PlanRole.LEADS_TO_GOAL, self._workspace, limits)

    def with_goal(self, held: HeldMotion, time: float, goal: Command) -> Interruptible[HeldMotion]:
        """Return a plan to ``goal``, or the held one with that goal if limits are pending.

        Raises:
            KinematicsError: if there is none.
        """
        if goal.path is not None:
            return (yield from self._paths.with_path(held, time, goal, goal.path, goal.extends))
        if held.pending is not None:
            return held.with_goal_for_later(goal)
        return (yield from self.planned(held, time, goal, held.limits, or_after=True))

    def braked(
        self, held: HeldMotion, time: float, *, stays: bool = True
    ) -> Interruptible[HeldMotion]:
        """Return ``held`` with a plan that comes to rest as soon as possible, if there is one.

        Args:
            held: what is held; of the path that is its goal nothing leads away.
            time: when the plan begins.
            stays: whether the platform stays on its line or path where that takes little longer.
        """
        if held.role is PlanRole.BRAKES or held.plan.duration - time <= 0.0:
            return held.left_to_brake()
        if held.path_plan is not None:
            return (yield from self._paths.braked(held, held.path_plan, time))
        if held.transfer_plan is not None:
            return (yield from self._transfers.braked(held, held.transfer_plan, time))
        return (yield from self._braked_anywhere(held, time, stays))

    def _braked_anywhere(
        self, held: HeldMotion, time: float, stays: bool
    ) -> Interruptible[HeldMotion]:
        """Return ``held`` with a plan that comes to rest as soon as possible, if there is one."""
        state = held.plan.at(time)
        for limits in gentler(held.limits.effective, state):
            braked = yield from self._braked_within(held, time, state, limits, stays=stays)
            if braked.role is PlanRole.BRAKES or not limits.added:
                break
            yield
        return braked

    def _slowed_on_way(self, held: HeldMotion, time: float) -> Interruptible[Trajectory | None]:
        """Return the plan that is ``held``, slowed down to rest, if that is proved."""
        own = own_stop(held.plan.at(time), held.limits.scaled).duration
        duration = max(SLOWED * own, SHORTEST_SLOWED)
        if duration < held.plan.duration - time:
            slowed = SlowedPlan(self._workspace.machine, held.plan, time, duration)
            use = yield from slowed.limit_use(held.limits.effective)
            if use.within(SLOWED_ROUNDING):
                return slowed
        return None

    def slowed(self, held: HeldMotion, time: float) -> Interruptible[HeldMotion]:
        """Return ``held`` with its plan slowed down to rest on its own way, if that is proved.

        A plan that gets faster may do so on while it is slowed down; where little is left beside
        the weight, bounded forces cannot brake that any more. There the sliders come to rest
        together, as gently as that is.

        Args:
            held: what is held, in motion.
            time: when that begins.
        """
        slowed = yield from self._slowed_on_way(held, time)
        if slowed is not None:
            return replace(held, plan=slowed, role=PlanRole.BRAKES)
        state, limits = held.plan.at(time), held.limits.effective
        if limits.added and held.transfer_plan is None:
            region, left = self._region(held, time), held.plan.duration - time
            try:
                gentle = yield from self._planner.stopping.gently(state, limits, region, left)
                return replace(held, plan=gentle, role=PlanRole.BRAKES)
            except KinematicsError:
                pass
        return held.waiting_to_brake()

    def _braked_within(
        self,
        held: HeldMotion,
        time: float,
        state: SliderState,
        limits: SliderLimits,
        *,
        stays: bool,
    ) -> Interruptible[HeldMotion]:
        """Return ``held`` with a plan that comes to rest soon within ``limits``, if there is one.

        Args:
            held: what is held, in motion and not on a path.
            time: when the plan begins.
            state: of the sliders then.
            limits: those in force, or less.
            stays: whether the platform stays on its line or path where that takes little longer.
        """
        plan, left = held.plan, held.plan.duration - time
        region = self._region(held, time)
        own = own_stop(state, limits)
        # The share left to a shaper makes stops longer, and is no reason to keep a still longer
        # plan.
        shortest = own
        if held.limits.planned is not None:
            shortest = own_stop(state, held.limits.scaled)
        # The braking of a step that is held keeps the direction, or nearly.
        is_tracked = stays and held.tracked_step is not None
        longer = LONGEST_TRACKED if is_tracked else NEARLY
        if left <= max(longer * shortest.duration, own.duration):
            return held.left_to_brake()
        stopping = self._planner.stopping
        along: Along | None = None
        if not stays or is_tracked:
            pass
        elif isinstance(plan, PathPlan):
            along = partial(self._paths.parts.brake_hard, plan, time, held.limits.effective)
        elif (
            self._kind is MotionKind.LINEAR
            or plan.straight_from < math.inf
            or held.transfer_plan is not None
        ):
            along = partial(stopping.along_line, state, limits, region)
        try:
            stop = yield from stopping.soonest(state, own, limits, region, left, along)
        except KinematicsError:
            return held.waiting_to_brake()
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
        if time < held.rests_at:
            if time >= held.plan.duration or limits.shaper is not held.limits.shaper:
                # The motion that the shaper still holds back was planned for the earlier limits;
                # and the shaper has to be empty when another one takes its place.
                return Replanned(held)
        if held.path is not None and held.path.is_paused:
            goal = None
        resting = time >= held.plan.duration
        if not resting and goal is not None:
            if stays_within(held.plan.at(time), limits.effective):
                try:
                    planned = self.planned(held, time, goal, limits, or_after=False)
                    return Replanned((yield from planned))
                except KinematicsError:
                    pass
        is_kept = resting or limits == held.limits
        if not is_kept:
            try:
                yield from checked(held.plan, limits.effective, time)
                is_kept = True
            except (SliderLimitError, AddedBoundError):
                pass
        if is_kept:
            held = replace(held, limits=limits, pending=None)
            if goal is not None and held.role is not PlanRole.LEADS_TO_GOAL:
                return (yield from self._resumed(held, time, goal))
        return Replanned(held)

    def _resumed(self, held: HeldMotion, time: float, goal: Command) -> Interruptible[Replanned]:
        """Go on to a goal that had to wait; if there is no way, give it up with the reason."""
        if held.path is not None:
            return (yield from self.continued(held, time))
        try:
            planned = self.planned(held, time, goal, held.limits, or_after=True)
            return Replanned((yield from planned))
        except KinematicsError as error:
            return Replanned(held.with_goal(None), error)

    def planned(
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
        if goal is held.goal and held.path is not None:
            return (yield from self._paths.on_path(held, time, goal, held.path, limits))
        state, moving = held.plan.at(time), time < held.plan.duration
        region = self._region(held, time)
        after = SequencePlan((held.plan,), time) if or_after and moving else None
        begin = Departure(state, limits, region, moving, after)
        plan = yield from goal.planned(self._planner, begin)
        is_quick = not moving and goal.destination is not None
        quick = plan if is_quick and isinstance(plan, LinePlan) else None
        return HeldMotion(plan, goal, PlanRole.LEADS_TO_GOAL, region, limits, quick=quick)

    def sooner(self, held: HeldMotion, time: float) -> Interruptible[Replanned]:
        """Make a plan that is sooner at the end of the line, if one is found."""
        plan, held = held.quick, replace(held, quick=None)
        assert plan is not None
        if time < plan.duration:
            try:
                sooner = yield from self._paths.parts.sooner(plan, time, held.limits.effective)
                return Replanned(replace(held, plan=sooner))
            except KinematicsError:
                # A break here would be given up where the plan takes too many pieces.
                pass
        return Replanned(held)

    def continued(self, held: HeldMotion, time: float) -> Interruptible[Replanned]:
        """Return the next part of the path that is followed; give it up if there is none."""
        path = held.path
        assert path is not None
        try:
            going_on = self._paths.on_path(held, time, held.goal, path, held.limits)
            return Replanned((yield from going_on))
        except KinematicsError as error:
            return self.without_next_part(held, time, error)

    def without_next_part(self, held: HeldMotion, time: float, error: KinematicsError) -> Replanned:
        """Return what is held where no next part of the path is found, because of an ``error``.

        In motion the platform comes to rest on the path first; at rest the path is given up.
        """
        if held.path is not None and time < held.plan.duration:
            return Replanned(held.on(replace(held.path, from_rest=True)))
        return Replanned(held.with_goal(None), error)

    def _region(self, held: HeldMotion, time: float) -> Workspace:
        """Return where the platform may be on a way that begins at a ``time``."""
        moving = time < held.plan.duration
        return self._planner.region(held.plan.at(time), held.region if moving else None)
