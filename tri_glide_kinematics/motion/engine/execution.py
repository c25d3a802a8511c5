"""Carries out the held plan step by step, while the next one is prepared.

What could not be done at once is tried again: a braking that would break a limit just now, and
limits that the motion cannot keep yet.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.engine.command import Command, MotionPhase
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanRole
from tri_glide_kinematics.motion.engine.preparation import (
    SAME_TIME,
    LeadTime,
    Making,
    Preparation,
    only_held,
)
from tri_glide_kinematics.motion.engine.progress import PathMeasuring, PathProgress, progress
from tri_glide_kinematics.motion.engine.replanning import Replanned, Replanning, longest_stop
from tri_glide_kinematics.motion.engine.shaped_motion import ShapedMotion
from tri_glide_kinematics.motion.engine.tracker import Tracker
from tri_glide_kinematics.motion.errors import SOUND, NotStartedError, PlanningError
from tri_glide_kinematics.motion.limits import SampledPlan, SliderState
from tri_glide_kinematics.motion.moves import MotionKind, inside
from tri_glide_kinematics.motion.path import DrivenPath
from tri_glide_kinematics.motion.shaped import DrivenPart, Planned, ShapedTrajectory, SlowedPlan
from tri_glide_kinematics.motion.shaping import Shaper, Shaping
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import LinePlan
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Workspace

# What could not be done at once is tried again after this time of motion [s].
RETRY_INTERVAL = 0.008

# A stop may take so many pieces within its call. Nearly all take fewer.
URGENT_PIECES = 7

# A stop of what is shaped, if it is not ready within its call, begins after this time; where none
# is proved by then, the machine brakes without the shaper [s].
SHAPED_STOP = 0.024

# The first step of tracking, before any other was made, is taken to be this long [s].
FIRST_STEP = 0.002

# With a shaper or added bounds a step of tracking has to be proved, which takes longer than a
# cycle: so the steps are about so long [s], and no smaller part of the shaper, as each of them that
# it remembers costs.
SHAPED_STEP = 0.02
PART_OF_SHAPER = 0.3

# They turn more than plans do: so they leave more of the jerks to the shaper, with each attempt.
JERK_LEFT_TO_STEPS = 0.9

# So often the next plan is made, with limits that leave what shaping takes. Each attempt takes time
# in which the held plan goes on.
ATTEMPTS_IN_MOTION = 5


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


class PlanHolder:
    """Holds one plan after the other, with the time that has passed in it.

    Attributes:
        motion: what is held; None before the start.
        shaped: what the shaper makes of it; None without a shaper.
        time: that has passed in its plan [s].
        plan_number: counts the plans held so far: a new number is a new plan.
        first_limits: for the start.
    """

    def __init__(self, machine: TriGlide, limits: DriveLimits) -> None:
        """Hold nothing yet of a ``machine``; ``limits`` are for the start."""
        self._machine = machine
        self.motion: HeldMotion | None = None
        self.shaped: ShapedMotion | None = None
        self.time = 0.0
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


class PlanExecution:
    """Steps a held plan, and prepares at most one that takes its place.

    While something is tracked, each step is a plan of its own. As a rule it is made when it is its
    turn; with a shaper or added bounds it is longer, and prepared and proved like any other plan.

    Attributes:
        holder: of the plan.
        workspace: where the platform may be, and of which machine.
        tracks: whether something is tracked, so that a new velocity or target needs no plan.
        next_shaping: the newest one that was asked for; it is in force from rest on.
        preparation: of the next plan; None if there is none.
        replanning: makes what is held next.
        tracker: makes steps of tracking.
    """

    def __init__(
        self, holder: PlanHolder, workspace: Workspace, kind: MotionKind, in_pieces: bool
    ) -> None:
        """Prepare for what ``holder`` holds.

        Args:
            holder: of the plan.
            workspace: where the platform may be, and of which machine.
            kind: of moves.
            in_pieces: whether plans are made by ``work``, and not when they are asked for.
        """
        self.holder = holder
        self.tracks = False
        self.next_shaping: Shaping | None = None
        self._shaping: Shaping | None = None
        self.preparation: Preparation | None = None
        self._in_pieces = in_pieces
        self.workspace = workspace
        self.replanning = Replanning(workspace, kind)
        self.tracker = Tracker(workspace)
        self._lead_time = LeadTime()
        # The next part of a path takes longer, but is known to be needed long before.
        self._path_lead_time = LeadTime()
        # All of a path is looked at before it is followed, or goes on.
        self._goal_lead_time = LeadTime()
        # Steps of tracking with a shaper, and when the next one may begin in the held plan.
        self._step_lead_time = LeadTime()
        self._next_step_at = 0.0
        self._last_step = 0.0
        self._retry_at = math.inf
        self._event_at = math.inf
        self._refusal: KinematicsError | None = None
        self._path_measuring = PathMeasuring()

    @property
    def goal_in_preparation(self) -> Command | None:
        """The goal of the plan that is being prepared; None if there is none."""
        return self.preparation.goal if self.preparation is not None else None

    @property
    def remaining(self) -> float:
        """Time to the end of what was asked for; inf where it is not known [s]."""
        held = self.holder.motion
        if held is None:
            return 0.0
        if self.goal_in_preparation is not None:
            return math.inf
        return held.remaining(self.holder.time)

    def step(self, dt: float) -> SliderState:
        """Advance by ``dt`` [s] and return the setpoint.

        Raises:
            NotStartedError: before the start.
            OutOfBoundsError: if ``dt`` is not greater than zero, or NaN.
        """
        holder = self.holder
        held = holder.motion
        time = holder.time + dt
        # Nearly always there is nothing to do but go on. NaN is not greater than zero, either.
        if held is None or not dt > 0.0 or time >= self._event_at:
            if not 0.0 < dt < math.inf:
                raise OutOfBoundsError("dt", dt, "finite and greater than 0", "s")
            if held is None:
                raise NotStartedError
            self._on_event(dt)
            held = holder.held
            if self.tracks:
                self.tracker.advance(dt)
            # A plan that has just begun may do so a rounding error later.
            time = max(holder.time + dt, 0.0)
        if holder.shaped is None:
            setpoint = held.plan.at(time)
        else:
            setpoint = holder.shaped.at(dt)
            holder.shaped.time += dt
        holder.time = time
        return setpoint

    def work(self, may_go_on: Callable[[], bool]) -> None:
        """Go on with what is being prepared, by one piece at least; else with what can wait.

        Args:
            may_go_on: asked after each piece, which takes some tenths of a millisecond.
        """
        preparation = self.preparation
        if preparation is None or preparation.ready is not None:
            self._path_measuring.work(self.holder.driven_path, may_go_on)
            return
        try:
            self._work(may_go_on)
        except KinematicsError as error:
            self._refusal = error

    def take_refusal(self) -> KinematicsError | None:
        """Return, once, why something that had to wait could not be done after all."""
        refusal, self._refusal = self._refusal, None
        return refusal

    def keep_to_plan(self) -> None:
        """Forget all but the held plan, and drive that to its end.

        Nothing is planned for this: so it can be done, whatever has failed.
        """
        self.preparation = None
        self.tracks = False
        self._retry_at = self._event_at = math.inf
        if self.holder.motion is not None:
            self.holder.motion = self.holder.motion.with_goal(
                None, role=PlanRole.BRAKES, pending=None
            )

    def keep_goal(self) -> None:
        """Give up a new goal that is still being prepared; what is held goes on."""
        if self.goal_in_preparation is not None:
            self.preparation = None
            self.look_ahead()

    def stop(self) -> None:
        """Come to rest as soon as the limits allow, and forget the goal."""
        held = self.holder.held
        self.keep_goal()
        if held.goal is None:
            return
        self.tracks = False
        self.preparation = None
        self.replace(held.with_goal(None).waiting_to_brake())
        stays = held.goal.has_line
        self.prepare_braking(urgent=True, stays=stays)
        if self.holder.shaped is None or self._stops_in_time:
            self._slow_down_a_stop()
        else:
            # To prove it takes many pieces: it begins a little later.
            held, time = self.holder.held, self.holder.time
            start = time + SHAPED_STOP if self._in_pieces else time
            making = partial(self._braked_in_time, stays)
            self._begin(Preparation(making, None, held, time, start, LeadTime()), 1)

    def _braked_in_time(
        self, stays: bool, held: HeldMotion, start: float
    ) -> Interruptible[Replanned]:
        """Make a braking of what is shaped; where none is in time, one without the shaper."""
        longest = longest_stop(self.holder.state, held.limits.scaled) - (start - self.holder.time)
        try:
            made = yield from self._shaped(partial(self._braked, stays), None, held, start)
            plan = made.held.plan
            if made.held.brakes and plan.duration - (plan is held.plan) * start <= longest:
                return made
        except KinematicsError:
            yield
        return (yield from self._unshaped(held, start))

    def _slow_down_a_stop(self) -> None:
        """Brake, at once, where a stop has no braking yet that obeys its law."""
        held = self.holder.held
        if held.goal is not None or isinstance(held.plan, SlowedPlan) or self._stops_in_time:
            return
        making = self._slowed if self.holder.shaped is None else self._unshaped
        try:
            with SOUND:
                slowed = at_once(making(held, self.holder.time)).held
        except KinematicsError:
            return
        if slowed.plan is not held.plan:
            self.preparation = None
            self.replace(slowed)
            if not slowed.brakes:
                self.try_again()

    @property
    def _stops_in_time(self) -> bool:
        """Whether what is held is a braking that takes no longer than a stop may."""
        holder = self.holder
        held = holder.held
        if holder.shaped is None or held.role is PlanRole.EARLIER:
            return held.role is not PlanRole.EARLIER
        # A plan is ahead of what is driven: where that gets faster its braking takes longer.
        left = holder.time_to_rest - held.limits.held_back
        return left <= longest_stop(holder.state, held.limits.scaled)

    def _slowed(self, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Slow down what is ``held`` on its own way, while it waits for a better braking."""
        slowed = yield from self.replanning.slowed(held, start)
        return Replanned(slowed.waiting_to_brake())

    def _unshaped(self, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Brake from what is driven at ``start`` [s], which is shaped no more until it rests.

        To prove that takes little: it depends on nothing but the setpoint then.
        """
        shaped = self.holder.shaped
        assert shaped is not None
        lead = max(start - self.holder.time, 0.0)
        later = held.pending or replace(held.limits, planned=None)
        limits = replace(held.limits, shaper=None, planned=None)
        plan = shaped.going_on(held.plan, 0.0)
        driven = replace(held.waiting_to_brake(), plan=plan, limits=limits, pending=later)
        braked = yield from self.replanning.braked(driven, lead, stays=False)
        if braked.plan is plan:
            braked = yield from self.replanning.slowed(driven, lead)
        return Replanned(braked if braked.plan is not plan else held)

    def change_limits(self, limits: DriveLimits) -> None:
        """Put limits in force now, or slow down until that is possible; the shaper stays."""
        held = self.holder.motion
        limits = replace(limits, shaper=self.holder.newest_limits.shaper)
        if held is None:
            self.holder.first_limits = limits
        elif limits != self.holder.newest_limits:
            goal = self.goal_in_preparation
            if goal is not None and goal.is_checked_whole:
                # The whole path is looked at first; then it waits for the limits, too.
                self.replace(replace(held, pending=limits))
                return
            if goal is not None:
                # It is planned when the limits are in force.
                self.tracks = False
                held = held.with_goal(goal).waiting_to_brake()
            self.replace(replace(held, pending=limits))
            # The next step of tracking keeps them, if it can.
            if not self.tracks:
                self.try_again()

    def carry_out(self, command: Command) -> None:
        """Do what a ``command`` asks for.

        Raises:
            NotStartedError: before the start.
            KinematicsError: if it is refused.
        """
        self._shape_from_rest()
        command.begin(self)

    @property
    def goal(self) -> Command | None:
        """What was commanded last; None for a stop."""
        return self.holder.held.goal

    @property
    def is_idle(self) -> bool:
        """Whether the platform rests, and nothing is left to do."""
        return self.holder.held.phase(self.holder.time) is MotionPhase.IDLE

    @property
    def follows_path(self) -> bool:
        """Whether a path is the goal."""
        return self.holder.held.path is not None

    @property
    def is_shaped(self) -> bool:
        """Whether there is a shaper, in force or from the next rest on."""
        return self.holder.newest_limits.shaper is not None

    @property
    def prepares_steps(self) -> bool:
        """Whether steps of tracking are prepared, as their proof takes longer than a cycle."""
        return self.is_shaped or bool(self.holder.limits.sliders.added)

    @property
    def shaper_pending(self) -> bool:
        """Whether another shaper waits for rest."""
        holder = self.holder
        return (
            self.next_shaping != self._shaping
            or holder.newest_limits.shaper is not holder.limits.shaper
        )

    def set_shaper(self, shaping: Shaping | None) -> None:
        """Change the shaper as soon as nothing moves."""
        self.next_shaping = shaping
        self._shape_from_rest()

    def _shape_from_rest(self) -> None:
        """Put the newest shaper in force if nothing moves, nor is about to."""
        held, shaping = self.holder.motion, self.next_shaping
        if shaping == self._shaping or self.preparation is not None:
            return
        if held is not None and held.phase(self.holder.time) is not MotionPhase.IDLE:
            return
        self._shaping = shaping
        # Where the next motion leads is not known yet.
        shaper = None if shaping is None else shaping.covering(None)
        limits = replace(self.holder.limits, shaper=shaper, planned=None)
        if held is None:
            self.holder.first_limits = limits
        else:
            self.replace(replace(held, limits=limits))

    def prepare_goal(self, goal: Command) -> None:
        """Make a plan that leads to a ``goal``, or let that wait for limits."""
        held = self.holder.held
        if held.pending is not None and not goal.is_checked_whole:
            # It has its turn when the limits are in force; what is prepared for them knows it then.
            self.tracks = False
            self.replace(held.with_goal(goal))
            if self.preparation is not None:
                self.try_again()
        else:
            self.prepare(self.making(goal), goal)

    def try_again(self) -> None:
        """Put pending limits in force, or brake. On a path its next part is planned for that."""
        on_path = self.holder.held.path_plan is not None
        lead_time = self._path_lead_time if on_path else None
        self.prepare(self.replanning.tried_again, lead_time=lead_time)

    def prepare(
        self,
        making: Making,
        goal: Command | None = None,
        *,
        urgent: bool = False,
        lead_time: LeadTime | None = None,
    ) -> None:
        """Make what is held next, unless that is for later; at rest, a first piece of it.

        What is ``urgent`` begins now. If it is not ready after some pieces, it begins later, too.
        """
        is_long = goal is not None and goal.is_checked_whole
        lead_time = lead_time or (self._goal_lead_time if is_long else self._lead_time)
        pieces = URGENT_PIECES if urgent else 0
        making = self._proved(making, goal)
        lead = 0.0 if urgent or not self._in_pieces else lead_time.after(self._last_step)
        start = self.holder.time + lead
        self._begin(
            Preparation(making, goal, self.holder.held, self.holder.time, start, lead_time), pieces
        )

    def _proved(self, making: Making, goal: Command | None = None) -> Making:
        """Return a ``making`` whose plans keep the limits when they are shaped, if they are.

        Args:
            making: makes the plans.
            goal: that they lead to; None for a stop, or for what goes on.
        """
        return partial(self._shaped, making, goal) if self.is_shaped else making

    def _shaped(
        self, making: Making, goal: Command | None, held: HeldMotion, start: float
    ) -> Interruptible[Replanned]:
        """Make what is held next so that it keeps the limits when it is shaped.

        Raises:
            SliderLimitError: if it does not, though it was planned for less.
            KinematicsError: if there is no plan.
        """
        present = held.plan.at(start) if start < held.plan.duration else None
        # On a line the sliders keep what its plan keeps, as a rule: so a stop on it uses all of it.
        # A move from rest has the time to be made again for less.
        stops_on_line = isinstance(held.plan, LinePlan) and held.goal is None
        from_rest = start >= held.rests_at and not held.pending
        has_time = from_rest and goal is not None and goal.is_planned_again
        first = Planned(held.limits.scaled) if stops_on_line or has_time else None
        pending = held.pending and held.pending.leaving(None, present)
        less = replace(held, limits=held.limits.leaving(first, present), pending=pending)
        for _ in range(ATTEMPTS_IN_MOTION):
            made = yield from self._covered(making, less, start)
            after = made.held
            if after == less:
                return made._replace(held=held)
            same = after.plan is held.plan and after.limits == held.limits
            rests = after.plan is held.plan and start >= held.rests_at
            if same or rests or after.limits.shaper is None:
                break
            yield
            # What begins at rest begins when it is ready, however late that is.
            lead = max(start - self.holder.time, 0.0)
            motion = self._driven_with(after, lead)
            use = yield from motion.limit_use(after.limits.scaled, lead, after.region)
            if use.keeps_limits:
                yield from inside(motion, after.region, after.limits.scaled)
                break
            planned = use.leaving(Planned(after.limits.effective, after.limits.cut))
            is_least = after.limits.leaving(planned, present).planned == after.limits.planned
            if after.plan is held.plan or (is_least and after.tracked_step is None):
                # No other plan is made for less; only steps leave more with each attempt.
                use.check(after.limits.scaled)
            pending = held.pending and held.pending.leaving(planned, present)
            limits = held.limits.leaving(planned, present)
            less = replace(held, limits=limits, pending=pending)
        else:
            use.check(after.limits.scaled)
        return made

    def _covered(self, making: Making, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Make what is held next, with a shaper for the places that it passes.

        Only at rest another shaper takes the place of the present one. So in mid-motion, where that
        does not do, the platform comes to rest first, and goes on then.

        Raises:
            KinematicsError: if there is no plan.
        """
        made = yield from making(held, start)
        after, shaping = made.held, self._shaping
        leads = after.role is PlanRole.LEADS_TO_GOAL and after.plan is not held.plan
        if shaping is None or after.goal is None or not leads:
            return made
        rests, before = start >= held.rests_at, after.limits.shaper
        if not rests and after.path is not None and held.path is not None:
            if after.path.heights is held.path.heights and held.role is PlanRole.LEADS_TO_GOAL:
                # The whole path was looked at when it began.
                return made
        if after.goal.leads_anywhere:
            shaper = shaping.covering(None, None if rests else before)
        else:
            yield
            places = after.places(self.workspace.machine)
            shaper = shaping.covering(places, None if rests else before)
            yield
        if shaper == before:
            return made
        limits = replace(after.limits, shaper=shaper)
        if rests and after.path is None:
            return made._replace(held=replace(after, limits=limits))
        if rests and after.path is not None:
            # How fast a path is driven depends on the shaper.
            held = held.with_goal(after.goal, limits=limits, pending=None).on(after.path)
            planned = self.replanning.planned(held, start, after.goal, limits, or_after=True)
            return made._replace(held=(yield from planned))
        waiting = replace(after, pending=limits, role=PlanRole.EARLIER)
        if start < held.plan.duration:
            return (yield from self.replanning.tried_again(waiting, 0.0))
        # The next plan would begin before the shaper is empty.
        heights = held.plan.at(start).heights
        resting = replace(waiting, plan=self.replanning.at_rest(heights, limits).plan)
        if after.path is not None:
            resting = resting.on(replace(after.path, place=after.place(0.0)))
        return Replanned(resting.left_to_brake())

    def _driven_with(self, held: HeldMotion, lead: float) -> ShapedTrajectory:
        """Return what is driven if something else is held in ``lead`` seconds."""
        shaped, shaper = self.holder.shaped, held.limits.shaper
        if shaped is not None and shaped.shaper is shaper:
            return shaped.going_on(held.plan, lead)
        assert shaper is not None
        return ShapedTrajectory(self.workspace.machine, shaper, (DrivenPart(lead, held.plan, 0.0),))

    def _prepare_next_part(self) -> None:
        """Make the next part of the path that is followed."""
        held = self.holder.held
        lead = self._path_lead_time.after(self._last_step) if self._in_pieces else 0.0
        # Exactly there, so that the motion is the same whatever the steps are.
        start = max(self.holder.time + lead, held.goes_on_at)
        preparation = Preparation(
            self._next_part, None, held, self.holder.time, start, self._path_lead_time
        )
        self._begin(preparation)

    def _next_part(self, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Make the next part of the path; one that is not proved is treated as one not found."""
        try:
            return (yield from self._proved(self.replanning.continued)(held, start))
        except KinematicsError as error:
            return self.replanning.without_next_part(held, start, error)

    def _begin(self, preparation: Preparation, pieces: int = 0) -> None:
        """Begin with a ``preparation``, and with so many ``pieces`` of it at once."""
        self.preparation = preparation
        self.look_ahead()
        if not self._in_pieces:
            self._work(lambda: True)
        elif pieces or preparation.begins_at_rest:
            left = iter(range(pieces - 1))
            self._work(lambda: next(left, None) is not None)

    def _work(self, may_go_on: Callable[[], bool]) -> None:
        preparation = self.preparation
        if preparation is None or preparation.ready is not None:
            return
        try:
            preparation.work(may_go_on)
        except BaseException as error:
            self.preparation = None
            self._wait(self.holder.held)
            # A goal that was taken before comes to rest where it cannot go on.
            if isinstance(error, KinematicsError) and preparation.goal is None:
                return
            raise
        if preparation.ready is not None:
            preparation.note_time(self.holder.time)
            if preparation.has_begun(self.holder.time):
                self._take(preparation)

    def _take(self, preparation: Preparation) -> None:
        """Hold what is ready, as it begins now or in the next step."""
        assert preparation.ready is not None
        self.preparation = None
        held, refusal = preparation.ready
        is_step = held.tracked_step is not None and held.plan is not self.holder.held.plan
        if preparation.goal is not None:
            self.tracks = is_step
        elif self.tracks:
            # The target, or the velocity, may be a newer one.
            held = held.with_goal(self.holder.held.goal)
        # Limits that have come meanwhile, while something is tracked, go on waiting.
        newest = self.holder.held.pending
        if newest is not preparation.held.pending:
            held = replace(held, pending=newest)
        self.replace(held, refusal, preparation.elapsed(self.holder.time))
        if self.tracks and self.prepares_steps and held.goal is not None:
            if not is_step:
                # Not in this engine step any more, however long that is.
                lead = self._step_lead_time.after(self._last_step)
                begun = max(self.holder.time, preparation.start)
                self._next_step_at = begun + RETRY_INTERVAL + self._last_step + lead
            self._after_step(held.goal, is_certified=is_step)

    def _on_event(self, dt: float) -> None:
        """Do what is due before a step of ``dt`` [s].

        A plan that begins inside the step is held from before the step on, with a negative time in
        it, so nothing of the earlier plan is seen beyond the place and time where both agree.
        Several parts of a path may begin and end inside one step.
        """
        self._last_step = dt
        preparation = self.preparation
        if self.tracks and not self.prepares_steps:
            if (preparation is None or preparation.goal is None) and self._take_step(dt):
                return
        held = None
        while held is not self.holder.motion:
            held = self.holder.motion
            if self.preparation is None:
                self._prepare_what_is_due()
            preparation = self.preparation
            if preparation is None or not preparation.is_due(self.holder.time, dt):
                continue
            if preparation.ready is not None:
                self._take(preparation)
            elif not preparation.begins_at_rest:
                preparation.begin_anew(self.holder.time, dt)
                self.look_ahead()
                self._slow_down_a_stop()

    def _prepare_what_is_due(self) -> None:
        """Try again what had to wait, or make the next part of a path or of tracking."""
        if self.tracks:
            if self.prepares_steps:
                self._prepare_next_step()
        elif self.holder.time >= self._retry_at:
            self._slow_down_a_stop()
            if self.preparation is None:
                self.try_again()
        elif math.isinf(self._retry_at) and math.isfinite(self.holder.held.goes_on_at):
            self._prepare_next_part()

    def _prepare_next_step(self) -> None:
        """Make the next step of tracking if it is time to; it begins where the present one ends."""
        holder, last = self.holder, self._last_step
        lead = self._step_lead_time.after(last) if self._in_pieces else 0.0
        # Exactly there, so that the motion is the same whatever the steps are; and as late as
        # possible, as the newest report of the target says most.
        if holder.time + last + lead > self._next_step_at + SAME_TIME:
            start = max(holder.time + lead, self._next_step_at)
            making = self._step_or(self._going_on, None)
            lead_time = self._step_lead_time
            self._begin(Preparation(making, None, holder.held, holder.time, start, lead_time))

    def _prepare_step(self, goal: Command) -> None:
        """Make the first step towards a ``goal``, or a plan where none is proved."""
        lead = self._lead_time.after(self._last_step) if self._in_pieces else 0.0
        time = self.holder.time
        making = self._step_or(self.making(goal), goal)
        self._begin(Preparation(making, goal, self.holder.held, time, time + lead, self._lead_time))

    def _step_or(self, other: Making, goal: Command | None) -> Making:
        """Return what makes a proved step towards a ``goal``, or ``other`` where there is none.

        Without a goal it is the newest one of tracking.
        """

        def made(held: HeldMotion, start: float) -> Interruptible[Replanned]:
            try:
                return (yield from self._shaped(partial(self._step, goal), goal, held, start))
            except KinematicsError:
                return (yield from self._shaped(other, goal, held, start))

        return made

    def _step(
        self, goal: Command | None, held: HeldMotion, start: float
    ) -> Interruptible[Replanned]:
        """Make a step of tracking that begins at ``start`` [s], with the braking behind it.

        Raises:
            PlanningError: if there is none.
        """
        ahead = max(start - self.holder.time, 0.0)
        limits = held.pending or held.limits
        if limits.shaper is not held.limits.shaper and start < held.rests_at:
            raise PlanningError("a shaper has to be empty when another one takes its place")
        limits = limits.leaving(Planned(limits.effective.times(1.0, 1.0, JERK_LEFT_TO_STEPS)))
        held = held.with_goal(goal or self.holder.held.goal, limits=limits, pending=None)
        period = step_period(limits.shaper)
        step = yield from self.tracker.prepared(held, start, period, ahead)
        if step is None:
            raise PlanningError("there is no certified step")
        yield
        return Replanned(step)

    def _going_on(self, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Make what is held where there is no step of tracking: the braking, as a rule."""
        if held.role is PlanRole.EARLIER:
            held = yield from self.replanning.braked(held, start, stays=False)
        elif held.pending is not None and start >= held.rests_at:
            held = replace(held, limits=held.pending, pending=None)
        return Replanned(held)

    def go_over_to(self, goal: Command) -> bool:
        """Track a ``goal`` in motion, if a step towards it is certified; return whether it is.

        With a shaper or added bounds the step is prepared. Outside the workspace nothing is
        tracked.
        """
        held = self.holder.held
        if held.region is not self.workspace:
            return False
        tracking = held.with_goal(goal)
        goes_on = self._tracks_like(goal)
        if self.prepares_steps:
            if goes_on:
                # A step that is being prepared is held soon; the next one leads to this.
                self.keep_goal()
                self.replace(tracking)
                return True
            if held.pending is not None or self.holder.time >= held.plan.duration:
                return False
            self._prepare_step(goal)
            return True
        if not goes_on:
            step = self.tracker.next(tracking, self.holder.time, self._last_step or FIRST_STEP)
            if step is None:
                return False
            tracking = step
        self._track(tracking)
        return True

    def follow_target(self, goal: Command, target: MovingTarget, age: float) -> None:
        """Track a ``target``, seen ``age`` seconds ago, as soon as a step is certified.

        Until then the platform brakes.
        """
        held, time = self.holder.held, self.holder.time
        self.keep_goal()
        if self._tracks_like(goal):
            self.tracker.report(target, age, None)
            self.replace(held.with_goal(goal))
            return
        start = held.plan.at(time).heights
        self.workspace.check_heights(start)
        self.workspace.check_position(target.position)
        self.tracker.report(target, age, start)
        tracking = held.with_goal(goal, region=self.workspace)
        if time < held.plan.duration and not held.brakes:
            self._track(tracking.waiting_to_brake())
            self.prepare_braking(urgent=False)
        else:
            self._track(tracking)

    def _tracks_like(self, goal: Command) -> bool:
        """Return whether something is tracked that is of the kind of a ``goal``."""
        held = self.holder.held
        return self.tracks and held.goal is not None and held.goal.kind is goal.kind

    def _after_step(self, goal: Command, *, is_certified: bool) -> None:
        """Where a ``goal`` has an end, end its tracking at rest, or where there is no step.

        Where there is none once, near an edge, there are some and none in turn, and the platform
        would swerve. So the goal is planned there, as from rest.
        """
        if not goal.has_end:
            return
        held, time = self.holder.held, self.holder.time
        if is_certified:
            step = held.tracked_step
            self.tracks = step is None or not step.ends_at_rest
        else:
            self.tracks = False
            self.replace(held.left_to_brake())
            if held.pending is None and time < held.plan.duration:
                self.prepare(self.making(goal))
        self.look_ahead()

    def _track(self, held: HeldMotion) -> None:
        """Hold what begins to track, or is to do so when a step is certified."""
        self.tracks = True
        self.preparation = None
        self.replace(held)

    def prepare_braking(self, *, urgent: bool, stays: bool = True) -> None:
        """Make a braking; an ``urgent`` one begins at once, which takes a millisecond.

        One that must not leave its path may take longer, so it begins some setpoints later.

        Args:
            urgent: whether it is made at once.
            stays: whether the platform stays on its line where that takes little longer.
        """
        urgent = urgent and self.holder.held.path_plan is None
        self.prepare(partial(self._braked, stays), urgent=urgent)

    def _braked(self, stays: bool, held: HeldMotion, time: float) -> Interruptible[Replanned]:
        return only_held(self.replanning.braked(held, time, stays=stays))

    def _take_step(self, dt: float) -> bool:
        """Track for ``dt`` [s] if such a step is certified; return whether it is."""
        held = self.holder.held
        tracking = self.tracker.next(held, self.holder.time, dt)
        if tracking is not None:
            self.preparation = None
            self.replace(tracking)
        elif self.holder.time >= held.plan.duration and held.pending is not None:
            self.replace(replace(held, limits=held.pending, pending=None))
        if held.goal is not None:
            self._after_step(held.goal, is_certified=tracking is not None)
        return tracking is not None

    def making(self, goal: Command) -> Making:
        """Return what makes a plan to a ``goal``."""
        return lambda held, time: only_held(self.replanning.with_goal(held, time, goal))

    def replace(
        self, held: HeldMotion, refusal: KinematicsError | None = None, elapsed: float = 0.0
    ) -> None:
        """Hold something else, keep a ``refusal``, and see to it that what waits is tried again."""
        if self.holder.motion is None or held.plan is not self.holder.motion.plan:
            step = held.tracked_step
            self._next_step_at = step.period if step is not None else 0.0
        self.holder.hold(held, elapsed)
        self._refusal = refusal or self._refusal
        self._wait(held)

    def _wait(self, held: HeldMotion) -> None:
        """Note when what waits of ``held`` is tried again, if something does."""
        waits = held.waits(self.holder.time)
        self._retry_at = (
            min(self.holder.time + RETRY_INTERVAL, held.rests_at) if waits else math.inf
        )
        self.look_ahead()

    def look_ahead(self) -> None:
        """Note when there is something to do besides going on."""
        if self.tracks:
            self._event_at = -math.inf
        elif self.preparation is not None:
            self._event_at = self.preparation.start
        elif math.isfinite(self._retry_at):
            self._event_at = self._retry_at
        else:
            # The next part of a path is made as soon as it is known to be needed.
            goes_on = math.isfinite(self.holder.held.goes_on_at)
            self._event_at = -math.inf if goes_on else math.inf
