"""Brings commands to the motion engine, each when it is its turn. No ROS in here."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from tri_glide_kinematics.control.newest_target import NewestTarget
from tri_glide_kinematics.control.operating_state import Cause, CommandRefusedError, Reason
from tri_glide_kinematics.control.supervision import Streams
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine import (
    Command,
    DriveLimits,
    GoalCode,
    MotionEngine,
    MotionPhase,
    NewLimits,
)
from tri_glide_kinematics.motion.limits import SliderLimits, SliderState

# In motion, two commands of one kind are carried out at least this time apart [s]: each is a new
# plan, which takes some milliseconds.
COMMAND_INTERVAL = 0.005

# A newer command ends older ones when it is carried out, as it may still be refused. But who waits
# for an older one is told when so many cycles have begun since the newer one came in: the last of
# them begins after one whole cycle of planning.
CYCLES_UNTIL_TOLD = 2

NO_PATH_BEFORE = "the path that it goes on from was refused"
NO_PATH_ANY_MORE = "the path that it goes on from is not followed any more"


class Kind(Enum):
    """What replaces what: of one kind, the newest command wins."""

    TARGET = "target"
    LIMITS = "limits"

    @classmethod
    def of(cls, command: Command) -> Kind:
        """Return the kind of a ``command``."""
        return cls.TARGET if command.is_target else cls.LIMITS


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

    def put(self, command: Command) -> Command | None:
        """Hold the ``command``, in place of an older one of its kind, which is returned."""
        kind = Kind.of(command)
        older, self.waiting[kind] = self.waiting.get(kind), command
        return older

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


class Decided(NamedTuple):
    """A command that the engine has taken, or refused.

    Attributes:
        command: asks for a motion, or was refused.
        reason: for the new state; None if it was refused.
        refusal: why it was refused; None if it was taken.
    """

    command: Command
    reason: Reason | None
    refusal: KinematicsError | None = None


class CommandQueue:
    """Commands for an engine: a target and limits at most that wait, and one that is planned.

    A command that is refused, or is given up for a newer one, ends here.

    Attributes:
        present: for when the present setpoint is [s].
        behind: by how much it was ahead of the time of the engine when that got a command [s].
    """

    def __init__(
        self, engine: MotionEngine, period: float, streams: Streams, newest_target: NewestTarget
    ) -> None:
        """Hold nothing yet.

        Args:
            engine: that carries them out.
            period: time of one cycle [s].
            streams: are told which of their commands are carried out.
            newest_target: that the engine has taken, and that a newer one ends.
        """
        self.present = 0.0
        self._engine = engine
        self._period = period
        self._streams = streams
        self._newest_target = newest_target
        self._now = 0.0
        self._inbox = Inbox(period)
        self._limits = DriveLimits(engine.limits, *engine.scales)
        self._cycle = 0
        self._rests_first = False
        self._begun: Command | None = None
        self.behind = 0.0
        # Makes the path that is begun, until the engine gets it.
        self._making: Interruptible[None] | None = None
        self._extensions: deque[Command] = deque()
        # Those that waited behind a path that was refused.
        self._orphans: frozenset[Command] = frozenset()
        # Since which cycle there is a newer command than these.
        self._overtaken: dict[Command, int] = {}

    @property
    def target(self) -> Command | None:
        """The newest target that waits, or is being planned."""
        if self._extensions:
            return self._extensions[-1]
        return self._inbox.waiting.get(Kind.TARGET) or self._begun_target

    def next_cycle(self, now: float) -> None:
        """Begin a new cycle ``now`` [s]."""
        self._cycle += 1
        self._now = now
        if self._overtaken:
            self._end_overtaken()

    def rest_first(self) -> None:
        """Carry out nothing before the next setpoint, which so is one of rest."""
        self._rests_first = True

    def put(self, target: Command) -> None:
        """Let a ``target`` wait: in place of older ones, or behind them if it extends a path."""
        if target.extends:
            self._extensions.append(target)
            return
        replaced = self._inbox.put(target)
        self._supersede(*self._extensions, *(() if replaced is None else (replaced,)))
        self._extensions.clear()
        for older in (*self._newest_target.driven, self._begun_target):
            if older is not None and older.outcome is None:
                self._overtaken.setdefault(older, self._cycle)

    def end_waiting(self, code: GoalCode, text: str) -> None:
        """Note how the targets end that wait or are being planned."""
        for target in (*self._extensions, self._inbox.waiting.get(Kind.TARGET), self._begun_target):
            if target is not None:
                target.end(code, text)

    def drop_target(self, code: GoalCode, text: str) -> Command | None:
        """Forget the targets that wait or are being planned; return the newest.

        Args:
            code: how they end.
            text: that in words.
        """
        target = self.target
        self.end_waiting(code, text)
        self._extensions.clear()
        self._inbox.drop(Kind.TARGET)
        if self._begun is None or self._begun.is_target:
            self._give_up_begun()
        return target

    def withdraw(self, target: Command) -> bool:
        """Forget this very ``target`` if it waits or is being planned; return whether it did."""
        if target in self._extensions:
            self._extensions.remove(target)
        elif target is self._inbox.waiting.get(Kind.TARGET):
            self._inbox.drop(Kind.TARGET)
        elif target is self._begun:
            self._give_up_begun()
        else:
            return False
        return True

    def drop_stream(self, command: Command) -> None:
        """Forget the newest target, if it is of the stream of a ``command`` that ends it."""
        target = self.target
        if target is not None and target.kind is command.kind:
            self.drop_target(GoalCode.CANCELED, f"ended by {command}")

    def stop(self) -> None:
        """Let the engine come to rest; a place or path that waits, or is planned, waits on."""
        dropped = [*self._extensions]
        self._extensions.clear()
        begun = self._begun_target
        if begun is not None:
            self._begun = self._making = None
            if begun.waits_on and self._inbox.waiting.get(Kind.TARGET) is None:
                self._inbox.put(begun)
            else:
                dropped.append(begun)
        self._supersede(*dropped)
        self._engine.stop()

    def put_limits(self, limits: SliderLimits, *scales: float) -> None:
        """Let limits wait, in place of older ones, unless they are the newest already."""
        new = DriveLimits(limits, *scales)
        if new != self._limits:
            self._limits = new
            self._inbox.put(NewLimits(new))

    def carry_out(
        self, moving: bool, may_go_on: Callable[[], bool] | None = None
    ) -> Decided | None:
        """Carry out the command whose turn it is; return one that was taken or refused.

        Args:
            moving: whether the engine moves to a position: a jog without room does not end that.
            may_go_on: asked, after each piece of planning, for another one. None to plan nothing
                now, unless the engine plans within its commands.
        """
        if self._rests_first:
            return None
        refusal = None
        if (self._inbox.waiting or self._extensions) and not self._is_busy:
            in_each = self._engine.tracks or self._engine.phase is MotionPhase.IDLE
            command = self._inbox.take(self._cycle, in_each)
            if command is None and self._extensions and not self._inbox.waiting:
                command = self._extensions.popleft()
            if command is not None:
                refusal = self._begin(command)
        if may_go_on is not None:
            if self._making is not None:
                refusal = self._make(self._making, may_go_on) or refusal
            if self._making is None:
                self._engine.work(may_go_on)
        return None if self._begun is None else self.decided(moving, refusal)

    def decided(self, moving: bool, refusal: KinematicsError | None = None) -> Decided | None:
        """Return the command that the engine has taken or refused, if it has just done so.

        Args:
            moving: whether the engine moves to a position.
            refusal: why it was refused, if that is known already.
        """
        command = self._begun
        if command is None:
            return None
        # A path has been taken, and limits are in force, though the next part is planned already.
        engine = self._engine
        waits = engine.preparing_goal if command.is_target else engine.limits_pending
        is_planned = engine.preparing and waits
        if refusal is None and (self._making is not None or is_planned):
            return None
        self._begun = None
        refusal = refusal or self._engine.take_refusal()
        if refusal is not None:
            if moving or not command.ends_at_edge(refusal):
                command.end(GoalCode.REFUSED, str(refusal))
                if command.is_target:
                    self._orphans = frozenset(self._extensions)
                return Decided(command, None, refusal)
            # A move goes on. A jog comes to rest, as its direction is not wanted any more.
            self._engine.stop()
        return Decided(command, self._reason(command, refusal)) if command.is_target else None

    def step(self) -> SliderState:
        """Advance the engine by a cycle, and return its setpoint."""
        self._rests_first = False
        self.present = self._now
        return self._engine.step(self._period)

    @property
    def _begun_target(self) -> Command | None:
        begun = self._begun
        return begun if begun is not None and begun.is_target else None

    @property
    def _is_busy(self) -> bool:
        """Whether the next command has to wait: one is begun, and its plan is not held yet.

        While a path is followed its next part is nearly always planned; that may be begun anew.
        The next step of tracking leads to the newest command anyway, and a plan that is sooner at
        the end of a line is given up for any command.
        """
        if self._making is not None:
            # A newer command takes the place of a path that is still put together.
            return self._inbox.waiting.get(Kind.TARGET) is None
        if not self._engine.preparing:
            return False
        engine = self._engine
        is_quick = engine.phase is MotionPhase.MOVING and not engine.preparing_goal
        looks_for_sooner = is_quick and not engine.limits_pending
        goes_on = engine.tracks or engine.phase is MotionPhase.FOLLOWING or looks_for_sooner
        return self._begun is not None or not goes_on

    def _give_up_begun(self) -> None:
        self._begun = self._making = None
        self._engine.keep_goal()

    def _begin(self, command: Command) -> KinematicsError | None:
        """Give a ``command`` to the engine; return why it refuses it, if that is known at once."""
        given_up = self._begun_target
        self._begun, self._making = command, None
        if given_up is not None:
            self._supersede(given_up)
        engine = self._engine
        try:
            if command in self._orphans:
                raise CommandRefusedError(NO_PATH_BEFORE, Refusal.NO_PATH)
            if command.extends and engine.driven_path is None:
                raise CommandRefusedError(NO_PATH_ANY_MORE, Refusal.NO_PATH)
            self._making = command.making(engine.target if command.extends else None)
            if self._making is None:
                following = self._now + (self._period if self._now == self.present else 0.0)
                command.has_turn(following, self._period, self.present)
                self.behind = self.present - engine.elapsed
                engine.carry_out(command)
        except KinematicsError as error:
            return error
        return None

    def _make(
        self, making: Interruptible[None], may_go_on: Callable[[], bool]
    ) -> KinematicsError | None:
        """Go on with the path that is begun by one piece at least, and while ``may_go_on``.

        Returns:
            Why the path is refused, if it is.
        """
        assert self._begun is not None
        try:
            for _ in making:
                if not may_go_on():
                    return None
            self._making = None
        except KinematicsError as error:
            self._making = None
            return error
        except Exception as error:
            # It is made of what somebody has sent: no bytes end more than their own command.
            self._making = None
            text = f"there is no path: {type(error).__name__}: {error}"
            return CommandRefusedError(text, Refusal.MESSAGE)
        try:
            self._engine.carry_out(self._begun)
        except KinematicsError as error:
            return error
        return None

    def _reason(self, command: Command, refusal: KinematicsError | None) -> Reason:
        """Return why the state changes with a ``command`` that is carried out.

        Args:
            command: that the engine has taken, or that is held at the edge.
            refusal: why it is held there, if the engine says so.
        """
        remark = ""
        stream = self._streams.of(command)
        if stream is not None:
            stream.accept(command.received)
            remark = "" if refusal is not None else stream.remark(command.pause)
        edge = refusal or command.edge(self._engine.check_position)
        if edge is not None:
            text = f"{command.motion_text}, held at the edge: {edge}{remark}"
            return Reason(Cause.EDGE, text)
        cause = Cause.SLOW_STREAM if remark else Cause.COMMAND
        return Reason(cause, f"{command.motion_text}{remark}")

    def _supersede(self, *commands: Command) -> None:
        """End ``commands`` that are given up for the newest one."""
        if commands:
            text = f"superseded by {self.target or self._newest_target.text}"
            for command in commands:
                command.end(GoalCode.SUPERSEDED, text)

    def _end_overtaken(self) -> None:
        """End commands for a newer one that came in some cycles ago, even if that is planned."""
        newest = self.target
        for command, cycle in [*self._overtaken.items()]:
            if newest is None or newest.extends or newest is command:
                del self._overtaken[command]
            elif self._cycle - cycle >= CYCLES_UNTIL_TOLD:
                del self._overtaken[command]
                if not command.is_cancelled:
                    self._supersede(command)
