"""Decides what the motion engine is asked to do: state, supervision and watchdog. No ROS in here.

Times are seconds of a steady clock, given by the caller.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tri_glide_kinematics.control.in_position import Arrival, InPosition, InPositionBounds
from tri_glide_kinematics.control.inbox import (
    Command,
    Inbox,
    Kind,
    NewLimits,
    TargetPosition,
    TargetVelocity,
)
from tri_glide_kinematics.control.operating_state import (
    DISABLED,
    FAULT,
    IDLE,
    IN_MOTION,
    JOGGING,
    MOVING,
    STOPPING,
    WAITING,
    OperatingState,
    StateMachine,
)
from tri_glide_kinematics.control.supervision import Supervisor
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.commands import jog_of
from tri_glide_kinematics.motion.engine import MotionEngine, MotionPhase, SliderState
from tri_glide_kinematics.motion.errors import NoRoomError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text

# Encoders of sliders at their end stops may read a little beyond the travel [m].
TRAVEL_TOLERANCE = 1e-3

# Twists that come less often than this are commands of a person, not a stream [s].
SLOWEST_STREAM = 1.0

NO_MEASUREMENT = "no measured slider heights yet"


class CommandRefusedError(KinematicsError):
    """A command that does not fit the present state."""


@dataclass(frozen=True)
class ControllerStatus:
    """What the controller does and why.

    Attributes:
        state: what it is doing.
        reason: why it is doing that.
        newest_target: the newest target that was accepted, in words; empty before the first.
        target_missed: whether the machine rests and is not measured at its target.
        held_at_edge: whether a jog rests as its twist leads out of the workspace.
    """

    state: OperatingState
    reason: str
    newest_target: str
    target_missed: bool
    held_at_edge: bool


class MotionController:
    """A motion engine under supervision.

    While it leads, each cycle has a setpoint. It leads from the first usable measurement, or from
    ``enable``, until it is disabled or has ramped down in a fault; each time it starts from the
    measured heights. So while it does not lead, somebody may move the machine by hand.

    Attributes:
        twist_timeout: longest time between two twists of a jog [s].
        in_position_bounds: when a target counts as reached.
    """

    def __init__(
        self,
        engine: MotionEngine,
        supervisor: Supervisor,
        *,
        period: float,
        twist_timeout: float,
        in_position_bounds: InPositionBounds,
        start_disabled: bool,
        travel: tuple[Sequence[float], Sequence[float]],
        on_change: Callable[[ControllerStatus], None],
        on_refusal: Callable[[str], None],
    ) -> None:
        """Wait for the machine, or to be enabled.

        Args:
            engine: not started yet.
            supervisor: of the measured heights.
            period: time of one cycle [s].
            twist_timeout: longest time between two twists of a jog [s].
            in_position_bounds: when a target counts as reached.
            start_disabled: whether ``enable`` has to be called first.
            travel: lower and upper ends of the sliders' travel, each of shape (3,) [m].
            on_change: gets the first status, and each one with another state or reason.
            on_refusal: gets the reason why a command that had to wait is not carried out after all.
        """
        self._engine = engine
        self._supervisor = supervisor
        self._period = period
        self.twist_timeout = twist_timeout
        self.in_position_bounds = in_position_bounds
        if start_disabled:
            first, reason = DISABLED, "started disabled"
        else:
            first, reason = WAITING, NO_MEASUREMENT
        self._machine = StateMachine(first, reason, lambda: on_change(self.status))
        self._travel = travel
        self._on_refusal = on_refusal
        self._inbox = Inbox(period)
        self._limits = NewLimits(engine.limits, engine.speed_scale)
        self._cycle = 0
        self._leading = False
        self._obstacle: str | None = None
        self._commanded: Vector3 | None = None
        self._measured: Vector3 | None = None
        self._in_position: InPosition | None = None
        self._after_stop = IDLE
        self._stop_was_asked_for = False
        self._jog_needs_release = False
        self._twist_received = -math.inf
        self._twist_accepted = -math.inf
        self._newest_target = ""
        self._target_missed = False
        self._held_at_edge = False
        on_change(self.status)

    @property
    def status(self) -> ControllerStatus:
        """State, reason and target."""
        return ControllerStatus(
            self._machine.state,
            self._machine.reason,
            self._newest_target,
            self._target_missed,
            self._held_at_edge,
        )

    @property
    def state(self) -> OperatingState:
        """What the controller is doing."""
        return self._machine.state

    @property
    def reason(self) -> str:
        """Why it is doing that."""
        return self._machine.reason

    def cycle(self, now: float) -> SliderState | None:
        """Advance by one period and return the new setpoint; None while not leading."""
        self._cycle += 1
        if not self._leading:
            return None
        machine = self._machine
        if machine.state is not FAULT:
            silence = self._supervisor.cycle(now)
            if silence is not None:
                self._fault(silence)
            elif machine.state is JOGGING and now - self._twist_accepted > self.twist_timeout:
                self._end_jog(f"no twist for {self.twist_timeout:g} s")
        try:
            self._take_turn()
        except KinematicsError as error:
            self._on_refusal(str(error))
        setpoint = self._engine.step(self._period)
        self._commanded = setpoint.heights
        refusal = self._engine.take_refusal()
        if refusal is not None:
            self._on_refusal(str(refusal))
        if self._engine.phase is MotionPhase.IDLE and self._inbox.peek(Kind.TARGET) is None:
            self._rest(now)
        return setpoint

    def measured(self, heights: Vector3, now: float, stamp: float = 0.0) -> None:
        """Take in measured heights [m]; the first usable ones end the waiting.

        ``stamp`` is the time of the measurement by the sender's clock, 0 if it has none [s].

        Raises:
            KinematicsError: if they are no place to start from, while this is waited for.
        """
        if not self._leading:
            self._supervisor.restart()
        reason = self._supervisor.measured(heights, self._commanded, now, stamp)
        self._measured = heights if all(map(math.isfinite, heights)) else None
        if not self._leading:
            if self._machine.state is WAITING:
                if reason is not None:
                    raise CommandRefusedError(reason)
                if self._obstacle is None:
                    self._check_travel(heights)
                    self._lead(heights, "measured slider heights received")
        elif reason is not None:
            self._fault(reason)
        elif self._in_position is not None:
            self._in_position.measured(self._engine.distance_from_target(heights), now)

    def move_to(self, position: Vector3) -> None:
        """Move the platform to ``position`` [m], at the latest when it is its turn.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        self._check_accepting()
        self._engine.check_position(position)
        self._inbox.put(Kind.TARGET, TargetPosition(position))
        self._take_turn()

    def jog(self, velocity: Vector3, now: float) -> None:
        """Move the platform with ``velocity`` [m/s] until the next twist or the timeout.

        No velocity at all is a released stick: it ends a jog, and nothing else.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        pause, self._twist_received = now - self._twist_received, now
        released = jog_of(velocity) is None
        if released or pause > self.twist_timeout:
            self._jog_needs_release = False
        if released:
            if isinstance(self._inbox.peek(Kind.TARGET), TargetVelocity):
                self._inbox.drop(Kind.TARGET)
            if self._machine.state is JOGGING:
                self._end_jog("twist of zero")
            return
        self._check_accepting()
        if self._jog_needs_release:
            raise CommandRefusedError(
                "jogging was stopped: it needs a twist of zero or a pause of "
                f"{self.twist_timeout:g} s before it goes on"
            )
        self._inbox.put(Kind.TARGET, TargetVelocity(velocity, now, pause))
        self._take_turn()

    def stop(self) -> str:
        """Ramp to a stop, and return what happens in words.

        Poses are refused until the sliders are at rest; twists until their stream has paused.
        """
        self._jog_needs_release = True
        dropped = self._inbox.drop(Kind.TARGET)
        state, reason = self._machine.state, self._machine.reason
        if state is FAULT and self._leading:
            return f"ramping to a stop already: {state.value}: {reason}"
        if state not in IN_MOTION:
            nothing = f"nothing moves: {state.value}"
            return nothing if dropped is None else f"{nothing}; dropped {dropped}"
        if state is STOPPING:
            self._stop_was_asked_for = True
            return f"ramping to a stop already: {reason}"
        self._after_stop = IDLE
        self._brake("stop was asked for")
        return f"ramping to a stop: was {state.value}, {reason}"

    def enable(self, now: float) -> str:
        """Lead the machine again, from where it is measured to be, and clear a fault.

        Returns:
            What happens in words.

        Raises:
            KinematicsError: with the reason, if that is not possible now.
        """
        state = self._machine.state
        if state is STOPPING and self._after_stop is DISABLED:
            self._after_stop = IDLE
            return "stays enabled"
        if state not in (DISABLED, FAULT):
            return f"is enabled already: {state.value}"
        if self._leading:
            raise CommandRefusedError("the ramp to a stop is not over yet")
        if self._measured is None or not self._supervisor.is_fresh(now):
            raise CommandRefusedError("there are no measured slider heights to start from")
        if self._obstacle is not None:
            raise CommandRefusedError(self._obstacle)
        self._check_travel(self._measured)
        self._lead(self._measured, "enabled by request")
        return "enabled"

    def disable(self) -> str:
        """Ramp to a stop and lead the machine no more; return what happens in words.

        Raises:
            CommandRefusedError: while a fault still ramps to a stop.
        """
        self._jog_needs_release = True
        self._inbox.drop(Kind.TARGET)
        if self._machine.state is FAULT and self._leading:
            raise CommandRefusedError("the ramp to a stop is not over yet")
        if self._machine.state in IN_MOTION:
            self._after_stop = DISABLED
            self._brake("disabled by request")
            return "ramping to a stop, then disabled"
        self._end_leading()
        self._machine.change(DISABLED, "disabled by request")
        return "disabled"

    def set_limits(self, limits: SliderLimits, speed_scale: float) -> None:
        """Change the limits when it is their turn; too fast a motion slows down first."""
        new = NewLimits(limits, speed_scale)
        if new == self._limits:
            return
        self._limits = new
        self._inbox.put(Kind.LIMITS, new)
        self._take_turn()

    def set_obstacle(self, reason: str | None) -> None:
        """Lead no machine for a ``reason`` from outside: fault, or wait; None if there is none."""
        self._obstacle = reason
        if self._machine.state is WAITING:
            self._machine.change(WAITING, reason or NO_MEASUREMENT)
        elif reason is not None and self._leading:
            self._fault(reason)

    def _take_turn(self) -> None:
        """Carry out the command whose turn it is, if there is one.

        Raises:
            KinematicsError: if it is refused.
        """
        resting = self._engine.phase is MotionPhase.IDLE
        command = self._inbox.take(self._cycle, resting)
        if isinstance(command, NewLimits):
            self._engine.set_limits(command.sliders, command.speed_scale)
        elif isinstance(command, TargetPosition):
            self._engine.move_to(command.position)
            self._accept(MOVING, command, str(command))
        elif isinstance(command, TargetVelocity):
            self._carry_out_jog(command)

    def _carry_out_jog(self, command: TargetVelocity) -> None:
        reason = str(command)
        if self.twist_timeout < command.pause < SLOWEST_STREAM:
            reason += (
                f", {number_text(command.pause, 2)} s after the last one: longer than "
                f"twist_timeout, {self.twist_timeout:g} s"
            )
        self._held_at_edge = False
        try:
            self._engine.jog(command.velocity)
        except NoRoomError as error:
            # A move goes on. A jog comes to rest, as its direction is not wanted any more.
            if self._machine.state is MOVING:
                raise
            self._engine.stop()
            self._held_at_edge = True
            reason = f"{command}, held at the edge: {error}"
        self._twist_accepted = command.received
        self._accept(JOGGING, command, reason)

    def _accept(self, state: OperatingState, command: Command, reason: str) -> None:
        self._in_position, self._target_missed = None, False
        self._newest_target = str(command)
        self._machine.change(state, reason)

    def _lead(self, heights: Vector3, reason: str) -> None:
        self._engine.start(heights)
        self._commanded = heights
        self._leading = True
        self._machine.change(IDLE, reason)

    def _end_leading(self) -> None:
        self._leading = False
        self._commanded = None
        self._in_position, self._target_missed = None, False

    def _fault(self, reason: str) -> None:
        if self._machine.state is FAULT:
            return
        self._jog_needs_release = True
        self._inbox.drop(Kind.TARGET)
        self._in_position = None
        self._engine.stop()
        self._machine.change(FAULT, reason)

    def _end_jog(self, reason: str) -> None:
        self._after_stop, self._stop_was_asked_for = IDLE, False
        self._engine.stop()
        self._machine.change(STOPPING, reason)

    def _brake(self, reason: str) -> None:
        self._engine.stop()
        self._stop_was_asked_for = True
        self._machine.change(STOPPING, reason)

    def _rest(self, now: float) -> None:
        """Go on from the present state, as the setpoints are at rest and nothing waits."""
        machine = self._machine
        if machine.state is FAULT:
            self._end_leading()
        elif machine.state is STOPPING:
            if self._after_stop is DISABLED:
                self._end_leading()
            machine.change(self._after_stop, f"at rest: {machine.reason}")
        elif machine.state is MOVING and self._engine.target is None:
            # Its way was found to be blocked when it was its turn, which has been told.
            machine.change(IDLE, f"at rest: {machine.reason} was refused")
        elif machine.state is MOVING and self._in_position is None:
            self._in_position = InPosition(self.in_position_bounds, now)
        elif self._in_position is not None:
            self._judge_arrival(self._in_position, now)

    def _judge_arrival(self, position: InPosition, now: float) -> None:
        """Say that the target is reached, is not, or is missed by far."""
        arrival = position.arrival(now)
        if arrival is Arrival.SETTLING:
            return
        machine, target = self._machine, self._newest_target
        away = f"measured {number_text(position.distance, 2)} m away"
        self._target_missed = arrival is not Arrival.REACHED
        if arrival is Arrival.REACHED:
            self._in_position = None
            machine.change(IDLE, f"at rest: {target} is reached, {away}")
        elif arrival is Arrival.TOO_FAR:
            limit = position.bounds.error_limit
            self._fault(f"{target} is not reached, {away}, more than {number_text(limit, 3)} m")
        elif machine.state is MOVING:
            # It is watched on: what holds the sliders back may give way.
            limit = position.bounds.tolerance
            text = f"{target} is NOT reached, {away}, more than {number_text(limit, 3)} m"
            machine.change(IDLE, f"at rest: {text}")

    def _check_travel(self, heights: Vector3) -> None:
        for slider, (lower, height, upper) in enumerate(
            zip(self._travel[0], heights, self._travel[1])
        ):
            if not lower - TRAVEL_TOLERANCE <= height <= upper + TRAVEL_TOLERANCE:
                raise CommandRefusedError(
                    f"slider {slider + 1} is measured at {number_text(height, 6)} m, outside its "
                    f"travel from {number_text(lower, 6)} to {number_text(upper, 6)} m"
                )

    def _check_accepting(self) -> None:
        state = self._machine.state
        if state in (WAITING, FAULT, DISABLED):
            raise CommandRefusedError(f"no motion while {state.value}: {self._machine.reason}")
        if state is STOPPING and self._stop_was_asked_for:
            raise CommandRefusedError(f"no motion before the stop is over: {self._machine.reason}")
