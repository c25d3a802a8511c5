"""What may be asked of a motion in each state, and what becomes of that."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from tri_glide_kinematics.control.operating_state import (
    JOGGING,
    MOVING,
    ON_THE_WAY,
    PAUSED,
    TRACKING,
    Cause,
    CommandRefusedError,
    Reason,
    StateMachine,
)
from tri_glide_kinematics.control.transfer_timing import TransferTiming
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion.engine import (
    Command,
    DriveLimits,
    GoalCode,
    Jog,
    MotionEngine,
    MotionPhase,
    Move,
    Station,
    TargetKind,
    Track,
)
from tri_glide_kinematics.motion.limits import PlatformSpeedLimit, SliderLimits
from tri_glide_kinematics.motion.tracking import ToldPlaces
from tri_glide_kinematics.motion.transfer import TransferError
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3

if TYPE_CHECKING:
    from tri_glide_kinematics.control.command_queue import CommandQueue, Decided
    from tri_glide_kinematics.control.newest_target import NewestTarget
    from tri_glide_kinematics.control.operation import Operation
    from tri_glide_kinematics.control.supervision import Streams

STATE_OF = {
    MotionPhase.MOVING: MOVING,
    MotionPhase.FOLLOWING: MOVING,
    MotionPhase.JOGGING: JOGGING,
    MotionPhase.TRACKING: TRACKING,
}


# Poses at a rate have ended if none came for so many times the last interval and this much more,
# and for so long [s]: one may be lost, each may be 5 ms early or late, and a sender may be held up.
LATE_INTERVALS, UNEVEN, LATE = 2.0, 0.015, 0.06

# Largest speed of the platform in teach mode: that of ISO 10218 for manual operation [m/s].
TEACH_SPEED = 0.25


def in_teach_mode(limits: SliderLimits, machine: TriGlide) -> SliderLimits:
    """Return ``limits`` with a platform of the ``machine`` that is no faster than in teach mode."""
    if limits.platform_speed <= TEACH_SPEED:
        return limits
    others = [each for each in limits.added if math.isinf(each.platform_speed)]
    return limits.with_added(PlatformSpeedLimit(machine, TEACH_SPEED), *others)


class CommandedMotion:
    """Takes targets and limits in, and tells of those that are carried out.

    Attributes:
        is_teaching: whether the platform has to be slow, as somebody may be beside it.
    """

    def __init__(
        self,
        engine: MotionEngine,
        queue: CommandQueue,
        states: StateMachine,
        streams: Streams,
        newest_target: NewestTarget,
        operation: Operation,
        on_refusal: Callable[[str, Refusal], None],
    ) -> None:
        """Take nothing in yet.

        Args:
            engine: whose limits are kept, and that carries commands out.
            queue: of commands for the engine.
            states: say what may be asked for, and tell what is done.
            streams: of what has to be renewed.
            newest_target: gets each target that is carried out.
            operation: brakes, and fails if something in here is broken.
            on_refusal: gets why a command that had waited is refused, in words and for programs.
        """
        self.is_teaching = False
        self._engine = engine
        self._limits = DriveLimits(engine.limits, *engine.scales)
        self._queue = queue
        self._states = states
        self._streams = streams
        self._newest_target = newest_target
        self._operation = operation
        self._on_refusal = on_refusal
        # Poses that come at a rate, and when the last one came in.
        self._poses = ToldPlaces()
        self._pose_received = 0.0
        self._newest_pose: Vector3 = (0.0, 0.0, 0.0)
        self._timing = TransferTiming(engine, queue, newest_target)

    def move_to(self, position: Sequence[float]) -> None:
        """Move the platform to ``position`` [m], at the latest when it is its turn.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        self.follow(Move(position))

    def follow(self, command: Command) -> None:
        """Follow a path, or move to a position, when it is its turn.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        self._states.check_accepting()
        if command.destination is not None:
            self._engine.check_position(command.destination)
        command.lead = self._operation.underway.delay
        self._carry_out(command)

    def jog(self, velocity: Vector3, now: float, age: float = math.nan) -> None:
        """Move the platform with ``velocity`` [m/s] until the next twist or the timeout.

        No velocity at all is a released stick: it ends a jog, and nothing else.

        Args:
            velocity: of the platform. Shape (3,) [m/s].
            now: time of receipt [s].
            age: how long ago its stamp was then, by this computer's clock; NaN without one [s].

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        jog = Jog(velocity, received=now)
        jog.pause = self._streams.twists.receive(now, jog.is_still)
        if jog.is_still:
            self._queue.drop_stream(jog)
            if self._states.state is JOGGING:
                self._operation.brake(Reason(Cause.RELEASED, "twist of zero"), asked_for=False)
            return
        self._states.check_accepting()
        self._streams.twists.check_released()
        self._streams.twists.check_age(age)
        self._carry_out(jog)

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
        target = Track(position, velocity, seen=seen, received=now)
        target.pause = self._streams.targets.receive(now)
        self._states.check_accepting()
        self._streams.targets.check_released()
        if self._states.state is not TRACKING:
            self._engine.check_position(target.position)
        self._carry_out(target)

    def follow_pose(self, position: Vector3, seen: float, now: float) -> None:
        """Follow poses that come at a rate, as a target that moves.

        The platform moves to the first pose as to any other, and to the last one once there come no
        more. In between, a pose that has the stamp of another, or one too near, changes nothing.

        Args:
            position: of the newest pose. Shape (3,) [m].
            seen: when the target was there [s].
            now: time of receipt [s].

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        if self._poses.is_late(seen):
            text = "the target pose is older, by its stamp, than the last one"
            raise CommandRefusedError(text, Refusal.STAMP)
        before, self._newest_pose = self._newest_pose, position
        if self._poses.is_soon(seen):
            # As long as no velocity is known, it is moved to as the pose before it.
            if not self._poses.interval and position != before:
                self._move_to_pose(position, now)
            return
        # One that is told again is none: the last pose is moved to once there come no others.
        self._pose_received = now
        velocity = self._poses.report(position, seen)
        if velocity is not None:
            self.track(position, velocity, seen, now)
            return
        self._move_to_pose(position, now)

    def _move_to_pose(self, position: Vector3, now: float) -> None:
        """Move to one of the poses, of which no velocity is known; raises as ``follow_pose``."""
        self._streams.targets.receive(now)
        self._streams.targets.check_released()
        # This is no silence of the poses before: the move may take some cycles to plan.
        self._streams.targets.accept(now)
        self.move_to(position)

    def end_poses(self, now: float) -> None:
        """Move to the last one of poses that came at a rate, if there come no more ``now`` [s]."""
        last = self._poses.place
        if last is None:
            return
        late = max(LATE_INTERVALS * self._poses.interval + UNEVEN, LATE)
        if now - self._pose_received < min(late, self._streams.targets.timeout):
            return
        self._poses.forget()
        # Something else may be followed since.
        target = self._queue.target or self._newest_target.command
        if target is not None and target.kind is TargetKind.MOVING and target.position == last:
            # This is no silence: the move may take some cycles to plan.
            self._streams.targets.accept(now)
            with suppress(KinematicsError):
                # Where it cannot be reached, the stream has ended as any other.
                self.move_to(self._newest_pose)

    def set_limits(self, limits: SliderLimits, *scales: float) -> None:
        """Change the limits when it is their turn; too fast a motion slows down first.

        The ``scales`` are those of speed, of path speed, and of rapids: at least the first.
        """
        self._limits = DriveLimits(limits, *scales)
        self._put_limits()

    def set_teach_mode(self, on: bool) -> str:
        """Limit the speed of the platform to ``TEACH_SPEED`` or no more; return that in words.

        Too fast a motion slows down first. A lower limit of the speed stays in force.
        """
        self.is_teaching = on
        self._put_limits()
        if not on:
            return "teach mode is off"
        return f"teach mode is on: the platform slows down to {TEACH_SPEED:g} m/s at most"

    def _put_limits(self) -> None:
        limits = self._limits.sliders
        if self.is_teaching:
            limits = in_teach_mode(limits, self._engine.machine)
        self._queue.put_limits(limits, *self._limits.scales)
        self.go_on()

    def pursue_position(self, position: Sequence[float]) -> Command:
        """Move the platform to ``position`` [m], and return a goal that tells how that ends.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        return self.pursue(Move(position))

    def pursue(self, goal: Command) -> Command:
        """Move the platform, and return the ``goal``, which tells how that ends.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        goal.is_goal = True
        goal.extends = goal.extends and self._has_path
        try:
            self.follow(goal)
        except KinematicsError as error:
            goal.end(GoalCode.REFUSED, str(error))
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

    def renew(self, station: int, motion: Station, seen: float) -> bool:
        """Renew the next ``station`` of a transfer, as ``TransferTiming.renew`` says."""
        return self._states.state is MOVING and self._timing.renew(station, motion, seen)

    def cancel(self, goal: Command) -> None:
        """Come to rest, if the motion is that of the ``goal``; give it up if it only waits."""
        if goal.outcome is not None:
            return
        before = self._newest_target.command
        # The motion to be replaced goes on, unless its goal has ended for this one already.
        has_taken_over = (
            goal is self._queue.target
            and before is not None
            and before.is_goal
            and before.outcome is not None
        )
        goes_on = not goal.extends and not has_taken_over
        waited = self._queue.withdraw(goal)
        if waited and (goes_on or self._states.state not in ON_THE_WAY):
            goal.end(GoalCode.CANCELED, f"cancelled before it began: {goal}")
            return
        text = f"cancelled: {goal}"
        self._newest_target.cancel(goal)
        # Of a path that was extended, no part is driven any more.
        self._newest_target.end_driven(GoalCode.SUPERSEDED, text)
        if goal.extends:
            self._queue.drop_target(GoalCode.SUPERSEDED, text)
        if self._states.state in ON_THE_WAY:
            if goal.is_timed and self._engine.give_up(TransferError(text)):
                # Above what moves there is no place to rest but higher up.
                self._states.change(MOVING, Reason(Cause.CANCELLED, text))
            else:
                self._operation.brake(Reason(Cause.CANCELLED, text), asked_for=False)

    def leads_to(self, goal: Command) -> bool:
        """Return whether the present motion is that of the ``goal``."""
        return goal in self._newest_target.driven and self._states.state in ON_THE_WAY

    def go_on(self, may_go_on: Callable[[], bool] | None = None) -> None:
        """Carry out the command whose turn it is, and plan.

        Args:
            may_go_on: asked, after each piece of planning, for another one. None to plan nothing
                now, unless the engine plans within its commands.
        """
        if self._operation.failure is not None:
            return
        try:
            decided = self._queue.carry_out(self._states.state in ON_THE_WAY, may_go_on)
            if decided is not None:
                self._note(decided)
        except Exception as error:
            self._operation.fail(error)

    def look_after(self) -> None:
        """Tell what has been taken or refused with the setpoint that has just been made."""
        try:
            # A plan that was ready begins with this setpoint.
            decided = self._queue.decided(self._states.state in ON_THE_WAY)
            if decided is not None:
                self._note(decided)
            command = self._newest_target.command
            if command is not None and command.is_timed and self._states.state is MOVING:
                gives_up = self._timing.look_after()
                if gives_up is not None and command.outcome is None:
                    self._tell_given_up(gives_up)
            refusal = self._engine.take_refusal()
            if refusal is not None:
                # A motion that was carried out already cannot go on.
                self._give_up(refusal, str(refusal))
        except Exception as error:
            self._operation.fail(error)

    def _carry_out(self, target: Command) -> None:
        """Carry out the command whose turn it is, which may be this ``target``.

        Raises:
            KinematicsError: if the ``target`` is refused.
        """
        try:
            self._queue.put(target)
            decided = self._queue.carry_out(self._states.state in ON_THE_WAY)
            refusal = decided.refusal if decided and decided.command is target else None
            if decided is not None and refusal is None:
                self._note(decided)
        except Exception as error:
            raise self._operation.fail(error) from error
        if refusal is not None:
            raise refusal

    def _note(self, decided: Decided) -> None:
        """Tell of a command that the engine has taken or refused."""
        command, reason, refusal = decided
        if refusal is not None:
            self._give_up(refusal, f"{command}: {refusal}")
        elif reason is not None:
            self._newest_target.take(command, reason, self._engine.target)
            if command.outputs is not None:
                path, driven = command.path, self._engine.driven_path
                assert path is not None and driven is not None
                places = command.outputs.places(path, driven)
                self._newest_target.outputs.extend(zip(places, command.outputs.told))
            if command.stations:
                self._timing.begin(command)
            if self._engine.is_paused:
                self._tell_pause()
            else:
                self._states.change(STATE_OF[command.phase], reason)

    def _tell_given_up(self, reason: KinematicsError) -> None:
        """Tell that a transfer is given up for a ``reason``, as a station is not met."""
        target = self._newest_target
        text = f"{target.text}: {reason}; the platform goes up"
        target.end_driven(GoalCode.NOT_REACHED, text)
        target.text = "the height above the station"
        self._states.change(MOVING, Reason(Cause.TARGET_NOT_REACHED, text))

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
        newest = self._queue.target
        if newest is not None and not newest.extends:
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
        newest = self._queue.target
        if newest is not None:
            return newest.kind is TargetKind.PATH
        return self._engine.driven_path is not None

    def _give_up(self, refusal: KinematicsError, text: str) -> None:
        """Tell why something is refused; it may be that the present motion cannot go on."""
        self._on_refusal(text, refusal.refusal)
        if self._states.state in ON_THE_WAY and self._engine.target is None:
            self._newest_target.end_driven(GoalCode.REFUSED, text)
