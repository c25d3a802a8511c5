"""Carries out the held plan step by step, while the next one is prepared.

What could not be done at once is tried again: a braking that would break a limit just now, and
limits that the motion cannot keep yet.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.motion.commands import Command, DriveLimits
from tri_glide_kinematics.motion.held_motion import HeldMotion
from tri_glide_kinematics.motion.plan_holder import PlanHolder
from tri_glide_kinematics.motion.plans import SliderState
from tri_glide_kinematics.motion.preparation import LeadTime, Making, Preparation
from tri_glide_kinematics.motion.replanning import Replanning

# What could not be done at once is tried again after this time of motion [s].
RETRY_INTERVAL = 0.008


class PlanExecution(PlanHolder):
    """A held plan that is stepped, and at most one that is being prepared."""

    def __init__(self, replanning: Replanning, limits: DriveLimits, in_pieces: bool) -> None:
        """Hold nothing yet.

        Args:
            replanning: makes plans.
            limits: for the start.
            in_pieces: whether plans are made by ``work``, and not when they are asked for.
        """
        super().__init__(limits)
        self._replanning = replanning
        self._in_pieces = in_pieces
        self._lead_time = LeadTime()
        self._last_step = 0.0
        self._preparation: Preparation | None = None
        self._retry_at = math.inf
        self._event_at = math.inf
        self._refusal: KinematicsError | None = None

    @property
    def preparing(self) -> bool:
        """Whether a plan is being made, or waits for the setpoint at which it begins."""
        return self._preparation is not None

    def step(self, dt: float) -> SliderState:
        """Advance by ``dt`` [s] and return the setpoint.

        Raises:
            NotStartedError: before the start.
            OutOfBoundsError: if ``dt`` is not greater than zero, or NaN.
        """
        held = self._held
        time = self._time + dt
        # Nearly always there is nothing to do but go on. NaN is not greater than zero, either.
        if held is None or not dt > 0.0 or time >= self._event_at:
            if not 0.0 < dt < math.inf:
                raise OutOfBoundsError("dt", dt, "finite and greater than 0", "s")
            self._holding()
            self._on_event(dt)
            held = self._holding()
            # A plan that has just begun may do so a rounding error later.
            time = max(self._time + dt, 0.0)
        self._time = time
        return held.plan.state(time)

    def work(self, may_go_on: Callable[[], bool]) -> None:
        """Go on with what is being prepared, by one piece at least.

        Args:
            may_go_on: asked after each piece, none of which takes a millisecond.
        """
        try:
            self._work(may_go_on)
        except KinematicsError as error:
            self._refusal = error

    def take_refusal(self) -> KinematicsError | None:
        """Return, once, why something that had to wait could not be done after all."""
        refusal, self._refusal = self._refusal, None
        return refusal

    def _prepare(self, making: Making, goal: Command | None = None) -> None:
        """Make what is held next: a first piece of it, and the others unless that is for later."""
        lead = self._lead_time.after(self._last_step) if self._in_pieces else 0.0
        self._preparation = Preparation(making, goal, self._holding(), self._time, lead)
        self._look_ahead()
        self._work(lambda: not self._in_pieces)

    def _work(self, may_go_on: Callable[[], bool]) -> None:
        preparation = self._preparation
        if preparation is None or preparation.ready is not None:
            return
        try:
            preparation.work(may_go_on)
        except KinematicsError:
            self._preparation = None
            self._look_ahead()
            raise
        if preparation.ready is not None:
            self._lead_time.note(preparation.taken(self._time))
            if preparation.has_begun(self._time):
                self._take(preparation)

    def _take(self, preparation: Preparation) -> None:
        """Hold what is ready, as it begins now or in the next step."""
        assert preparation.ready is not None
        self._preparation = None
        self._replace(*preparation.ready, preparation.elapsed(self._time))

    def _on_event(self, dt: float) -> None:
        """Do what is due before a step of ``dt`` [s]."""
        preparation = self._preparation
        if preparation is not None:
            self._last_step = dt
            if not preparation.is_due(self._time, dt):
                return
            if preparation.ready is not None:
                self._take(preparation)
            elif not preparation.begins_at_rest:
                preparation.begin_anew(self._time, dt)
                self._look_ahead()
        elif self._time >= self._retry_at:
            self._prepare(self._replanning.tried_again)

    def _replace(
        self, held: HeldMotion, refusal: KinematicsError | None = None, elapsed: float = 0.0
    ) -> None:
        """Hold something else, keep a ``refusal``, and see to it that what waits is tried again."""
        self._hold(held, elapsed)
        self._refusal = refusal or self._refusal
        waits = held.waits(self._time)
        self._retry_at = min(self._time + RETRY_INTERVAL, held.plan.duration) if waits else math.inf
        self._look_ahead()

    def _look_ahead(self) -> None:
        """Note when there is something to do besides going on."""
        preparation = self._preparation
        self._event_at = self._retry_at if preparation is None else preparation.start
