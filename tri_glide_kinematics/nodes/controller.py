"""Decides what the motion engine is asked to do: state, supervision and watchdog. No ROS in here.

Times are seconds of a steady clock, given by the caller.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.limits import SliderLimits
from tri_glide_kinematics.motion import MotionEngine, MotionPhase, SliderState
from tri_glide_kinematics.nodes.operating_state import (
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
from tri_glide_kinematics.nodes.supervision import Supervisor

Vector3 = tuple[float, float, float]

NO_VELOCITY: Vector3 = (0.0, 0.0, 0.0)

# Encoders of sliders at their end stops may read a little beyond the travel [m].
TRAVEL_TOLERANCE = 1e-3

# States that do not end by coming to rest: a jog may rest at the edge of the workspace.
STAYING = frozenset((IDLE, JOGGING))


class CommandRefusedError(KinematicsError):
    """A command that does not fit the present state."""


class MotionController:
    """A motion engine under supervision.

    While it leads, each cycle has a setpoint. It leads from the first usable measurement, or from
    ``enable``, until it is disabled or has ramped down in a fault; each time it starts from the
    measured heights. So while it does not lead, somebody may move the machine by hand.
    """

    def __init__(
        self,
        engine: MotionEngine,
        supervisor: Supervisor,
        *,
        period: float,
        twist_timeout: float,
        start_disabled: bool,
        travel: tuple[Sequence[float], Sequence[float]],
        on_change: Callable[[OperatingState, str], None],
        on_refusal: Callable[[str], None],
    ) -> None:
        """Wait for the machine, or to be enabled.

        Args:
            engine: not started yet.
            supervisor: of the measured heights.
            period: time of one cycle [s].
            twist_timeout: longest time between two twists of a jog [s].
            start_disabled: whether ``enable`` has to be called first.
            travel: lower and upper ends of the sliders' travel, each of shape (3,) [m].
            on_change: gets each state with its reason.
            on_refusal: gets the reason why a command that had to wait is not carried out after all.
        """
        self._engine = engine
        self._supervisor = supervisor
        self._period = period
        self.twist_timeout = twist_timeout
        if start_disabled:
            first, reason = DISABLED, "started disabled"
        else:
            first, reason = WAITING, "no measured slider heights yet"
        self._machine = StateMachine(first, reason, on_change)
        self._travel = travel
        self._on_refusal = on_refusal
        self._limits = (engine.limits, engine.speed_scale)
        self._leading = False
        self._commanded: Vector3 | None = None
        self._measured: Vector3 | None = None
        self._after_stop = IDLE
        self._stop_was_asked_for = False
        self._jog_needs_release = False
        self._twist_received = -math.inf
        self._twist_accepted = -math.inf

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
        if not self._leading:
            return None
        machine = self._machine
        if machine.state is not FAULT:
            silence = self._supervisor.cycle(now)
            if silence is not None:
                self._fault(silence)
            elif machine.state is JOGGING and now - self._twist_accepted > self.twist_timeout:
                self._end_jog(f"no twist for {self.twist_timeout:g} s")
        setpoint = self._engine.step(self._period)
        self._commanded = setpoint.heights
        refusal = self._engine.take_refusal()
        if refusal is not None:
            self._on_refusal(str(refusal))
        if machine.state not in STAYING and self._engine.phase is MotionPhase.IDLE:
            self._come_to_rest()
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
        if not self._leading:
            self._measured = heights if reason is None else None
            if self._machine.state is WAITING:
                if reason is not None:
                    raise CommandRefusedError(reason)
                self._check_travel(heights)
                self._lead(heights, "measured slider heights received")
        elif reason is not None:
            self._fault(reason)

    def move_to(self, position: Vector3) -> None:
        """Move the platform to ``position`` [m].

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        self._check_accepting()
        self._engine.move_to(position)
        x, y, z = position
        self._machine.change(MOVING, f"target ({x:.6g}, {y:.6g}, {z:.6g}) m")

    def jog(self, velocity: Vector3, now: float) -> None:
        """Move the platform with ``velocity`` [m/s] until the next twist or the timeout.

        No velocity at all is a released stick: it ends a jog, and nothing else.

        Raises:
            KinematicsError: with the reason, if it is refused; what went on goes on.
        """
        pause, self._twist_received = now - self._twist_received, now
        released = velocity == NO_VELOCITY
        if released or pause > self.twist_timeout:
            self._jog_needs_release = False
        if released:
            if self._machine.state is JOGGING:
                self._end_jog("twist of zero")
            return
        self._check_accepting()
        if self._jog_needs_release:
            raise CommandRefusedError(
                "jogging was stopped: it needs a twist of zero or a pause of "
                f"{self.twist_timeout:g} s before it goes on"
            )
        self._engine.jog(velocity)
        self._twist_accepted = now
        x, y, z = velocity
        self._machine.change(JOGGING, f"twist ({x:.6g}, {y:.6g}, {z:.6g}) m/s")

    def stop(self) -> str:
        """Ramp to a stop, and return what happens in words.

        Poses are refused until the sliders are at rest; twists until their stream has paused.
        """
        self._jog_needs_release = True
        if self._machine.state not in IN_MOTION:
            return f"nothing moves: {self._machine.state.value}"
        if self._machine.state is not STOPPING:
            self._after_stop = IDLE
        self._brake("stop was asked for")
        return "ramping to a stop"

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
        self._check_travel(self._measured)
        self._lead(self._measured, "enabled by request")
        return "enabled"

    def disable(self) -> str:
        """Ramp to a stop and lead the machine no more; return what happens in words.

        Raises:
            CommandRefusedError: while a fault still ramps to a stop.
        """
        self._jog_needs_release = True
        state = self._machine.state
        if state in IN_MOTION:
            self._after_stop = DISABLED
            self._brake("disabled by request")
            return "ramping to a stop, then disabled"
        if state is FAULT and self._leading:
            raise CommandRefusedError("the ramp to a stop is not over yet")
        self._end_leading()
        self._machine.change(DISABLED, "disabled by request")
        return "disabled"

    def set_limits(self, limits: SliderLimits, speed_scale: float) -> None:
        """Change the limits; a motion that is too fast for them slows down first."""
        # The engine makes a new plan for each change.
        if (limits, speed_scale) == self._limits:
            return
        self._limits = (limits, speed_scale)
        self._engine.set_limits(limits)
        self._engine.set_speed_scale(speed_scale)

    def _lead(self, heights: Vector3, reason: str) -> None:
        self._engine.start(heights)
        self._commanded = heights
        self._leading = True
        self._machine.change(IDLE, reason)

    def _end_leading(self) -> None:
        self._leading = False
        self._commanded = None
        self._measured = None

    def _fault(self, reason: str) -> None:
        if self._machine.state is FAULT:
            return
        self._jog_needs_release = True
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

    def _come_to_rest(self) -> None:
        machine = self._machine
        if machine.state is FAULT:
            self._end_leading()
        elif machine.state is STOPPING:
            if self._after_stop is DISABLED:
                self._end_leading()
            machine.change(self._after_stop, f"at rest: {machine.reason}")
        else:
            machine.change(IDLE, f"at rest: {machine.reason}")

    def _check_travel(self, heights: Vector3) -> None:
        for slider, (lower, height, upper) in enumerate(
            zip(self._travel[0], heights, self._travel[1])
        ):
            if not lower - TRAVEL_TOLERANCE <= height <= upper + TRAVEL_TOLERANCE:
                raise CommandRefusedError(
                    f"slider {slider + 1} is measured at {height:.6g} m, outside its travel from "
                    f"{lower:.6g} to {upper:.6g} m"
                )

    def _check_accepting(self) -> None:
        state = self._machine.state
        if state in (WAITING, FAULT, DISABLED):
            raise CommandRefusedError(f"no motion while {state.value}: {self._machine.reason}")
        if state is STOPPING and self._stop_was_asked_for:
            raise CommandRefusedError(f"no motion before the stop is over: {self._machine.reason}")
