"""What may be asked of a motion in each state, and what becomes of that."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tri_glide_kinematics.control.command_queue import (
    CarriedOut,
    CommandQueue,
    Target,
    TargetPath,
    TargetPosition,
    TargetVelocity,
    TrackedTarget,
)
from tri_glide_kinematics.control.errors import CommandRefusedError
from tri_glide_kinematics.control.goals import Goal, GoalCode, Goals
from tri_glide_kinematics.control.newest_target import NewestTarget
from tri_glide_kinematics.control.operating_state import (
    JOGGING,
    MOVING,
    ON_THE_WAY,
    PAUSED,
    TRACKING,
    Cause,
    Reason,
    StateMachine,
)
from tri_glide_kinematics.control.operation import Operation
from tri_glide_kinematics.control.streams import Streams
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion.engine import Jog, MotionEngine
from tri_glide_kinematics.motion.trajectory import SliderLimits
from tri_glide_kinematics.vectors import Vector3

STATE_OF = {
    TargetPosition: MOVING,
    TargetPath: MOVING,
    TargetVelocity: JOGGING,
    TrackedTarget: TRACKING,
}


class CommandedMotion:
    """Takes targets and limits in, and tells of those that are carried out."""

    def __init__(
        self,
        engine: MotionEngine,
        commands: CommandQueue,
        states: StateMachine,
        streams: Streams,
        newest_target: NewestTarget,
        goals: Goals,
        operation: Operation,
        on_refusal: Callable[[str, Refusal], None],
    ) -> None:
        """Take nothing in yet.

        Args:
            engine: that carries commands out.
            commands: for the engine, that wait.
            states: say what may be asked for, and tell what is done.
            streams: of what has to be renewed.
            newest_target: gets each target that is carried out.
            goals: get the end of each command whose end somebody waits for.
            operation: brakes, and fails if something in here is broken.
            on_refusal: gets why a command that had waited is refused, in words and for programs.
        """
        self._engine = engine
        self._commands = commands
        self._states = states
        self._streams = streams
        self._newest_target = newest_target
        self._goals = goals
        self._operation = operation
        self._on_refusal = on_refusal

    def move_to(self, position: Vector3) -> None:
        """Move the platform to ``position`` [m], at the latest when it is its turn.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        self._move_to(TargetPosition(position))

    def follow(self, path: TargetPath) -> None:
        """Follow a ``path``, when it is its turn.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        self._states.check_accepting()
        self._carry_out(path)

    def jog(self, velocity: Vector3, now: float) -> None:
        """Move the platform with ``velocity`` [m/s] until the next twist or the timeout.

        No velocity at all is a released stick: it ends a jog, and nothing else.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        released = Jog(velocity).is_still
        pause = self._streams.twists.receive(now, released)
        if released:
            self._commands.drop_twist()
            if self._states.state is JOGGING:
                self._operation.brake(Reason(Cause.RELEASED, "twist of zero"), asked_for=False)
            return
        self._states.check_accepting()
        self._streams.twists.check_released()
        self._carry_out(TargetVelocity(velocity, now, pause))

    def track(self, position: Vector3, velocity: Vector3, seen: float, now: float) -> None:
        """Follow a moving target until the timeout after the last call.

        Args:
            position: of the target. Shape (3,) [m].
            velocity: of the target. Shape (3,) [m/s].
            seen: when it was so [s].
            now: time of receipt [s].

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        pause = self._streams.targets.receive(now)
        self._states.check_accepting()
        self._streams.targets.check_released()
        if self._states.state is not TRACKING:
            self._engine.check_position(position)
        self._carry_out(TrackedTarget(position, velocity, seen, now, pause))

    def set_limits(self, limits: SliderLimits, speed_scale: float) -> None:
        """Change the limits when it is their turn; too fast a motion slows down first."""
        self._commands.put_limits(limits, speed_scale)
        self.go_on()

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
        self._ask_of_path(self._engine.pause)
        self._tell_pause()
        return "comes to rest on the path"

    def resume(self) -> str:
        """Go on along the path after a pause, and return what happens in words.

        Raises:
            KinematicsError: if no path is followed.
        """
        self._ask_of_path(self._engine.resume)
        self._states.change(MOVING, Reason(Cause.COMMAND, self._newest_target.text))
        return "goes on along the path"

    def cancel(self, goal: Goal) -> None:
        """Come to rest, if the motion is that of the ``goal``; give it up if it only waits."""
        if goal.outcome is not None:
            return
        newest = self._commands.target
        extends = isinstance(goal.command, TargetPath) and goal.command.extends
        waited = self._commands.withdraw(goal.command)
        # What is to be replaced goes on, unless its goal has ended for that already.
        before = self._newest_target.command
        goes_on = not extends and not (
            newest is goal.command and self._goals.was_superseded(before)
        )
        if waited and (goes_on or self._states.state not in ON_THE_WAY):
            text = f"cancelled before it began: {goal.command}"
            self._goals.end(goal.command, GoalCode.CANCELED, text)
            return
        goal.is_cancelled = True
        text = f"cancelled: {goal.command}"
        # Of a path that was extended, no part is driven any more.
        self._goals.end_driven(GoalCode.SUPERSEDED, text)
        if extends:
            self._goals.end_all(GoalCode.SUPERSEDED, text, but_cancelled=True)
        if self._states.state in ON_THE_WAY:
            self._operation.brake(Reason(Cause.CANCELLED, text), asked_for=False)

    def leads_to(self, goal: Goal) -> bool:
        """Return whether the present motion is that of the ``goal``."""
        return self._newest_target.is_driven(goal.command) and self._states.state in ON_THE_WAY

    def go_on(self, may_go_on: Callable[[], bool] | None = None) -> None:
        """Carry out the command whose turn it is, and plan.

        Args:
            may_go_on: asked, after each piece of planning, for another one. None to plan nothing
                now, unless the engine plans within its commands.
        """
        if self._operation.failure is not None:
            return
        try:
            done = self._commands.carry_out(self._states.state in ON_THE_WAY, may_go_on)
            if done is not None or self._goals.open:
                self._note(done)
        except Exception as error:
            self._tell_error(error)

    def look_after(self) -> None:
        """Tell what has been taken or refused with the setpoint that has just been made."""
        refusal = self._engine.take_refusal()
        if refusal is not None:
            self._give_up(refusal, str(refusal))
        try:
            # A plan that was ready begins with this setpoint.
            done = self._commands.taken(self._states.state in ON_THE_WAY)
            if done is not None or self._goals.open:
                self._note(done)
        except Exception as error:
            self._tell_error(error)

    def _move_to(self, command: TargetPosition) -> None:
        self._states.check_accepting()
        self._engine.check_position(command.position)
        self._carry_out(command)

    def _carry_out(self, target: Target) -> None:
        """Carry out the command whose turn it is, which may be this ``target``.

        Raises:
            KinematicsError: if the ``target`` is refused.
        """
        self._commands.put(target)
        try:
            self._note(self._commands.carry_out(self._states.state in ON_THE_WAY))
        except KinematicsError as error:
            if self._commands.refused is target:
                raise
            self._tell_error(error)
        except Exception as error:
            raise self._operation.fail(error) from error

    def _note(self, done: CarriedOut | None) -> None:
        """Tell of a target that the engine has taken."""
        if done is not None:
            self._newest_target.take(done, self._engine.target)
            if self._engine.is_paused:
                self._tell_pause()
            else:
                self._states.change(STATE_OF[type(done.target)], done.reason)
        self._goals.keep_held()

    def _tell_pause(self) -> None:
        """Tell that the path that is followed is paused."""
        text = f"{self._newest_target.text}, paused"
        self._states.change(PAUSED, Reason(Cause.PAUSE_ASKED, text))

    def _ask_of_path(self, ask: Callable[[], None]) -> None:
        """Ask something of the engine for the path that is followed.

        Raises:
            KinematicsError: if there is none, or it is to be replaced by a newer command.
        """
        self._states.check_accepting()
        newest = self._commands.target
        if newest is not None and not (isinstance(newest, TargetPath) and newest.extends):
            text = f"a newer command is not begun yet: {newest}; ask again"
            raise CommandRefusedError(text, Refusal.NEWER_COMMAND)
        try:
            ask()
        except KinematicsError:
            raise
        except Exception as error:
            raise self._operation.fail(error) from error

    @property
    def _has_path(self) -> bool:
        """Whether the newest command is a path, which can be extended."""
        newest = self._commands.target
        if newest is not None:
            return isinstance(newest, TargetPath)
        return self._engine.driven_path is not None

    def _tell_error(self, error: Exception) -> None:
        """Tell why the command whose turn it was is refused, or that something is broken."""
        if isinstance(error, KinematicsError):
            refused = self._commands.refused
            self._goals.end(refused, GoalCode.REFUSED, str(error))
            self._give_up(error, f"{refused}: {error}")
        else:
            self._operation.fail(error)

    def _give_up(self, error: KinematicsError, text: str) -> None:
        """Tell why something is refused; it may be that the present motion cannot go on."""
        self._on_refusal(text, error.refusal)
        if self._goals.open and self._engine.target is None:
            self._goals.end_driven(GoalCode.REFUSED, text)
