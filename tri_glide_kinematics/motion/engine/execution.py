"""Carries out commands: steps the held plan, and has the next one prepared when it is due.

It is made of three parts: ``PlanReplacing`` lets the next plan take the place of the held one,
``ShapedPlans`` makes plans that are shaped, ``Tracking`` tracks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.engine.commands import Command, MotionPhase, Transfer
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanHolder
from tri_glide_kinematics.motion.engine.replacing import LeadTime, PlanReplacing
from tri_glide_kinematics.motion.engine.replanning import Replanned, Replanning, stops_in_time
from tri_glide_kinematics.motion.engine.shaped_plans import ShapedPlans
from tri_glide_kinematics.motion.engine.tracker import Tracking
from tri_glide_kinematics.motion.engine.transferring import Transferring
from tri_glide_kinematics.motion.errors import SOUND, NotStartedError
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.motion.moves import MotionKind
from tri_glide_kinematics.motion.path import ArcLength, DrivenPath
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import Trajectory
from tri_glide_kinematics.workspace import Workspace

# A stop that is shaped or has added bounds, if it is not ready within its call, begins after this
# time, as its proof takes many pieces. Where nothing that is shaped is proved by then, the machine
# brakes without the shaper [s].
PROVED_STOP = 0.024

# At first it is expected that a plan that is sooner at the end of a line takes so long [s]. The
# later it begins, the less time it saves.
SOONER_IN = 0.028


class PathMeasuring:
    """Measures one path after the other; the motion does not need their lengths."""

    def __init__(self) -> None:
        """Begin with none."""
        self._under_way: tuple[DrivenPath, Interruptible[ArcLength]] | None = None

    def work(self, driven: DrivenPath | None, may_go_on: Callable[[], bool]) -> None:
        """Go on with the length of a path, unless it is known, while ``may_go_on``."""
        if driven is None or driven.is_measured:
            self._under_way = None
            return
        if self._under_way is None or self._under_way[0] is not driven:
            self._under_way = driven, driven.measured()
        _, measuring = self._under_way
        for _ in measuring:
            if not may_go_on():
                return


class PlanExecution:
    """Carries out one command after the other.

    Attributes:
        holder: of the plan.
        workspace: where the platform may be, and of which machine.
        replanning: makes what is held next.
        shaped_plans: makes it where it is shaped.
        plans: lets it take the place of what is held.
        tracking: holds one step of tracking after the other.
        transferring: plans transfers, and what is left of them.
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
        self.workspace = workspace
        self.replanning = Replanning(workspace, kind)
        self.shaped_plans = ShapedPlans(holder, workspace, self.replanning)
        self.plans = PlanReplacing(holder, self.replanning, self.shaped_plans, in_pieces)
        self.tracking = Tracking(self.plans, workspace)
        self.transferring = Transferring(self.plans, workspace)
        self._path_measuring = PathMeasuring()
        # One that is late is made once more: that costs less than to wait for the longest always.
        self._sooner_lead_time = LeadTime(SOONER_IN, share=0.5)
        # The plan that a stop was slowed down to last, while it waits for a better braking.
        self._slowed_plan: Trajectory | None = None

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
        if held is None or not dt > 0.0 or time >= self.plans.event_at:
            if not 0.0 < dt < math.inf:
                raise OutOfBoundsError("dt", dt, "finite and greater than 0", "s")
            if held is None:
                raise NotStartedError
            self._on_event(dt)
            held = holder.held
            if self.plans.tracks:
                self.tracking.tracker.advance(dt)
            # A plan that has just begun may do so a rounding error later.
            time = max(holder.time + dt, 0.0)
        if holder.shaped is None:
            setpoint = held.plan.at(time)
        else:
            setpoint = holder.shaped.at(dt)
            holder.shaped.time += dt
        holder.time = time
        holder.elapsed += dt
        return setpoint

    def work(self, may_go_on: Callable[[], bool]) -> None:
        """Go on with what is being prepared, by one piece at least; else with what can wait.

        Args:
            may_go_on: asked after each piece, which takes some tenths of a millisecond.
        """
        preparation = self.plans.preparation
        if preparation is None or preparation.ready is not None:
            self._path_measuring.work(self.holder.driven_path, may_go_on)
        else:
            self.plans.work(may_go_on)

    def carry_out(self, command: Command) -> None:
        """Do what a ``command`` asks for.

        Raises:
            NotStartedError: before the start.
            KinematicsError: if it is refused.
        """
        self._shape_from_rest()
        command.begin(self)
        self._look_for_sooner()

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

    def keep_goal(self) -> None:
        """Give up a new goal that is still being prepared; what is held goes on."""
        self.plans.keep_goal()
        self.tracking.tracker.repeat_velocity()

    def go_over_to(self, goal: Command) -> bool:
        """Track a ``goal`` in motion, if a step towards it is certified; return whether it is."""
        return self.tracking.go_over_to(goal)

    def follow_target(self, goal: Command, target: MovingTarget, age: float) -> None:
        """Track a ``target``, seen ``age`` seconds ago, as soon as a step is certified."""
        self.tracking.follow_target(goal, target, age)

    def prepare_transfer(self, goal: Transfer) -> None:
        """Make the plan of a ``goal`` that begins where the present motion comes to rest."""
        self.transferring.prepare(goal)

    def stop(self) -> None:
        """Come to rest as soon as the limits allow, and forget the goal."""
        held = self.holder.held
        self.plans.keep_goal()
        if held.goal is None:
            return
        self.plans.tracks = False
        self.plans.preparation = None
        self.plans.replace(held.with_goal(None).waiting_to_brake())
        stays = held.goal.has_line
        self.plans.prepare_braking(urgent=True, stays=stays)
        making = partial(self.plans.braked, stays)
        if self.holder.shaped is not None and not self._is_stopping_in_time:
            making = partial(self.shaped_plans.braked_in_time, making)
        else:
            self._slow_down_a_stop()
            if self.plans.preparation is None or not self._needs_many_pieces:
                return
        start = self.holder.time + (PROVED_STOP if self.plans.in_pieces else 0.0)
        self.plans.begin(making, None, start, LeadTime(), 1)

    def _slow_down_a_stop(self) -> None:
        """Brake, at once, where a stop has no braking yet that obeys its law."""
        held = self.holder.held
        if held.goal is not None or held.plan is self._slowed_plan or self._is_stopping_in_time:
            return
        making = self._slowed if self.holder.shaped is None else self.shaped_plans.unshaped
        try:
            with SOUND:
                slowed = at_once(making(held, self.holder.time)).held
        except KinematicsError:
            return
        if slowed.plan is not held.plan:
            self._slowed_plan = slowed.plan
            self.plans.preparation = None
            self.plans.replace(slowed)
            if not slowed.brakes:
                self.plans.try_again()

    @property
    def _needs_many_pieces(self) -> bool:
        """Whether a braking that is not ready at once will not be so in a few cycles, either."""
        held = self.holder.held
        waits = not self._is_stopping_in_time and held.plan is not self._slowed_plan
        return waits and bool(held.limits.sliders.added)

    @property
    def _is_stopping_in_time(self) -> bool:
        """Whether what is held is a braking that takes no longer than a stop may."""
        holder = self.holder
        return stops_in_time(holder.held, holder.state, holder.time_to_rest)

    def _slowed(self, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Slow down what is ``held`` on its own way, while it waits for a better braking."""
        slowed = yield from self.replanning.slowed(held, start)
        # A braking that is sooner may lead below the stop of a transfer.
        is_last = held.transfer_plan is not None
        return Replanned(slowed if is_last else slowed.waiting_to_brake())

    def change_limits(self, limits: DriveLimits) -> None:
        """Put limits in force now, or slow down until that is possible; the shaper stays."""
        held = self.holder.motion
        limits = replace(limits, shaper=self.holder.newest_limits.shaper)
        if held is None:
            self.holder.first_limits = limits
        elif limits != self.holder.newest_limits:
            goal = self.plans.goal_in_preparation
            if goal is not None and goal.is_checked_whole:
                # The whole path is looked at first; then it waits for the limits, too.
                self.plans.replace(replace(held, pending=limits))
                return
            if goal is not None:
                # It is planned when the limits are in force.
                self.plans.tracks = False
                held = held.with_goal(goal).waiting_to_brake()
            self.plans.replace(replace(held, pending=limits))
            # The next step of tracking keeps them, if it can.
            if not self.plans.tracks:
                self.plans.try_again()

    def set_shaper(self, shaping: Shaping | None) -> None:
        """Change the shaper as soon as nothing moves."""
        self.shaped_plans.next_shaping = shaping
        self._shape_from_rest()

    def _shape_from_rest(self) -> None:
        """Put the newest shaper in force if nothing moves, nor is about to."""
        if self.plans.preparation is None:
            held = self.shaped_plans.from_rest()
            if held is not None:
                self.plans.replace(held)

    def prepare_goal(self, goal: Command) -> None:
        """Make a plan that leads to a ``goal``, or let that wait for limits."""
        held = self.holder.held
        if held.pending is not None and not goal.is_checked_whole:
            # It has its turn when the limits are in force; what is prepared for them knows it then.
            self.plans.tracks = False
            self.plans.replace(held.with_goal_for_later(goal))
            if self.plans.preparation is not None:
                self.plans.try_again()
        else:
            self.plans.prepare(self.plans.making(goal), goal)

    def _on_event(self, dt: float) -> None:
        """Do what is due before a step of ``dt`` [s].

        A plan that begins inside the step is held from before the step on, with a negative time in
        it, so nothing of the earlier plan is seen beyond the place and time where both agree.
        Several parts of a path may begin and end inside one step.
        """
        self.plans.last_step = dt
        preparation = self.plans.preparation
        if self.plans.tracks and not self.tracking.prepares_steps:
            if (preparation is None or preparation.goal is None) and self.tracking.take_step(dt):
                return
        held = None
        while held is not self.holder.motion:
            held = self.holder.motion
            if self.plans.preparation is None:
                self._prepare_what_is_due()
            preparation = self.plans.preparation
            if preparation is None or not preparation.is_due(self.holder.time, dt):
                continue
            if preparation.ready is not None:
                self.plans.take(preparation)
            elif not preparation.begins_at_rest:
                preparation.begin_anew(self.holder.time, dt)
                self.plans.look_ahead()
                self._slow_down_a_stop()

    def _prepare_what_is_due(self) -> None:
        """Try again what had to wait, or make the next part of a path or of tracking."""
        if self.plans.tracks:
            if self.tracking.prepares_steps:
                self.tracking.prepare_next_step()
        elif self.holder.time >= self.plans.retry_at:
            self._slow_down_a_stop()
            if self.plans.preparation is None:
                self.plans.try_again()
        elif math.isinf(self.plans.retry_at) and math.isfinite(self.holder.held.goes_on_at):
            self._prepare_next_part()
        else:
            self._look_for_sooner()

    def _look_for_sooner(self) -> None:
        """Look for a plan that is sooner at the goal, while a quick one is driven."""
        held, is_free = self.holder.motion, self.plans.preparation is None
        if held is not None and held.may_be_sooner and is_free:
            lead_time = self._sooner_lead_time
            start = self.holder.time + self.plans.lead(lead_time)
            self.plans.begin(self.replanning.sooner, None, start, lead_time)

    def _prepare_next_part(self) -> None:
        """Make the next part of the path that is followed."""
        lead_time = self.plans.path_lead_time
        # Exactly there, so that the motion is the same whatever the steps are.
        start = max(self.holder.time + self.plans.lead(lead_time), self.holder.held.goes_on_at)
        self.plans.begin(self._next_part, None, start, lead_time)

    def _next_part(self, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Make the next part of the path; one that is not proved is treated as one not found."""
        try:
            return (yield from self.shaped_plans.proved(self.replanning.continued)(held, start))
        except KinematicsError as error:
            return self.replanning.without_next_part(held, start, error)
