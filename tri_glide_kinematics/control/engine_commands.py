"""Brings commands to the motion engine, each when it is its turn."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from tri_glide_kinematics.control.inbox import (
    Inbox,
    Kind,
    NewLimits,
    TargetPosition,
    TargetVelocity,
)
from tri_glide_kinematics.control.twists import TwistStream
from tri_glide_kinematics.motion.engine import MotionEngine, MotionPhase, SliderState
from tri_glide_kinematics.motion.errors import NoRoomError
from tri_glide_kinematics.motion.limits import SliderLimits


class CarriedOut(NamedTuple):
    """A target that the engine has taken.

    Attributes:
        target: where, or how, the platform is to move.
        reason: for the new state, in words.
        held_at_edge: whether it is a jog that stands still as it leads out of the workspace.
    """

    target: TargetPosition | TargetVelocity
    reason: str
    held_at_edge: bool = False


class EngineCommands:
    """The commands that wait for an engine: a target and limits at most."""

    def __init__(
        self,
        engine: MotionEngine,
        period: float,
        twists: TwistStream,
        on_refusal: Callable[[str], None],
    ) -> None:
        """Hold nothing yet.

        Args:
            engine: that carries them out.
            period: time of one cycle [s].
            twists: is told which of them are carried out.
            on_refusal: gets the reason why the engine did not carry out what it had to put off.
        """
        self._engine = engine
        self._period = period
        self._on_refusal = on_refusal
        self._twists = twists
        self._inbox = Inbox(period)
        self._limits = NewLimits(engine.limits, engine.speed_scale)
        self._cycle = 0

    @property
    def target(self) -> TargetPosition | TargetVelocity | None:
        """The target that waits."""
        waiting = self._inbox.peek(Kind.TARGET)
        return None if isinstance(waiting, NewLimits) else waiting

    def next_cycle(self) -> None:
        """Begin a new cycle."""
        self._cycle += 1

    def put(self, target: TargetPosition | TargetVelocity) -> None:
        """Let a ``target`` wait, in place of an older one."""
        self._inbox.put(Kind.TARGET, target)

    def drop_target(self) -> TargetPosition | TargetVelocity | None:
        """Forget, and return, the target that waits."""
        target = self.target
        self._inbox.drop(Kind.TARGET)
        return target

    def drop_twist(self) -> None:
        """Forget the target that waits, if it is a twist."""
        if isinstance(self.target, TargetVelocity):
            self.drop_target()

    def put_limits(self, limits: SliderLimits, speed_scale: float) -> None:
        """Let limits wait, in place of older ones, unless they are the newest already."""
        new = NewLimits(limits, speed_scale)
        if new != self._limits:
            self._limits = new
            self._inbox.put(Kind.LIMITS, new)

    def carry_out(self, moving: bool) -> CarriedOut | None:
        """Carry out the command whose turn it is; return a target that was taken.

        Args:
            moving: whether the engine moves to a position: a jog without room does not end that.

        Raises:
            KinematicsError: if the engine refuses the command.
        """
        command = self._inbox.take(self._cycle, self._engine.phase is MotionPhase.IDLE)
        if isinstance(command, NewLimits):
            self._engine.set_limits(command.sliders, command.speed_scale)
        elif isinstance(command, TargetPosition):
            self._engine.move_to(command.position)
            return CarriedOut(command, str(command))
        elif isinstance(command, TargetVelocity):
            return self._jog(command, moving)
        return None

    def step(self) -> SliderState:
        """Advance the engine by a cycle, and return its setpoint."""
        setpoint = self._engine.step(self._period)
        refusal = self._engine.take_refusal()
        if refusal is not None:
            self._on_refusal(str(refusal))
        return setpoint

    def _jog(self, twist: TargetVelocity, moving: bool) -> CarriedOut:
        try:
            self._engine.jog(twist.velocity)
        except NoRoomError as error:
            # A move goes on. A jog comes to rest, as its direction is not wanted any more.
            if moving:
                raise
            self._engine.stop()
            done = CarriedOut(twist, f"{twist}, held at the edge: {error}", held_at_edge=True)
        else:
            done = CarriedOut(twist, f"{twist}{self._twists.remark(twist.pause)}")
        self._twists.accept(twist.received)
        return done
