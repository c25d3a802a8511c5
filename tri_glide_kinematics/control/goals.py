"""Motions whose end somebody waits for, and how each of them ended. No ROS in here."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from tri_glide_kinematics.control.command_queue import Command, CommandQueue, Target, TargetPath
from tri_glide_kinematics.control.newest_target import (
    Arrival,
    InPosition,
    InPositionBounds,
    NewestTarget,
)

# A newer command ends a goal when it is carried out, as it may still be refused. Its plan takes
# some milliseconds; but after this time the one who waits is told in any case [s]. It is between
# two numbers of cycles at 500 Hz and at 1 kHz, so that it does not depend on how exact these are.
GRACE = 0.0035


class GoalCode(IntEnum):
    """How a goal ended."""

    SUCCEEDED = 0
    CANCELED = 1
    SUPERSEDED = 2
    REFUSED = 3
    NOT_REACHED = 4
    STOPPED = 5
    FAULT = 6
    DISABLED = 7
    SHUTDOWN = 8


class Outcome(NamedTuple):
    """How a goal ended, and that in words."""

    code: GoalCode
    text: str


class Goal:
    """A command whose end somebody waits for.

    Attributes:
        command: it is this very object that is carried out or not, whatever equals it. None if it
            was refused before there was one.
        outcome: how it ended; None until then. It is set once.
        overtaken: since when there is a newer command [s]; infinite if there is none.
        deviation: largest distance from the path as it was asked for, as far as that is known [m].
        is_cancelled: whether it only comes to rest, as the one who waits wanted.
    """

    def __init__(self, command: Target | None, outcome: Outcome | None = None) -> None:
        """Wait for the end of a ``command``, unless its ``outcome`` is known already."""
        self.command = command
        self.outcome = outcome
        self.overtaken = math.inf
        self.deviation = math.nan
        self.is_cancelled = False
        self._rest: InPosition | None = None

    def end(self, code: GoalCode, text: str) -> None:
        """Set the outcome, unless there is one."""
        if self.outcome is None:
            self.outcome = Outcome(code, text)

    def rests(self, bounds: InPositionBounds, now: float) -> None:
        """End once the platform rests; to be called while the setpoints do, after a cancel.

        That is when the sliders are measured at their commands, or do not get there in time.
        """
        if self._rest is None:
            self._rest = InPosition(bounds, now)
        arrival = self._rest.arrival(now)
        if arrival is not Arrival.SETTLING:
            self.end(GoalCode.CANCELED, f"cancelled: {self.command}")

    def measured(self, distance: float, now: float) -> None:
        """Take in how far the sliders are measured from their commands [m]."""
        if self._rest is not None:
            self._rest.measured(distance, now)


class Goals:
    """The goals that have not ended: of commands that wait, and of the one that is carried out.

    Attributes:
        open: these goals, the oldest first.
    """

    def __init__(self, commands: CommandQueue, newest: NewestTarget) -> None:
        """Know none yet.

        Args:
            commands: that wait.
            newest: target that is carried out.
        """
        self.open: list[Goal] = []
        self._commands = commands
        self._newest = newest
        self._superseded: Target | None = None

    def was_superseded(self, command: Target | None) -> bool:
        """Return whether the goal of this very ``command`` was the last to end for a newer one."""
        return command is not None and self._superseded is command

    def add(self, command: Target) -> Goal:
        """Return a new goal: that ``command`` is carried out."""
        goal = Goal(command)
        self.open.append(goal)
        return goal

    def end(self, command: Command | None, code: GoalCode, text: str) -> None:
        """End the goal of a ``command``, if it has one and that is not cancelled."""
        for goal in self.open:
            if goal.command is command and not goal.is_cancelled:
                goal.end(code, text)
        self._forget_ended()

    def end_driven(self, code: GoalCode, text: str) -> None:
        """End the goals of what is carried out."""
        for target in self._newest.driven:
            self.end(target, code, text)

    def end_all(self, code: GoalCode, text: str, *, but_cancelled: bool = False) -> None:
        """End all goals, or all that are not cancelled."""
        for goal in self.open:
            if not (but_cancelled and goal.is_cancelled):
                goal.end(code, text)
        self._forget_ended()

    def keep_held(self) -> None:
        """End all goals whose commands neither wait nor are carried out: a newer one does."""
        for goal in self.open:
            if not self._is_held(goal.command):
                if goal.is_cancelled:
                    text = f"cancelled: {goal.command}; then came {self._newest_text}"
                    goal.end(GoalCode.CANCELED, text)
                else:
                    goal.end(GoalCode.SUPERSEDED, f"superseded by {self._newest_text}")
        self._forget_ended()

    def look(self, now: float) -> None:
        """End goals that a newer command overtook some time before ``now`` [s].

        They end even if that is still planned.
        """
        for goal in self.open:
            if self._is_current(goal.command):
                goal.overtaken = math.inf
            elif goal.overtaken == math.inf:
                goal.overtaken = now
            elif now - goal.overtaken >= GRACE and not goal.is_cancelled:
                self._superseded = goal.command
                goal.end(GoalCode.SUPERSEDED, f"superseded by {self._newest_text}")
        self._forget_ended()

    def measured(self, distance: float, now: float) -> None:
        """Take in how far the sliders are measured from their commands [m], ``now`` [s]."""
        for goal in self.open:
            goal.measured(distance, now)

    def stand_still(self, now: float) -> None:
        """End cancelled goals once the platform rests; to be called while the setpoints rest."""
        for goal in self.open:
            if goal.is_cancelled:
                goal.rests(self._newest.bounds, now)
        self._forget_ended()

    def _is_held(self, target: Target | None) -> bool:
        """Return whether this very ``target`` waits, or is carried out."""
        return self._newest.is_driven(target) or self._commands.holds(target)

    def _is_current(self, target: Target | None) -> bool:
        """Return whether no newer command takes the place of this very ``target``."""
        newest = self._commands.target
        if newest is None:
            return self._newest.is_driven(target)
        if isinstance(newest, TargetPath) and newest.extends:
            return self._is_held(target)
        return target is newest

    @property
    def _newest_text(self) -> str:
        return str(self._commands.target or self._newest.text)

    def _forget_ended(self) -> None:
        self.open = [goal for goal in self.open if goal.outcome is None]
