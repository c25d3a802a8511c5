"""Tracks a velocity or a moving target, by one certified step after the other.

Each step is held with the braking behind it, so at every instant there is a verified way to rest.
Where no step can be certified the held braking goes on, and the next step is tried in the next
cycle. Nothing is planned ahead, so a new velocity or position of the target costs no more than any
other cycle. With a shaper the steps are longer, and each is made while the one before goes on.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.commands import Command
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanRole
from tri_glide_kinematics.motion.engine.replacing import (
    RETRY_INTERVAL,
    SAME_TIME,
    LeadTime,
    PlanReplacing,
    Preparation,
)
from tri_glide_kinematics.motion.engine.replanning import Making, Replanned
from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.shaped import Planned
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.tracking import (
    FOLLOW_HORIZON,
    Follower,
    MovingTarget,
    TargetMotion,
    ToldVelocity,
    Wanted,
    WantedVelocity,
)
from tri_glide_kinematics.motion.trajectory import TrackedStep, Trajectory
from tri_glide_kinematics.vectors import Vector3, combined
from tri_glide_kinematics.workspace import Workspace

# A platform that is nearer to a target when it begins to follow it is there [m].
NEAR = 1e-3

# The first step of tracking, before any other was made, is taken to be this long [s].
FIRST_STEP = 0.002

# With a shaper or added bounds a step of tracking has to be proved, which takes longer than a
# cycle: so the steps are about so long [s], and no smaller part of the shaper, as each of them that
# it remembers costs.
SHAPED_STEP = 0.02
PART_OF_SHAPER = 0.3

# They turn more than plans do: so they leave more of the jerks to the shaper, with each attempt.
JERK_LEFT_TO_STEPS = 0.9


def step_period(shaper: Shaper | None) -> float:
    """Return how long steps of tracking are that have to be proved, with a ``shaper`` or none [s].

    A step has three phases. If they are as long as the first delay, or fit into it, the knots of
    the copies fall together. So there are few cells to prove.
    """
    if shaper is None:
        return SHAPED_STEP
    three = 3.0 * shaper.times[1]
    period = max(SHAPED_STEP, PART_OF_SHAPER * shaper.duration)
    return three * max(round(period / three), 1) / max(round(three / period), 1)


def _foreseen(dt: float, shaper: Shaper | None) -> float:
    """Return how far ahead of now is to be foreseen what a ``shaper`` makes in ``dt`` seconds."""
    return dt if shaper is None else dt + shaper.delay


class Tracker:
    """Makes the next step towards a jog or a target; keeps how the target has moved."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for the machine of ``workspace``."""
        self.follower = Follower(workspace, FOLLOW_HORIZON)
        self._workspace = workspace
        self._machine = workspace.machine
        self._target: TargetMotion | None = None
        self._velocity: ToldVelocity | None = None
        self._time = 0.0

    def report(self, target: MovingTarget, age: float, start: Vector3 | None) -> bool:
        """Take in how the ``target`` moves; return whether that was not foreseen.

        Args:
            target: as it is told.
            age: how long before now it was so [s].
            start: heights of the sliders, if no other one was tracked before [m].
        """
        if start is None:
            assert self._target is not None
            return self._target.report(target, self._time - age, age)
        # A target that is elsewhere at the start is caught up with as soon as possible.
        missing = math.dist(target.after(age).position, self._machine.forward(start))
        self._time = 0.0
        self._target = TargetMotion(
            target._replace(lead=missing if missing < NEAR else math.inf), -age
        )
        return True

    def report_velocity(self, velocity: Vector3, *, goes_on: bool) -> bool:
        """Take in which ``velocity`` is wanted now [m/s]; others before count if it ``goes_on``.

        Return whether that was not foreseen.
        """
        if goes_on and self._velocity is not None:
            return self._velocity.report(velocity, self._time)
        self._velocity = ToldVelocity(velocity, self._time)
        return True

    def repeat_velocity(self) -> None:
        """Take in that the velocity that is wanted is still the same."""
        if self._velocity is not None:
            self._velocity.repeat(self._time)

    def next(self, held: HeldMotion, time: float, dt: float) -> HeldMotion | None:
        """Return what is held for a step of ``dt`` [s], from ``time`` [s] in the held plan on.

        Limits that are pending are in force with it. None if no such step is certified.
        """
        limits, wanted = self._wanted(held, dt)
        step = self.follower.step(held.plan.at(time), wanted, limits.effective, dt)
        return self._with_step(held, step, limits)

    def prepared(
        self, held: HeldMotion, time: float, dt: float, ahead: float
    ) -> Interruptible[HeldMotion | None]:
        """Return what is held for a step, as ``next`` does, that begins ``ahead`` of now [s]."""
        limits, wanted = self._wanted(held, ahead + dt)
        step = yield from self.follower.step_in_pieces(
            held.plan.at(time), wanted, limits.effective, dt
        )
        return self._with_step(held, step, limits)

    def _wanted(self, held: HeldMotion, dt: float) -> tuple[DriveLimits, Wanted]:
        limits = held.pending or held.limits
        assert held.goal is not None
        return limits, held.goal.wanted(self, limits, dt)

    def target_after(self, dt: float, shaper: Shaper | None = None) -> MovingTarget:
        r"""Return where the target will be in ``dt`` seconds, and how it will move.

        What a ``shaper`` makes of a motion $p$ with a steady acceleration $a$ is
        $p(t - d) + \tfrac12 a s^2$, where $d$ and $s^2$ are mean and variance of the times of its
        impulses. So the target is led by $d$, and placed $\tfrac12 a s^2$ before; with a jerk its
        velocity changes likewise.
        """
        assert self._target is not None
        foreseen = _foreseen(dt, shaper)
        target = self._target.at(self._time + foreseen, foreseen)
        if shaper is None:
            return target
        half = -0.5 * shaper.variance
        return target._replace(
            position=combined(1.0, target.position, half, target.acceleration),
            velocity=combined(1.0, target.velocity, half, target.jerk),
        )

    def velocity_after(
        self, dt: float, told: Vector3, shaper: Shaper | None = None
    ) -> WantedVelocity:
        """Return which velocity will be wanted in ``dt`` seconds if it changes as it did.

        With a ``shaper`` it is led by its delay. Without a horizon it is the one that was ``told``
        last [m/s].
        """
        if self._velocity is None or not self.follower.horizon > 0.0:
            return WantedVelocity(told)
        foreseen = _foreseen(dt, shaper)
        return self._velocity.at(self._time + foreseen, foreseen)

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass."""
        self._time += dt

    def distance(self, heights: Vector3) -> float:
        """Return how far the platform at slider ``heights`` [m] is from the target now [m]."""
        if self._target is None:
            return math.nan
        return math.dist(self._target.at(self._time).position, self._machine.forward(heights))

    def _with_step(
        self, held: HeldMotion, step: TrackedStep | None, limits: DriveLimits
    ) -> HeldMotion | None:
        if step is not None:
            return replace(
                held, plan=step, role=PlanRole.LEADS_TO_GOAL, limits=limits, pending=None
            )
        if self._target is not None:
            try:
                self._workspace.check_position(self._target.at(self._time).position)
            except KinematicsError:
                # When it comes back, it is caught up with as soon as possible.
                self._target.lose()
        return None


class Tracking:
    """Holds one step of tracking after the other.

    As a rule each is made when it is its turn; with a shaper or added bounds it is longer, and
    prepared and proved like any other plan.

    Attributes:
        tracker: makes the steps.
    """

    def __init__(self, plans: PlanReplacing, workspace: Workspace) -> None:
        """Track what is asked for.

        Args:
            plans: lets the next plan take the place of the held one.
            workspace: where the platform may be, and of which machine.
        """
        self._plans = plans
        self._holder = plans.holder
        self._replanning = plans.replanning
        self._workspace = workspace
        self.tracker = Tracker(workspace)
        self._lead_time = LeadTime()
        # Where the held plan is no step: that plan, and when the next step may begin in it.
        self._begins: tuple[Trajectory, float] | None = None
        # The plan in which the next step was hurried last.
        self._hurried: Trajectory | None = None
        plans.when_taken = self._after_taking

    @property
    def prepares_steps(self) -> bool:
        """Whether steps of tracking are prepared, as their proof takes longer than a cycle."""
        # Steps are proved for limits that wait to be kept, too.
        return self._plans.shaped_plans.is_shaped or bool(self._holder.newest_limits.sliders.added)

    @property
    def _next_step_at(self) -> float:
        """When the next step may begin in the held plan [s]."""
        held = self._holder.held
        if self._begins is not None and self._begins[0] is held.plan:
            return self._begins[1]
        step = held.tracked_step
        return 0.0 if step is None else step.period

    def go_over_to(self, goal: Command) -> bool:
        """Track a ``goal`` in motion, if a step towards it is certified; return whether it is.

        With a shaper or added bounds the step is prepared. Outside the workspace nothing is
        tracked.
        """
        held = self._holder.held
        if held.region is not self._workspace:
            return False
        tracking = held.with_goal(goal)
        goes_on = self._tracks_like(goal)
        assert goal.velocity is not None
        is_new = self.tracker.report_velocity(goal.velocity, goes_on=goes_on)
        if self.prepares_steps:
            if goes_on:
                # A step that is being prepared is held soon; the next one leads to this.
                self._plans.keep_goal()
                self._plans.replace(tracking)
                if is_new:
                    self._hurry()
                return True
            if held.pending is not None or self._holder.time >= held.plan.duration:
                return False
            self._prepare_step(goal)
            return True
        if not goes_on:
            step = self.tracker.next(
                tracking, self._holder.time, self._plans.last_step or FIRST_STEP
            )
            if step is None:
                return False
            tracking = step
        self._begin(tracking)
        return True

    def follow_target(self, goal: Command, target: MovingTarget, age: float) -> None:
        """Track a ``target``, seen ``age`` seconds ago, as soon as a step is certified.

        Until then the platform brakes.
        """
        held, time = self._holder.held, self._holder.time
        self._plans.keep_goal()
        if self._tracks_like(goal):
            is_new = self.tracker.report(target, age, None)
            self._plans.replace(held.with_goal(goal))
            if is_new:
                self._hurry()
            return
        start = held.plan.at(time).heights
        self._workspace.check_heights(start)
        self._workspace.check_position(target.position)
        self.tracker.report(target, age, start)
        tracking = held.with_goal(goal, region=self._workspace)
        if time < held.plan.duration and not held.brakes:
            self._begin(tracking.waiting_to_brake())
            self._plans.prepare_braking(urgent=False)
        else:
            self._begin(tracking)

    def _tracks_like(self, goal: Command) -> bool:
        """Return whether something is tracked that is of the kind of a ``goal``."""
        held = self._holder.held
        return self._plans.tracks and held.goal is not None and held.goal.kind is goal.kind

    def _begin(self, held: HeldMotion) -> None:
        """Hold what begins to track, or is to do so when a step is certified."""
        self._plans.tracks = True
        self._plans.preparation = None
        self._plans.replace(held)

    def take_step(self, dt: float) -> bool:
        """Track for ``dt`` [s] if such a step is certified; return whether it is."""
        held = self._holder.held
        tracking = self.tracker.next(held, self._holder.time, dt)
        if tracking is not None:
            self._plans.preparation = None
            self._plans.replace(tracking)
        elif self._holder.time >= held.plan.duration and held.pending is not None:
            self._plans.replace(replace(held, limits=held.pending, pending=None))
        if held.goal is not None:
            self._after_step(held.goal, is_certified=tracking is not None)
        return tracking is not None

    def prepare_next_step(self) -> None:
        """Make the next step of tracking if it is time to; it begins where the present one ends."""
        holder, last = self._holder, self._plans.last_step
        lead = self._plans.lead(self._lead_time)
        # Exactly there, so that the motion is the same whatever the steps are; and as late as
        # possible, as the newest report of the target says most.
        if holder.time + last + lead > self._next_step_at + SAME_TIME:
            start = max(holder.time + lead, self._next_step_at)
            making = self._step_or(self._going_on, None)
            self._plans.begin(making, None, start, self._lead_time)

    def _hurry(self) -> None:
        """Make the next step at once, and not for the end of the held one: that leads elsewhere.

        Once in each plan: a step that is given up again and again would never be held.
        """
        plan, preparation = self._holder.held.plan, self._plans.preparation
        if not self.prepares_steps or plan is self._hurried:
            return
        self._hurried = plan
        self._begins = plan, self._holder.time
        if preparation is not None and preparation.lead_time is self._lead_time:
            self._plans.preparation = None

    def _prepare_step(self, goal: Command) -> None:
        """Make the first step towards a ``goal``, or a plan where none is proved."""
        lead_time = self._plans.lead_time
        start = self._holder.time + self._plans.lead(lead_time)
        self._plans.begin(self._step_or(self._plans.making(goal), goal), goal, start, lead_time)

    def _step_or(self, other: Making, goal: Command | None) -> Making:
        """Return what makes a proved step towards a ``goal``, or ``other`` where there is none.

        Without a goal it is the newest one of tracking.
        """
        proved = self._plans.shaped_plans.made

        def made(held: HeldMotion, start: float) -> Interruptible[Replanned]:
            try:
                return (yield from proved(partial(self._step, goal), goal, held, start))
            except KinematicsError:
                return (yield from proved(other, goal, held, start))

        return made

    def _step(
        self, goal: Command | None, held: HeldMotion, start: float
    ) -> Interruptible[Replanned]:
        """Make a step of tracking that begins at ``start`` [s], with the braking behind it.

        Raises:
            PlanningError: if there is none.
        """
        ahead = max(start - self._holder.time, 0.0)
        limits = held.pending or held.limits
        if limits.shaper is not held.limits.shaper and start < held.rests_at:
            raise PlanningError("a shaper has to be empty when another one takes its place")
        limits = limits.leaving(Planned(limits.effective.times(1.0, 1.0, JERK_LEFT_TO_STEPS)))
        held = held.with_goal(goal or self._holder.held.goal, limits=limits, pending=None)
        period = step_period(limits.shaper)
        step = yield from self.tracker.prepared(held, start, period, ahead)
        if step is None:
            raise PlanningError("there is no certified step")
        yield
        return Replanned(step)

    def _going_on(self, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Make what is held where there is no step of tracking: the braking, as a rule."""
        if held.role is PlanRole.EARLIER:
            held = yield from self._replanning.braked(held, start, stays=False)
        elif held.pending is not None and start >= held.rests_at:
            held = replace(held, limits=held.pending, pending=None)
        return Replanned(held)

    def _after_step(self, goal: Command, *, is_certified: bool) -> None:
        """Where a ``goal`` has an end, end its tracking at rest, or where there is no step.

        Where there is none once, near an edge, there are some and none in turn, and the platform
        would swerve. So the goal is planned there, as from rest.
        """
        if not goal.has_end:
            return
        held, time = self._holder.held, self._holder.time
        if is_certified:
            step = held.tracked_step
            self._plans.tracks = step is None or not step.ends_at_rest
        else:
            self._plans.tracks = False
            self._plans.replace(held.left_to_brake())
            if held.pending is None and time < held.plan.duration:
                self._plans.prepare(self._plans.making(goal))
        self._plans.look_ahead()

    def _after_taking(self, preparation: Preparation, is_step: bool) -> None:
        """Note when the next step may begin, or end the tracking."""
        held, time = self._holder.held, self._holder.time
        if not self.prepares_steps or held.goal is None:
            return
        if not is_step:
            # Not in this engine step any more, however long that is.
            last = self._plans.last_step
            begun = max(time, preparation.start)
            begins = begun + RETRY_INTERVAL + last + self._lead_time.after(last)
            self._begins = held.plan, begins
        self._after_step(held.goal, is_certified=is_step)
