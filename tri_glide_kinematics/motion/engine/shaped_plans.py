"""Makes plans that keep the limits when they are shaped, each with a shaper for where it leads.

Plans are made as without a shaper, for a little less than the limits; what the shaper makes of them
is proved before they are held. One that is not proved is made again, for less.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.commands import Command, MotionPhase
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanHolder, PlanRole
from tri_glide_kinematics.motion.engine.replanning import (
    Making,
    Replanned,
    Replanning,
    longest_stop,
)
from tri_glide_kinematics.motion.errors import AddedBoundError, SliderLimitError
from tri_glide_kinematics.motion.moves import inside
from tri_glide_kinematics.motion.shaped import DrivenPart, Planned, ShapedTrajectory
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.workspace import Workspace

# Number of attempts to make the next plan with limits that leave what shaping takes. Each takes
# time in which the held plan goes on.
ATTEMPTS_IN_MOTION = 5


class ShapedPlans:
    """Makes and proves plans that are shaped.

    Attributes:
        next_shaping: the newest one that was asked for; it is in force from rest on.
    """

    def __init__(self, holder: PlanHolder, workspace: Workspace, replanning: Replanning) -> None:
        """Begin without a shaper.

        Args:
            holder: of the plan that goes on until the next one begins.
            workspace: where the platform may be, and of which machine.
            replanning: makes what is held next.
        """
        self.next_shaping: Shaping | None = None
        self._shaping: Shaping | None = None
        self._holder = holder
        self._workspace = workspace
        self._replanning = replanning

    @property
    def is_shaped(self) -> bool:
        """Whether there is a shaper, in force or from the next rest on."""
        return self._holder.newest_limits.shaper is not None

    @property
    def shaper_pending(self) -> bool:
        """Whether another shaper waits for rest."""
        holder = self._holder
        return (
            self.next_shaping != self._shaping
            or holder.newest_limits.shaper is not holder.limits.shaper
        )

    def from_rest(self) -> HeldMotion | None:
        """Put the newest shaper in force if nothing moves; return what is held with it then."""
        holder, shaping = self._holder, self.next_shaping
        held = holder.motion
        if shaping == self._shaping:
            return None
        if held is not None and held.phase(holder.time) is not MotionPhase.IDLE:
            return None
        self._shaping = shaping
        # The target of the next motion is not known yet.
        shaper = None if shaping is None else shaping.covering(None)
        limits = replace(holder.limits, shaper=shaper, planned=None)
        if held is None:
            holder.first_limits = limits
            return None
        return replace(held, limits=limits)

    def proved(self, making: Making, goal: Command | None = None) -> Making:
        """Return a ``making`` whose plans keep the limits when they are shaped, if they are.

        Args:
            making: makes the plans.
            goal: that they lead to; None for a stop, or for what goes on.
        """
        return partial(self._made_or_later, making, goal) if self.is_shaped else making

    def _made_or_later(
        self, making: Making, goal: Command | None, held: HeldMotion, start: float
    ) -> Interruptible[Replanned]:
        """Make what is held next; a goal that cannot be made in motion waits, and is tried again.

        What the shaper still holds back may exceed a limit together with the new plan; a little
        later there is less of it, and at rest nothing.

        Raises:
            KinematicsError: if there is no plan.
        """
        try:
            return (yield from self.made(making, goal, held, start))
        except (SliderLimitError, AddedBoundError):
            if goal is None or goal.path is not None or held.pending or start >= held.rests_at:
                raise
            return Replanned(replace(held.with_goal_for_later(goal), pending=held.limits))

    def made(
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
        stops_on_line = held.plan.straight_from < math.inf and held.goal is None
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
            # A motion from rest begins when it is ready, however late that is.
            lead = max(start - self._holder.time, 0.0)
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
        if after.goal.destination_unknown:
            shaper = shaping.covering(None, None if rests else before)
        else:
            yield
            places = after.places(self._workspace.machine)
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
            planned = self._replanning.planned(held, start, after.goal, limits, or_after=True)
            return made._replace(held=(yield from planned))
        waiting = replace(after, pending=limits, role=PlanRole.EARLIER)
        if start < held.plan.duration:
            return (yield from self._replanning.tried_again(waiting, 0.0))
        # The next plan would begin before the shaper is empty.
        heights = held.plan.at(start).heights
        resting = replace(waiting, plan=self._replanning.at_rest(heights, limits).plan)
        if after.path is not None:
            resting = resting.on(replace(after.path, place=after.place(0.0)))
        return Replanned(resting.left_to_brake())

    def _driven_with(self, held: HeldMotion, lead: float) -> ShapedTrajectory:
        """Return what is driven if something else is held in ``lead`` seconds."""
        shaped, shaper = self._holder.shaped, held.limits.shaper
        if shaped is not None and shaped.shaper is shaper:
            return shaped.going_on(held.plan, lead)
        assert shaper is not None
        return ShapedTrajectory(
            self._workspace.machine, shaper, (DrivenPart(lead, held.plan, 0.0),)
        )

    def braked_in_time(
        self, braking: Making, held: HeldMotion, start: float
    ) -> Interruptible[Replanned]:
        """Make a ``braking`` of what is shaped; where none is in time, one without the shaper."""
        longest = longest_stop(self._holder.state, held.limits.scaled) - (start - self._holder.time)
        try:
            made = yield from self.made(braking, None, held, start)
            plan = made.held.plan
            if made.held.brakes and plan.duration - (plan is held.plan) * start <= longest:
                return made
        except KinematicsError:
            yield
        return (yield from self.unshaped(held, start))

    def unshaped(self, held: HeldMotion, start: float) -> Interruptible[Replanned]:
        """Brake from what is driven at ``start`` [s], which is shaped no more until it rests.

        To prove that takes little: it depends on nothing but the setpoint then.
        """
        shaped = self._holder.shaped
        assert shaped is not None
        lead = max(start - self._holder.time, 0.0)
        later = held.pending or replace(held.limits, planned=None)
        limits = replace(held.limits, shaper=None, planned=None)
        plan = shaped.going_on(held.plan, 0.0)
        driven = replace(held.waiting_to_brake(), plan=plan, limits=limits, pending=later)
        braked = yield from self._replanning.braked(driven, lead, stays=False)
        if braked.plan is plan:
            braked = yield from self._replanning.slowed(driven, lead)
        return Replanned(braked if braked.plan is not plan else held)
