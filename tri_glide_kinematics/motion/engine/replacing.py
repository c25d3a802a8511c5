"""Lets the next plan take the place of the held one: at most one is prepared at a time.

While it is being made the held plan goes on. It begins at a setpoint that is known already, a
little ahead. If it is not ready by then, it is begun anew from a later one; what was done before is
lost, so more time is allowed.

What could not be done at once is tried again: a braking that would break a limit just now, and
limits that the motion cannot keep yet.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.commands import Command
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanHolder, PlanRole
from tri_glide_kinematics.motion.engine.replanning import Making, Replanned, Replanning
from tri_glide_kinematics.motion.engine.shaped_plans import ShapedPlans
from tri_glide_kinematics.motion.errors import SOUND, PlanTooLongError

# How many plans are remembered, to know how long the next one may take.
REMEMBERED = 8

# The next plan gets more time than any of them took, by this factor.
MARGIN = 1.5

# After a plan was not ready in time, the next attempt gets more time by this factor.
MORE_TIME = 2.0

# A plan takes so many pieces at most, about 0.3 s of processor time: of 10,000 random moves at most
# ten need more (``python -m benchmarks.soak_pieces --moves 10000``). Along a path, whose pieces are
# shorter, it takes twice as many, and one more for each segment of a new one. They are counted, so
# that each computer decides alike.
MOST_PIECES = 1100

# Two times that differ by less are the same: rounding [s].
SAME_TIME = 1e-9


class LeadTime:
    """How far ahead the next plan begins: as long as the last ones took, in time of the engine.

    It is 0 where plans are ready before the next step, and otherwise some whole steps: so a plan
    begins with a setpoint, and new limits are in force from a setpoint on.
    """

    def __init__(self, expected: float = 0.0, share: float = 1.0) -> None:
        """Begin without experience.

        Args:
            expected: how long the first plan takes; by default it is ready at once [s].
            share: which of the last times counts, in ascending order: at 1.0 the longest, at 0.5
                the median.
        """
        self._taken: deque[float] = deque((expected,), maxlen=REMEMBERED)
        self._share = share

    def after(self, step: float) -> float:
        """Return the time, in whole steps of a length ``step`` if that is known [s]."""
        time = MARGIN * sorted(self._taken)[int(self._share * (len(self._taken) - 1))]
        return in_steps(time, step) if step else time

    def note(self, taken: float) -> None:
        """Note how long a plan took [s]."""
        self._taken.append(taken)


@dataclass(eq=False, repr=False)
class Preparation:
    """What is held next, in the making.

    Attributes:
        goal: that it leads to; None if it is not made for a new one.
        held: from which it is made.
        start: time in the held plan at which it begins, not before now [s].
        lead_time: is told how long it takes.
        ready: what is held next, once that is known.
    """

    _making: Making
    goal: Command | None
    held: HeldMotion
    # Now, in the held plan [s].
    _begun: float
    start: float
    lead_time: LeadTime
    ready: Replanned | None = None

    def __post_init__(self) -> None:
        """Begin with it."""
        self._lead = self.start - self._begun
        self._begin_at(self.start)

    def _begin_at(self, start: float) -> None:
        # At the end of the held plan the sliders rest, and go on resting for as long as it takes.
        self.ready = None
        self.start = min(start, max(self.held.rests_at, self._begun))
        self._computation = self._making(self.held, self.start)
        self._pieces = 0

    @property
    def begins_at_rest(self) -> bool:
        """Whether it begins where the sliders rest, so that it is never too late for it."""
        return self.start >= self.held.rests_at

    def has_begun(self, time: float) -> bool:
        """Return whether it has begun at a ``time`` in the held plan [s]."""
        return time > self.start - SAME_TIME

    def is_due(self, time: float, step: float) -> bool:
        """Return whether it begins in the ``step`` [s] that is next, at a ``time`` [s].

        Where it begins at rest it begins with a whole step, so that new limits do.
        """
        if self.begins_at_rest:
            return self.has_begun(time)
        return time + step > self.start + SAME_TIME

    def elapsed(self, time: float) -> float:
        """Return how much of it is past at a ``time`` in the held plan, where it is due [s]."""
        waits = self.begins_at_rest and not self._is_timed
        return 0.0 if waits else time - self.start

    @property
    def _is_timed(self) -> bool:
        return self.goal is not None and self.goal.is_timed

    def is_late(self, time: float) -> bool:
        """Return whether the instant for which it was made is over at a ``time`` [s]."""
        if not self._is_timed or self.ready is None:
            return False
        plan = self.ready.held.transfer_plan
        return plan is not None and self.elapsed(time) > plan.wait + SAME_TIME

    def work(self, may_go_on: Callable[[], bool]) -> None:
        """Go on with it, by one piece at least, until it is ready or may not go on.

        Where it takes too many pieces, what is searched for just then is given up, and each other
        way after one piece: so what would do without, as a braking does, still is found.

        Raises:
            KinematicsError: if there is no plan.
        """
        while self.ready is None:
            try:
                with SOUND:
                    if self._pieces < self._most_pieces:
                        next(self._computation)
                    else:
                        self._computation.throw(self._too_long())
            except StopIteration as end:
                self.ready = end.value
            else:
                self._pieces += 1
                if not may_go_on():
                    return

    @property
    def _most_pieces(self) -> int:
        goal = self.goal
        is_path = self.held.path is not None or (goal is not None and goal.path is not None)
        is_path = is_path or self._is_timed
        return (2 if is_path else 1) * MOST_PIECES + (goal.size if goal is not None else 0)

    def _too_long(self) -> PlanTooLongError:
        limits = self.held.pending or self.held.limits
        causes = [bound.name for bound in limits.sliders.added]
        if limits.shaper is not None:
            causes.insert(0, "a shaper")
        if not self.begins_at_rest:
            causes.append("a start in motion")
        return PlanTooLongError(self._most_pieces, causes)

    def begin_anew(self, time: float, step: float) -> None:
        """Begin at a later setpoint, as it was not ready in time.

        Args:
            time: now, in the held plan [s].
            step: time between two setpoints [s].
        """
        self._begun = time
        self._lead = in_steps(MORE_TIME * max(self._lead, step), step)
        self._begin_at(time + self._lead)

    def note_time(self, time: float) -> None:
        """Note that it is ready at a ``time`` [s]: what counts is since it was last begun."""
        self.lead_time.note(max(time - self._begun, 0.0))


def in_steps(time: float, step: float) -> float:
    """Return ``time``, rounded up to whole steps of a length ``step`` [s]."""
    return math.ceil(time / step - SAME_TIME) * step


def only_held(computation: Interruptible[HeldMotion]) -> Interruptible[Replanned]:
    """Return what a ``computation`` makes, as something that refuses no goal."""
    return Replanned((yield from computation))


# Time of motion [s] after which a plan that could not be made at once is tried again.
RETRY_INTERVAL = 0.008

# A stop may take so many pieces within its call. Nearly all take fewer.
URGENT_PIECES = 7


@dataclass(eq=False, repr=False)
class PlanReplacing:
    """Prepares at most one plan, and holds it when it begins.

    Attributes:
        holder: of the plan.
        replanning: makes what is held next.
        shaped_plans: makes it where it is shaped.
        in_pieces: whether plans are made by ``work``, and not when they are asked for.
        tracks: whether something is tracked, so that a new velocity or target needs no plan.
        preparation: of the next plan; None if there is none.
        last_step: how long the last step of the engine was; 0 before the first [s].
        retry_at: when what had to wait is tried again, in the held plan [s].
        event_at: when there is something to do besides going on, in the held plan [s].
        lead_time: of plans.
        path_lead_time: of the next part of a path, which takes longer, but is known to be needed
            long before.
        when_taken: is told what was taken that was made for something tracked, and whether it is
            a step of tracking.
    """

    holder: PlanHolder
    replanning: Replanning
    shaped_plans: ShapedPlans
    in_pieces: bool
    tracks: bool = False
    preparation: Preparation | None = None
    last_step: float = 0.0
    retry_at: float = math.inf
    event_at: float = math.inf
    lead_time: LeadTime = field(default_factory=LeadTime)
    path_lead_time: LeadTime = field(default_factory=LeadTime)
    # All of a path is looked at before it is followed, or goes on.
    _goal_lead_time: LeadTime = field(default_factory=LeadTime)
    _refusal: KinematicsError | None = None
    when_taken: Callable[[Preparation, bool], None] = lambda *_: None

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

    def take_refusal(self) -> KinematicsError | None:
        """Return, once, why something that had to wait could not be done after all."""
        refusal, self._refusal = self._refusal, None
        return refusal

    def work(self, may_go_on: Callable[[], bool]) -> None:
        """Go on with what is being prepared, by one piece at least."""
        try:
            self._go_on(may_go_on)
        except KinematicsError as error:
            self._refusal = error

    def keep_to_plan(self) -> None:
        """Forget all but the held plan, and drive that to its end.

        Nothing is planned for this: so it can be done, whatever has failed.
        """
        self.preparation = None
        self.tracks = False
        self.retry_at = self.event_at = math.inf
        if self.holder.motion is not None:
            self.holder.motion = self.holder.motion.with_goal(
                None, role=PlanRole.BRAKES, pending=None
            )

    def keep_goal(self) -> None:
        """Give up a new goal that is still being prepared; what is held goes on."""
        if self.goal_in_preparation is not None:
            self.preparation = None
            self.look_ahead()

    def try_again(self) -> None:
        """Put pending limits in force, or brake. On a path its next part is planned for that."""
        on_path = self.holder.held.path_plan is not None
        lead_time = self.path_lead_time if on_path else None
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
        lead_time = lead_time or (self._goal_lead_time if is_long else self.lead_time)
        pieces = URGENT_PIECES if urgent else 0
        making = self.shaped_plans.proved(making, goal)
        start = self.holder.time + (0.0 if urgent else self.lead(lead_time))
        self.begin(making, goal, start, lead_time, pieces)

    def prepare_braking(self, *, urgent: bool, stays: bool = True) -> None:
        """Make a braking; an ``urgent`` one begins at once, which takes a millisecond.

        One that must not leave its path may take longer, so it begins some setpoints later.

        Args:
            urgent: whether it is made at once.
            stays: whether the platform stays on its line where that takes little longer.
        """
        urgent = urgent and self.holder.held.path_plan is None
        self.prepare(partial(self.braked, stays), urgent=urgent)

    def braked(self, stays: bool, held: HeldMotion, time: float) -> Interruptible[Replanned]:
        """Make a braking from what is ``held``, as something that refuses no goal."""
        return only_held(self.replanning.braked(held, time, stays=stays))

    def making(self, goal: Command) -> Making:
        """Return what makes a plan to a ``goal``."""
        return lambda held, time: only_held(self.replanning.with_goal(held, time, goal))

    def lead(self, lead_time: LeadTime) -> float:
        """Return how far ahead a plan with this ``lead_time`` begins [s]."""
        return lead_time.after(self.last_step) if self.in_pieces else 0.0

    def begin(
        self,
        making: Making,
        goal: Command | None,
        start: float,
        lead_time: LeadTime,
        pieces: int = 0,
    ) -> None:
        """Begin to make what is held next, with so many ``pieces`` of it at once.

        Args:
            making: makes it, shaped where there is a shaper.
            goal: that it leads to; None if it is not made for a new one.
            start: when it begins, in the held plan [s].
            lead_time: is told how long it takes.
            pieces: that are made within this call.
        """
        held, time = self.holder.held, self.holder.time
        preparation = Preparation(making, goal, held, time, start, lead_time)
        self.preparation = preparation
        self.look_ahead()
        if not self.in_pieces:
            self._go_on(lambda: True)
        elif pieces or preparation.begins_at_rest:
            left = iter(range(pieces - 1))
            self._go_on(lambda: next(left, None) is not None)

    def _go_on(self, may_go_on: Callable[[], bool]) -> None:
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
                self.take(preparation)

    def take(self, preparation: Preparation) -> None:
        """Hold what is ready, as it begins now or in the next step."""
        assert preparation.ready is not None
        if preparation.is_late(self.holder.time):
            preparation.begin_anew(self.holder.time, self.last_step)
            self.look_ahead()
            return
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
        if self.tracks:
            self.when_taken(preparation, is_step)

    def replace(
        self, held: HeldMotion, refusal: KinematicsError | None = None, elapsed: float = 0.0
    ) -> None:
        """Hold something else, keep a ``refusal``, and see to it that what waits is tried again."""
        self.holder.hold(held, elapsed)
        self._refusal = refusal or self._refusal
        self._wait(held)

    def _wait(self, held: HeldMotion) -> None:
        """Note when what waits of ``held`` is tried again, if something does."""
        waits = held.waits(self.holder.time)
        self.retry_at = min(self.holder.time + RETRY_INTERVAL, held.rests_at) if waits else math.inf
        self.look_ahead()

    def look_ahead(self) -> None:
        """Note when there is something to do besides going on."""
        if self.tracks:
            self.event_at = -math.inf
        elif self.preparation is not None:
            self.event_at = self.preparation.start
        elif math.isfinite(self.retry_at):
            self.event_at = self.retry_at
        else:
            # The next part of a path is made as soon as it is known to be needed.
            held = self.holder.held
            goes_on = math.isfinite(held.goes_on_at) or held.may_be_sooner
            self.event_at = -math.inf if goes_on else math.inf
