"""Brings commands to the motion engine, each when it is its turn. No ROS in here."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import ClassVar, NamedTuple

from tri_glide_kinematics.control.errors import CommandRefusedError
from tri_glide_kinematics.control.operating_state import Cause, Reason
from tri_glide_kinematics.control.streams import Streams
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine import MotionEngine, MotionPhase
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.trajectory import NoRoomError, SliderLimits, SliderState
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import vector_text

# In motion, two commands of one kind are carried out at least this time apart [s]: each is a new
# plan, which takes some milliseconds.
COMMAND_INTERVAL = 0.005


class Kind(Enum):
    """What replaces what: of one kind, the newest command wins."""

    TARGET = "target"
    LIMITS = "limits"


class TargetKind(IntEnum):
    """What a target asks for, as programs read it in ``MachineState``."""

    POSITION = 1
    VELOCITY = 2
    MOVING = 3
    PATH = 4


@dataclass(frozen=True)
class TargetPosition:
    """Where the platform is to be moved [m]."""

    kind: ClassVar = TargetKind.POSITION
    position: Vector3
    velocity: ClassVar = None

    def __str__(self) -> str:
        """Return the target in words."""
        return f"target {vector_text(self.position, 6)} m"


@dataclass(frozen=True)
class TargetVelocity:
    """How the platform is to move [m/s], when that came in [s], and how long after the last."""

    kind: ClassVar = TargetKind.VELOCITY
    velocity: Vector3
    received: float
    pause: float
    position: ClassVar = None

    def __str__(self) -> str:
        """Return the target in words."""
        return f"twist {vector_text(self.velocity, 6)} m/s"


@dataclass(frozen=True)
class TrackedTarget:
    """A target that moves.

    Attributes:
        position: where it was [m].
        velocity: how it moves [m/s].
        seen: when it was there, by the clock of the controller [s].
        received: when that came in [s].
        pause: how long after the last one that was [s].
    """

    kind: ClassVar = TargetKind.MOVING
    position: Vector3
    velocity: Vector3
    seen: float
    received: float
    pause: float

    def __str__(self) -> str:
        """Return the target in words."""
        return (
            f"moving target {vector_text(self.position, 6)} m, "
            f"velocity {vector_text(self.velocity, 6)} m/s"
        )


@dataclass(frozen=True, eq=False)
class TargetPath:
    """Lines and arcs to follow.

    Attributes:
        make: makes them, in pieces, from the end of the path that they extend [m]; from where they
            begin if that is None.
        name: in words.
        extends: whether they go on from the end of the path that is followed, if there is one.
    """

    kind: ClassVar = TargetKind.PATH
    make: Callable[[Vector3 | None], Interruptible[PlatformPath]]
    name: str
    extends: bool = False
    position: ClassVar = None
    velocity: ClassVar = None

    def __str__(self) -> str:
        """Return the target in words."""
        return self.name


@dataclass(frozen=True)
class NewLimits:
    """What the drives may do from now on."""

    sliders: SliderLimits
    speed_scale: float


Target = TargetPosition | TargetVelocity | TrackedTarget | TargetPath
Command = Target | NewLimits


class Inbox:
    """Hands out one command in a cycle at most, however many come in.

    A flood so costs one plan in a cycle at most, and one in ``COMMAND_INTERVAL`` for each kind.
    What needs no plan has its turn in each cycle.

    Attributes:
        waiting: the command that waits, of each kind that has one.
    """

    def __init__(self, period: float) -> None:
        """Hold nothing yet, and count in cycles of ``period`` [s]."""
        self.waiting: dict[Kind, Command] = {}
        self._interval = math.ceil(COMMAND_INTERVAL / period - 1e-9)
        self._last_turn = dict.fromkeys(Kind, -self._interval)

    def put(self, kind: Kind, command: Command) -> None:
        """Hold the ``command``, in place of an older one of its ``kind``."""
        self.waiting[kind] = command

    def drop(self, kind: Kind) -> Command | None:
        """Forget, and return, what waits of this ``kind``."""
        return self.waiting.pop(kind, None)

    def take(self, cycle: int, in_each: bool) -> Command | None:
        """Return the command whose turn it is, None if there is none.

        Args:
            cycle: number of the present cycle.
            in_each: whether no command has to wait for longer than a cycle: nothing moves, or what
                waits needs no plan.
        """
        if not self.waiting or cycle in self._last_turn.values():
            return None
        interval = 1 if in_each else self._interval
        due = [kind for kind in self.waiting if cycle - self._last_turn[kind] >= interval]
        if not due:
            return None
        kind = min(due, key=self._last_turn.__getitem__)
        self._last_turn[kind] = cycle
        return self.waiting.pop(kind)


NO_PATH_BEFORE = "the path that it goes on from was refused"
TRACKING_REASON = "follows a moving target"


class CarriedOut(NamedTuple):
    """A target that the engine has taken.

    Attributes:
        target: where, or how, the platform is to move.
        reason: for the new state.
    """

    target: Target
    reason: Reason


class PathMaking:
    """The path that is begun, until the engine has it.

    Attributes:
        making: puts it together, in pieces; None if there is nothing to do.
    """

    def __init__(self, engine: MotionEngine) -> None:
        """Give paths to ``engine``."""
        self._engine = engine
        self.making: Interruptible[PlatformPath] | None = None
        self._extends = False

    def begin(self, target: TargetPath) -> None:
        """Begin with a path, in place of another.

        Raises:
            CommandRefusedError: if it goes on from a path that is not followed any more.
        """
        self._extends = target.extends
        if self._extends and self._engine.driven_path is None:
            text = "the path that it goes on from is not followed any more"
            raise CommandRefusedError(text, Refusal.NO_PATH)
        self.making = target.make(self._engine.target if self._extends else None)

    def give_up(self) -> None:
        """Forget what is begun."""
        self.making = None

    def work(self, may_go_on: Callable[[], bool]) -> KinematicsError | None:
        """Go on by one piece at least, if there is something, and while ``may_go_on``.

        Returns:
            Why the path is refused, if it is.
        """
        while self.making is not None:
            try:
                next(self.making)
            except StopIteration as end:
                self.making = None
                return self._refusal_of(end.value)
            except KinematicsError as error:
                self.making = None
                return error
            except Exception as error:
                # It is made of what somebody has sent: no bytes end more than their own command.
                self.making = None
                text = f"there is no path: {type(error).__name__}: {error}"
                return CommandRefusedError(text, Refusal.MESSAGE)
            if not may_go_on():
                break
        return None

    def _refusal_of(self, path: PlatformPath) -> KinematicsError | None:
        """Give a path to the engine, and return why it refuses it, if it does."""
        try:
            if self._extends:
                self._engine.extend(path)
            else:
                self._engine.follow(path)
        except KinematicsError as error:
            return error
        return None


class CommandQueue:
    """Commands for an engine: a target and limits at most that wait, and one that is planned.

    Attributes:
        refused: the latest command that was refused when it was its turn; None if none was.
    """

    def __init__(
        self,
        engine: MotionEngine,
        period: float,
        streams: Streams,
    ) -> None:
        """Hold nothing yet.

        Args:
            engine: that carries them out.
            period: time of one cycle [s].
            streams: are told which of their commands are carried out.
        """
        self._engine = engine
        self._period = period
        self._streams = streams
        self._now = 0.0
        self._inbox = Inbox(period)
        self._limits = NewLimits(engine.limits, engine.speed_scale)
        self._cycle = 0
        self._rests_first = False
        self._begun: Command | None = None
        self._paths = PathMaking(engine)
        self._extensions: deque[TargetPath] = deque()
        # Those that waited behind a path that was refused.
        self._orphans: frozenset[TargetPath] = frozenset()
        self.refused: Command | None = None

    @property
    def target(self) -> Target | None:
        """The newest target that waits, or is being planned."""
        if self._extensions:
            return self._extensions[-1]
        for command in (self._inbox.waiting.get(Kind.TARGET), self._begun):
            if command is not None and not isinstance(command, NewLimits):
                return command
        return None

    def next_cycle(self, now: float) -> None:
        """Begin a new cycle ``now`` [s]."""
        self._cycle += 1
        self._now = now

    def rest_first(self) -> None:
        """Carry out nothing before the next setpoint, which so is one of rest."""
        self._rests_first = True

    def put(self, target: Target) -> None:
        """Let a ``target`` wait: in place of older ones, or behind them if it extends a path."""
        if isinstance(target, TargetPath) and target.extends:
            self._extensions.append(target)
        else:
            self._extensions.clear()
            self._inbox.put(Kind.TARGET, target)

    def drop_target(self) -> Target | None:
        """Forget the targets that wait or are being planned; return the newest."""
        target = self.target
        self._extensions.clear()
        self._inbox.drop(Kind.TARGET)
        if not isinstance(self._begun, NewLimits):
            self._give_up_begun()
        return target

    def holds(self, target: Target | None) -> bool:
        """Return whether this very ``target`` waits, or is being planned."""
        held = (self._begun, self._inbox.waiting.get(Kind.TARGET), *self._extensions)
        return target is not None and any(target is each for each in held)

    def withdraw(self, target: Target | None) -> bool:
        """Forget this very ``target`` if it waits or is being planned; return whether it did."""
        if not self.holds(target):
            return False
        if isinstance(target, TargetPath) and target in self._extensions:
            self._extensions.remove(target)
        elif target is self._inbox.waiting.get(Kind.TARGET):
            self._inbox.drop(Kind.TARGET)
        else:
            self._give_up_begun()
        return True

    def drop_twist(self) -> None:
        """Forget the newest target, if it is a twist."""
        if isinstance(self.target, TargetVelocity):
            self.drop_target()

    def stop(self) -> None:
        """Let the engine come to rest; a place or path that waits, or is planned, waits on."""
        begun = self._begun
        self._extensions.clear()
        if begun is not None and not isinstance(begun, NewLimits):
            self._begun = None
            self._paths.give_up()
            waits_on = isinstance(begun, TargetPosition) or (
                isinstance(begun, TargetPath) and not begun.extends
            )
            if waits_on and self._inbox.waiting.get(Kind.TARGET) is None:
                self._inbox.put(Kind.TARGET, begun)
        self._engine.stop()

    def put_limits(self, limits: SliderLimits, speed_scale: float) -> None:
        """Let limits wait, in place of older ones, unless they are the newest already."""
        new = NewLimits(limits, speed_scale)
        if new != self._limits:
            self._limits = new
            self._inbox.put(Kind.LIMITS, new)

    def carry_out(
        self, moving: bool, may_go_on: Callable[[], bool] | None = None
    ) -> CarriedOut | None:
        """Carry out the command whose turn it is; return a target that was taken.

        Args:
            moving: whether the engine moves to a position: a jog without room does not end that.
            may_go_on: asked, after each piece of planning, for another one. None to plan nothing
                now, unless the engine plans within its commands.

        Raises:
            KinematicsError: if the engine refuses the command.
        """
        if self._rests_first:
            return None
        refusal = None
        if (self._inbox.waiting or self._extensions) and not self._is_busy:
            in_each = self._engine.tracks or self._engine.phase is MotionPhase.IDLE
            command: Command | None = self._inbox.take(self._cycle, in_each)
            if command is None and self._extensions and not self._inbox.waiting:
                command = self._extensions.popleft()
            if command is not None:
                self._begun = command
                refusal = self._begin(command)
        if may_go_on is not None:
            if self._paths.making is not None:
                refusal = self._paths.work(may_go_on) or refusal
            if self._paths.making is None:
                self._engine.work(may_go_on)
        return None if self._begun is None else self.taken(moving, refusal)

    def taken(self, moving: bool, refusal: KinematicsError | None = None) -> CarriedOut | None:
        """Return the target that the engine has taken, if it has just done so.

        Args:
            moving: whether the engine moves to a position.
            refusal: why it was refused, if that is known already.

        Raises:
            KinematicsError: if the engine refuses the command.
        """
        command = self._begun
        if command is None or (refusal is None and self._is_busy):
            return None
        self._begun = None
        refusal = refusal or self._engine.take_refusal()
        if isinstance(command, TargetVelocity):
            return self._jogged(command, refusal, moving)
        if refusal is not None:
            self.refused = command
            if isinstance(command, TargetPath):
                self._orphans = frozenset(self._extensions)
            raise refusal
        if isinstance(command, TrackedTarget):
            return self._tracked(command)
        if isinstance(command, NewLimits):
            return None
        return CarriedOut(command, Reason(Cause.COMMAND, str(command)))

    def step(self) -> SliderState:
        """Advance the engine by a cycle, and return its setpoint."""
        self._rests_first = False
        return self._engine.step(self._period)

    @property
    def _is_busy(self) -> bool:
        """Whether the next command has to wait: one is begun, and its plan is not held yet.

        While a path is followed its next part is nearly always planned; that may be begun anew.
        """
        if self._paths.making is not None:
            # A newer command takes the place of a path that is still put together.
            return self._inbox.waiting.get(Kind.TARGET) is None
        if not self._engine.preparing:
            return False
        return self._begun is not None or self._engine.phase is not MotionPhase.FOLLOWING

    def _give_up_begun(self) -> None:
        self._begun = None
        self._paths.give_up()
        self._engine.keep_goal()

    def _begin(self, command: Command) -> KinematicsError | None:
        """Give a ``command`` to the engine; return why it refuses it, if that is known at once."""
        self._paths.give_up()
        try:
            if isinstance(command, NewLimits):
                self._engine.set_limits(command.sliders, command.speed_scale)
            elif isinstance(command, TargetPosition):
                self._engine.move_to(command.position)
            elif isinstance(command, TargetVelocity):
                self._engine.jog(command.velocity)
            elif isinstance(command, TargetPath):
                if command in self._orphans:
                    raise CommandRefusedError(NO_PATH_BEFORE, Refusal.NO_PATH)
                self._paths.begin(command)
            else:
                # The next setpoint is for now; the present one of the engine is a period older.
                age = max(self._now, command.received) - self._period - command.seen
                self._engine.track(command.position, command.velocity, age)
        except KinematicsError as error:
            return error
        return None

    def _tracked(self, target: TrackedTarget) -> CarriedOut:
        self._streams.targets.accept(target.received)
        remark = self._streams.targets.remark(target.pause)
        try:
            self._engine.check_position(target.position)
        except KinematicsError as error:
            text = f"{TRACKING_REASON}, held at the edge: {error}{remark}"
            return CarriedOut(target, Reason(Cause.EDGE, text))
        return CarriedOut(target, _streamed(TRACKING_REASON, remark))

    def _jogged(
        self, twist: TargetVelocity, refusal: KinematicsError | None, moving: bool
    ) -> CarriedOut:
        if isinstance(refusal, NoRoomError) and not moving:
            # A move goes on. A jog comes to rest, as its direction is not wanted any more.
            self._engine.stop()
            text = f"{twist}, held at the edge: {refusal}"
            done = CarriedOut(twist, Reason(Cause.EDGE, text))
        elif refusal is not None:
            self.refused = twist
            raise refusal
        else:
            remark = self._streams.twists.remark(twist.pause)
            done = CarriedOut(twist, _streamed(str(twist), remark))
        self._streams.twists.accept(twist.received)
        return done


def _streamed(text: str, remark: str) -> Reason:
    """Return the reason of a motion by a stream; the ``remark`` says if that is too slow."""
    return Reason(Cause.SLOW_STREAM if remark else Cause.COMMAND, f"{text}{remark}")
