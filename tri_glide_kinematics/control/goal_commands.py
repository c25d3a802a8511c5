"""Commands whose end somebody waits for, and what can be asked on the way."""

from __future__ import annotations

from dataclasses import replace

from tri_glide_kinematics.control.commanded_motion import CommandedMotion
from tri_glide_kinematics.control.commands import Goal, GoalCode, TargetPath, TargetPosition
from tri_glide_kinematics.control.errors import CommandRefusedError
from tri_glide_kinematics.control.operating_state import MOVING, ON_THE_WAY
from tri_glide_kinematics.control.reason import Cause, Reason
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion.engine import PathProgress
from tri_glide_kinematics.vectors import Vector3


class GoalCommands(CommandedMotion):
    """A commanded motion that tells how single commands end."""

    def pursue_position(self, position: Vector3) -> Goal:
        """Move the platform to ``position`` [m], and return a goal that tells how that ends.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        return self.pursue(TargetPosition(position))

    def pursue(self, command: TargetPosition | TargetPath) -> Goal:
        """Move the platform, and return a goal that tells how that ends.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        if isinstance(command, TargetPath) and command.extends and not self._has_path:
            command = replace(command, extends=False)
        goal = self._goals.add(command)
        try:
            if isinstance(command, TargetPath):
                self.follow(command)
            else:
                self._move_to(command)
        except KinematicsError as error:
            self._goals.end(command, GoalCode.REFUSED, str(error))
            raise
        return goal

    def pause(self) -> str:
        """Come to rest on the path that is followed, and return what happens in words.

        Raises:
            KinematicsError: if none is followed.
        """
        self._states.check_accepting()
        self._check_no_newer()
        with self._failing():
            self._engine.pause()
        self._pause()
        return "comes to rest on the path"

    def resume(self) -> str:
        """Go on along the path after a pause, and return what happens in words.

        Raises:
            KinematicsError: if no path is followed.
        """
        self._states.check_accepting()
        self._check_no_newer()
        with self._failing():
            self._engine.resume()
        self._states.change(MOVING, Reason(Cause.COMMAND, self.newest_target.text))
        return "goes on along the path"

    def _check_no_newer(self) -> None:
        """Check that what is followed is not to be replaced.

        Raises:
            CommandRefusedError: if a newer command waits, or is being planned.
        """
        newest = self._commands.target
        if newest is not None and not (isinstance(newest, TargetPath) and newest.extends):
            text = f"a newer command is not begun yet: {newest}; ask again"
            raise CommandRefusedError(text, Refusal.NEWER_COMMAND)

    @property
    def path_progress(self) -> PathProgress | None:
        """How far the path is driven that is followed, or was followed last.

        None without one, and until its length is known.
        """
        return self._engine.path_progress

    def cancel(self, goal: Goal) -> None:
        """Come to rest, if the motion is that of the ``goal``; give it up if it only waits."""
        if goal.outcome is not None:
            return
        newest = self._commands.target
        extends = isinstance(goal.command, TargetPath) and goal.command.extends
        waited = self._commands.withdraw(goal.command)
        # What is to be replaced goes on, unless its goal has ended for that already.
        before = self.newest_target.command
        goes_on = not extends and not (
            newest is goal.command and self._goals.was_superseded(before)
        )
        if waited and (goes_on or self.state not in ON_THE_WAY):
            text = f"cancelled before it began: {goal.command}"
            self._goals.end(goal.command, GoalCode.CANCELED, text)
            return
        goal.is_cancelled = True
        text = f"cancelled: {goal.command}"
        # Of a path that was extended, no part is driven any more.
        self._end_driven(GoalCode.SUPERSEDED, text)
        if extends:
            self._goals.end_all(GoalCode.SUPERSEDED, text, but_cancelled=True)
        if self.state in ON_THE_WAY:
            self._brake(Reason(Cause.CANCELLED, text), asked_for=False)

    @property
    def _has_path(self) -> bool:
        """Whether the newest command is a path, which can be extended."""
        newest = self._commands.target
        if newest is not None:
            return isinstance(newest, TargetPath)
        return self._engine.driven_path is not None

    def leads_to(self, goal: Goal) -> bool:
        """Return whether the present motion is that of the ``goal``."""
        return self._is_driven(goal.command) and self.state in ON_THE_WAY
