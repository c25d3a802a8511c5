"""The next motion, while its plan is still being made and the held plan goes on.

Its plan begins at a setpoint that is known already, a little ahead. If it is not ready by then, it
is begun anew from a later one; what was done before is lost, so more time is allowed.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.commands import Command
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion
from tri_glide_kinematics.motion.engine.replanning import Replanned
from tri_glide_kinematics.motion.errors import SOUND, PlanTooLongError

# Makes what is held next, from what is held and the time in it at which that begins [s].
Making = Callable[[HeldMotion, float], Interruptible[Replanned]]

# How many plans are remembered, to know how long the next one may take.
REMEMBERED = 8

# The next plan gets more time than any of them took, by this factor.
MARGIN = 1.5

# After a plan was not ready in time, the next attempt gets more time by this factor.
MORE_TIME = 2.0

# A plan takes so many pieces at most, about 0.3 s of processor time; along a path,
# whose pieces are shorter, twice as many, and one more for each segment of a new one. They are
# counted, so that each computer decides alike.
MOST_PIECES = 1000

# Two times that differ by less are the same: rounding [s].
SAME_TIME = 1e-9


class LeadTime:
    """How far ahead the next plan begins: as long as the last ones took, in time of the engine.

    It is 0 where plans are ready before the next step, and otherwise some whole steps: so a plan
    begins with a setpoint, and new limits are in force from a setpoint on.
    """

    def __init__(self) -> None:
        """Expect that plans are ready at once."""
        self._taken: deque[float] = deque(maxlen=REMEMBERED)

    def after(self, step: float) -> float:
        """Return the time, in whole steps of a length ``step`` if that is known [s]."""
        time = MARGIN * max(self._taken, default=0.0)
        return in_steps(time, step) if step else time

    def note(self, taken: float) -> None:
        """Note how long a plan took [s]."""
        self._taken.append(taken)


class Preparation:
    """What is held next, in the making.

    Attributes:
        goal: that it leads to; None if it is not made for a new one.
        start: time in the held plan at which it begins [s].
        held: from which it is made.
        lead_time: is told how long it takes.
        ready: what is held next, once that is known.
    """

    def __init__(
        self,
        making: Making,
        goal: Command | None,
        held: HeldMotion,
        time: float,
        start: float,
        lead_time: LeadTime,
    ) -> None:
        """Begin with it.

        Args:
            making: makes it.
            goal: that it leads to; None if it is not made for a new one.
            held: what is held.
            time: now, in the held plan [s].
            start: when it begins, not before now [s].
            lead_time: is told how long it takes.
        """
        self.goal = goal
        self.lead_time = lead_time
        self._making = making
        self.held = held
        self._begun = time
        self._lead = start - time
        self.ready: Replanned | None = None
        self._begin_at(start)

    def _begin_at(self, start: float) -> None:
        # At the end of the held plan the sliders rest, and go on resting for as long as it takes.
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
        return 0.0 if self.begins_at_rest else time - self.start

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
