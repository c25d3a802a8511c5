"""Takes targets and limits in, and tells of those that are carried out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from tri_glide_kinematics.control.commands import (
    CarriedOut,
    EngineCommands,
    GoalCode,
    Goals,
    NewestTarget,
    Stream,
    Streams,
    Target,
    TargetPath,
    TargetPosition,
    TargetVelocity,
    TrackedTarget,
)
from tri_glide_kinematics.control.errors import BrokenError
from tri_glide_kinematics.control.operating_state import (
    FAULT,
    IDLE,
    JOGGING,
    MOVING,
    ON_THE_WAY,
    PAUSED,
    TRACKING,
    OperatingState,
    StateMachine,
)
from tri_glide_kinematics.control.reason import Cause, Reason
from tri_glide_kinematics.control.status import ControllerStatus
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion.engine import MotionEngine, jog_of
from tri_glide_kinematics.motion.trajectory import SliderLimits
from tri_glide_kinematics.vectors import Vector3

STATE_OF = {
    TargetPosition: MOVING,
    TargetPath: MOVING,
    TargetVelocity: JOGGING,
    TrackedTarget: TRACKING,
}


class CommandedMotion:
    """What may be asked of an engine in each state.

    Attributes:
        streams: of what has to be renewed; their timeouts can be changed.
        newest_target: when it counts as reached can be changed.
        failure: what is broken in here; None as long as nothing is.
    """

    def __init__(
        self,
        engine: MotionEngine,
        commands: EngineCommands,
        states: StateMachine,
        streams: Streams,
        newest_target: NewestTarget,
        on_refusal: Callable[[str, Refusal], None],
    ) -> None:
        """Take nothing in yet.

        Args:
            engine: that carries commands out.
            commands: for it, that wait.
            states: say what may be asked for.
            streams: of what has to be renewed.
            newest_target: gets each target that is carried out.
            on_refusal: gets why a command that had waited is refused, in words and for programs.
        """
        self.streams = streams
        self.newest_target = newest_target
        self._engine = engine
        self._commands = commands
        self._states = states
        self._on_refusal = on_refusal
        self._goals = Goals()
        # What the path that is followed was, before it was extended.
        self._before: list[Target | None] = []
        self._leading = False
        self.failure: BrokenError | None = None

    @property
    def status(self) -> ControllerStatus:
        """State, reason and target."""
        target = self.newest_target
        command = target.command
        return ControllerStatus(
            self.state,
            self.reason,
            target.text,
            target.is_missed,
            target.held_at_edge,
            target.is_reached,
            target.distance,
            None if command is None else command.kind,
            target.position,
            None if command is None else command.velocity,
            self._leading,
            self._engine.speed_scale,
        )

    @property
    def state(self) -> OperatingState:
        """What the controller is doing."""
        return self._states.state

    @property
    def reason(self) -> Reason:
        """Why it is doing that."""
        return self._states.reason

    @property
    def leads(self) -> bool:
        """Whether there is a setpoint in each cycle."""
        return self._leading

    @property
    def tracking_distance(self) -> float:
        """How far the setpoint is from a moving target that is followed; NaN without one [m]."""
        return self._engine.tracking_distance

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
        released = jog_of(velocity) is None
        pause = self.streams.twists.receive(now, released)
        if released:
            self._commands.drop_twist()
            if self.state is JOGGING:
                self._brake(Reason(Cause.RELEASED, "twist of zero"), asked_for=False)
            return
        self._states.check_accepting()
        self.streams.twists.check_released()
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
        pause = self.streams.targets.receive(now)
        self._states.check_accepting()
        self.streams.targets.check_released()
        if self.state is not TRACKING:
            self._engine.check_position(position)
        self._carry_out(TrackedTarget(position, velocity, seen, now, pause))

    def set_limits(self, limits: SliderLimits, speed_scale: float) -> None:
        """Change the limits when it is their turn; too fast a motion slows down first."""
        self._commands.put_limits(limits, speed_scale)
        self._take(self._commands.carry_out)

    def fail(self, cause: Exception) -> BrokenError:
        """Come to rest, and then lead no more, as something in here is broken.

        If a braking can still be planned, that is driven; else the held plan, which is verified and
        leads to rest as well. After this nothing is planned any more.

        Args:
            cause: what was raised; the first one counts.

        Returns:
            What is said of it.
        """
        if self.failure is None:
            self.failure = BrokenError(cause)
            with suppress(Exception):
                self._engine.stop()
            self._engine.keep_to_plan()
            text = str(self.failure)
            reason = Reason(Cause.PROGRAM_ERROR, text)
            self._states.change(FAULT if self._leading else self.state, reason)
            self._goals.end_all(GoalCode.FAULT, text)
        return self.failure

    def plan(self, may_go_on: Callable[[], bool]) -> None:
        """Go on with the planning of commands: by a piece at least, and while ``may_go_on``."""
        if self._leading:
            self._take(lambda moving: self._commands.carry_out(moving, may_go_on))

    @property
    def _stream(self) -> Stream | None:
        """What has to be renewed for the present motion to go on."""
        if self.state is JOGGING:
            return self.streams.twists
        return self.streams.targets if self.state is TRACKING else None

    def _move_to(self, command: TargetPosition) -> None:
        self._states.check_accepting()
        self._engine.check_position(command.position)
        self._carry_out(command)

    def _brake(self, reason: Reason, asked_for: bool = True, then: OperatingState = IDLE) -> None:
        self._states.stop(reason, asked_for=asked_for, then=then)
        self._come_to_rest()
        self._note(None)

    def _come_to_rest(self) -> None:
        """Let the engine brake; where that fails, the held plan leads to rest as well."""
        try:
            self._commands.stop()
        except Exception as error:
            self.fail(error)

    @contextmanager
    def _failing(self) -> Iterator[None]:
        """Fail, and refuse what is asked for, if that raises anything but a refusal.

        Raises:
            KinematicsError: the refusal.
        """
        try:
            yield
        except KinematicsError:
            raise
        except Exception as error:
            raise self.fail(error) from error

    def _take(self, carry_out: Callable[[bool], CarriedOut | None]) -> None:
        """Take note of a command that is carried out, or tell why it is refused."""
        if self.failure is not None:
            return
        try:
            self._note(carry_out(self.state in ON_THE_WAY))
        except KinematicsError as error:
            self._tell_refusal(error)
        except Exception as error:
            self.fail(error)

    def _carry_out(self, target: Target) -> None:
        """Carry out the command whose turn it is, which may be this ``target``.

        Raises:
            KinematicsError: if the ``target`` is refused.
        """
        self._commands.put(target)
        try:
            self._note(self._commands.carry_out(self.state in ON_THE_WAY))
        except KinematicsError as error:
            if self._commands.refused is target:
                raise
            self._tell_refusal(error)
        except Exception as error:
            raise self.fail(error) from error

    def _note(self, done: CarriedOut | None) -> None:
        """Tell of a target that the engine has taken."""
        if done is not None:
            if isinstance(done.target, TargetPath) and done.target.extends:
                self._before.append(self.newest_target.command)
            else:
                self._before.clear()
            self.newest_target.take(done, self._engine.target)
            if self._engine.is_paused:
                self._pause()
            else:
                self._states.change(STATE_OF[type(done.target)], done.reason)
        if self._goals:
            self._goals.keep(self._is_held, self._newest_text)

    def _pause(self) -> None:
        """Tell that the path that is followed is paused."""
        text = f"{self.newest_target.text}, paused"
        self._states.change(PAUSED, Reason(Cause.PAUSE_ASKED, text))

    def _end_driven(self, code: GoalCode, text: str) -> None:
        """End the goals of what is carried out."""
        for target in (*self._before, self.newest_target.command):
            self._goals.end(target, code, text)

    def _is_held(self, target: Target | None) -> bool:
        """Return whether this very ``target`` waits, or is carried out."""
        return self._is_driven(target) or self._commands.holds(target)

    def _is_driven(self, target: Target | None) -> bool:
        """Return whether this very ``target`` is carried out, or a path that extends it."""
        newest = self.newest_target.command
        return target is newest or any(target is each for each in self._before)

    def _is_current(self, target: Target | None) -> bool:
        """Return whether no newer command takes the place of this very ``target``."""
        newest = self._commands.target
        if newest is None:
            return self._is_driven(target)
        if isinstance(newest, TargetPath) and newest.extends:
            return self._is_held(target)
        return target is newest

    @property
    def _newest_text(self) -> str:
        return str(self._commands.target or self.newest_target.text)

    def _tell_refusal(self, error: KinematicsError) -> None:
        refused = self._commands.refused
        self._goals.end(refused, GoalCode.REFUSED, str(error))
        self._give_up(error, f"{refused}: {error}")

    def _give_up(self, error: KinematicsError, text: str = "") -> None:
        """Tell why something is refused; it may be that the present motion cannot go on.

        The ``text`` says more than the ``error`` alone, if it is given.
        """
        text = text or str(error)
        self._on_refusal(text, error.refusal)
        if self._goals and self._engine.target is None:
            self._end_driven(GoalCode.REFUSED, text)
