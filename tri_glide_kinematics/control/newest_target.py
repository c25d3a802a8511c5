"""The newest target, and what has become of it. No ROS in here."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

from tri_glide_kinematics.control.operating_state import Cause, Reason
from tri_glide_kinematics.motion.engine import Command, GoalCode
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text


@dataclass(frozen=True)
class InPositionBounds:
    """When a target is reached.

    Attributes:
        tolerance: largest distance from the target of a platform that is there [m].
        settling_time: how long it has to stay within the tolerance [s].
        timeout: after the last setpoint of a motion, time in which the target is reached [s].
        error_limit: a platform that is farther away after that time is a fault [m].
    """

    tolerance: float
    settling_time: float
    timeout: float
    error_limit: float


class Arrival(Enum):
    """What has become of a target."""

    SETTLING = "settling"
    REACHED = "reached"
    NOT_REACHED = "not reached"
    TOO_FAR = "too far away"


class InPosition:
    """Judges the distances from a target that are measured after the setpoints are at rest.

    Attributes:
        bounds: when the target is reached.
        distance: the latest one [m]; NaN before the first.
    """

    def __init__(self, bounds: InPositionBounds, now: float) -> None:
        """Begin ``now`` [s]."""
        self.bounds = bounds
        self.distance = math.nan
        self._began = now
        self._within_since = math.inf

    def measured(self, distance: float, now: float) -> None:
        """Take in a ``distance`` [m] that was measured ``now`` [s]."""
        self.distance = distance
        if not distance <= self.bounds.tolerance:
            self._within_since = math.inf
        elif self._within_since == math.inf:
            self._within_since = now

    def arrival(self, now: float) -> Arrival:
        """Return what has become of the target by ``now`` [s]."""
        bounds = self.bounds
        if now - self._within_since >= bounds.settling_time:
            return Arrival.REACHED
        settles = now - self._began < bounds.timeout or self._within_since < math.inf
        if settles or math.isnan(self.distance):
            return Arrival.SETTLING
        return Arrival.TOO_FAR if self.distance > bounds.error_limit else Arrival.NOT_REACHED

    def text(self, arrival: Arrival, target: str) -> str:
        """Return an ``arrival`` at a ``target`` in words; not for one that still settles."""
        away = f"measured {number_text(self.distance, 2)} m away"
        if arrival is Arrival.REACHED:
            return f"{target} is reached, {away}"
        far = arrival is Arrival.TOO_FAR
        limit = self.bounds.error_limit if far else self.bounds.tolerance
        return (
            f"{target} is {'not' if far else 'NOT'} reached, {away}, "
            f"more than {number_text(limit, 3)} m"
        )


CAUSE_OF = {
    Arrival.REACHED: Cause.TARGET_REACHED,
    Arrival.NOT_REACHED: Cause.TARGET_NOT_REACHED,
    Arrival.TOO_FAR: Cause.TARGET_TOO_FAR,
}


class DueOutput(NamedTuple):
    """An output that is still to be told in a transfer.

    Attributes:
        instant: when [s].
        output: what is told.
        transfer: that it belongs to.
        station: index of the station to whose arrival the instant belongs.
        after: how long after that it is [s].
    """

    instant: float
    output: Any
    transfer: Command
    station: int
    after: float


class NewestTarget:
    """The newest target that the engine has taken.

    A position is judged from when the setpoints stand still, until the next target. If it is not
    reached it is judged on: what holds the sliders back may give way.

    Attributes:
        bounds: when a position counts as reached.
        command: the target; None before the first.
        text: the target in words; empty before the first.
        position: its place, of a path its end. Shape (3,) [m]; None if it has none.
        held_at_edge: whether it leads out of the workspace, so that the platform is held there.
        decided: what has become of it once the machine stood still.
        distance: that was measured when this was decided [m]; None before that.
        driven: the target, and of a path that was extended all that it was before.
        cancelled: targets for which the machine comes to rest.
        outputs: that are still to be told on the path, and where on it [m].
        due: outputs that are still to be told in a transfer, in their order.
    """

    def __init__(self, bounds: InPositionBounds) -> None:
        """Know no target yet."""
        self.bounds = bounds
        self.command: Command | None = None
        self.text = ""
        self.position: Vector3 | None = None
        self.held_at_edge = False
        self.decided = Arrival.SETTLING
        self.distance: float | None = None
        self.driven: tuple[Command, ...] = ()
        self.cancelled: list[Command] = []
        self.outputs: deque[tuple[float, Any]] = deque()
        self.due: deque[DueOutput] = deque()
        self._in_position: InPosition | None = None
        # Whether the sliders are at their commands, after a cancel.
        self._at_rest: InPosition | None = None

    @property
    def is_judged(self) -> bool:
        """Whether measured distances matter."""
        return self._in_position is not None

    @property
    def is_reached(self) -> bool:
        """Whether the machine stands still and is measured there."""
        return self.decided is Arrival.REACHED

    @property
    def is_missed(self) -> bool:
        """Whether the machine stands still and is not measured there."""
        return self.decided in (Arrival.NOT_REACHED, Arrival.TOO_FAR)

    def take(self, command: Command, reason: Reason, end: Vector3 | None = None) -> None:
        """Take a target in place of the last one, which ends, or behind it if it extends a path.

        Args:
            command: that is carried out.
            reason: of the new state.
            end: where the engine leads the platform to [m]; None if it knows no such place.
        """
        self.text = str(command)
        for goal in self.cancelled:
            goal.end(GoalCode.CANCELED, f"cancelled: {goal}; then came {self.text}")
        self.cancelled.clear()
        if command.extends:
            self.driven = (*self.driven, command)
        else:
            self.end_driven(GoalCode.SUPERSEDED, f"superseded by {self.text}")
            self.driven = (command,)
            self.outputs.clear()
            if not command.is_timed:
                # A transfer begins at the end of the one before, whose outputs are still due.
                self.due.clear()
        self.command = command
        self.position = command.position or end
        self.held_at_edge = reason.cause is Cause.EDGE
        self.end()

    def end_driven(self, code: GoalCode, text: str) -> None:
        """Note how the target ended, unless it is cancelled."""
        if code not in (GoalCode.SUCCEEDED, GoalCode.SUPERSEDED):
            self.due.clear()
        for command in self.driven:
            if not command.is_cancelled:
                command.end(code, text)

    def end_cancelled(self, code: GoalCode, text: str) -> None:
        """Note how the targets ended for which the machine comes to rest."""
        for goal in self.cancelled:
            goal.end(code, text)
        self.cancelled.clear()

    def cancel(self, goal: Command) -> None:
        """Let a ``goal`` end when the machine has come to rest."""
        goal.is_cancelled = True
        self.due.clear()
        self.cancelled.append(goal)
        self._at_rest = None

    def come_to_rest(self, now: float) -> None:
        """End cancelled targets if the platform rests; to be called while the setpoints do.

        That is when the sliders are measured at their commands, or do not get there in time.
        """
        if self._at_rest is None:
            self._at_rest = InPosition(self.bounds, now)
        if self._at_rest.arrival(now) is not Arrival.SETTLING:
            for goal in self.cancelled:
                goal.end(GoalCode.CANCELED, f"cancelled: {goal}")
            self.cancelled.clear()

    def rest_measured(self, distance: float, now: float) -> None:
        """Take in how far the sliders are measured from their commands [m], ``now`` [s]."""
        if self._at_rest is not None:
            self._at_rest.measured(distance, now)

    def judge_from(self, now: float) -> None:
        """Judge the measured distances from ``now`` [s] on."""
        self._in_position = InPosition(self.bounds, now)

    def measured(self, distance: float, now: float) -> None:
        """Take in a ``distance`` [m] from the target that was measured ``now`` [s]."""
        if self._in_position is not None:
            self._in_position.measured(distance, now)

    def end(self) -> None:
        """Judge no more, and call nothing missed."""
        self._in_position = None
        self.decided, self.distance = Arrival.SETTLING, None

    def arrival(self, now: float) -> tuple[Arrival, Reason | None]:
        """Return what has become of the target by ``now`` [s], and the reason for a new state.

        There is none while that is not decided.
        """
        position = self._in_position
        if position is None or (arrival := position.arrival(now)) is Arrival.SETTLING:
            return Arrival.SETTLING, None
        if arrival is not self.decided:
            self.decided, self.distance = arrival, position.distance
        if arrival is not Arrival.NOT_REACHED:
            self._in_position = None
        return arrival, Reason(CAUSE_OF[arrival], position.text(arrival, self.text))
