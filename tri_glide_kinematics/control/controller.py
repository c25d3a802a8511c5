"""Decides what the motion engine is asked to do. Times are seconds of the caller's steady clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tri_glide_kinematics.control.commands import (
    EngineCommands,
    GoalCode,
    NewestTarget,
    Streams,
)
from tri_glide_kinematics.control.errors import CommandRefusedError
from tri_glide_kinematics.control.goal_commands import GoalCommands
from tri_glide_kinematics.control.in_position import Arrival, InPositionBounds
from tri_glide_kinematics.control.operating_state import (
    DISABLED,
    FAULT,
    IDLE,
    IN_MOTION,
    ON_THE_WAY,
    STOPPING,
    WAITING,
    StateMachine,
    at_rest,
)
from tri_glide_kinematics.control.operation import StartingPlace
from tri_glide_kinematics.control.reason import Cause, Reason
from tri_glide_kinematics.control.status import ControllerStatus
from tri_glide_kinematics.control.supervision import Supervisor
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.motion.engine import MotionEngine, MotionPhase
from tri_glide_kinematics.motion.trajectory import SliderState
from tri_glide_kinematics.vectors import Vector3

STARTED_DISABLED = Reason(Cause.STARTED_DISABLED, "started disabled")
NO_MEASUREMENT = Reason(Cause.NO_MEASUREMENT, "no measured slider heights yet")
MEASURED = Reason(Cause.MEASUREMENT, "measured slider heights received")
ENABLED = Reason(Cause.ENABLE_ASKED, "enabled by request")
DISABLED_BY_REQUEST = Reason(Cause.DISABLE_ASKED, "disabled by request")
STOP_ASKED = Reason(Cause.STOP_ASKED, "stop was asked for")
RAMP_NOT_OVER = "the ramp to a stop is not over yet"

# A target that is too far away is a fault, which ends all goals.
CODE_OF = {Arrival.REACHED: GoalCode.SUCCEEDED, Arrival.NOT_REACHED: GoalCode.NOT_REACHED}


class MotionController(GoalCommands):
    """A motion engine under supervision.

    While it leads, each cycle has a setpoint. It leads from the first usable measurement, or from
    ``enable``, until it is disabled or has ramped down in a fault; each time it starts from the
    measured heights. So while it does not lead, somebody may move the machine by hand.

    However it ends, short of a kill, it ends after a ramp: ``end`` brakes, ``fail`` does so if it
    can, and the held plan leads to rest in any case.
    """

    def __init__(
        self,
        engine: MotionEngine,
        supervisor: Supervisor,
        *,
        period: float,
        streams: Streams,
        in_position_bounds: InPositionBounds,
        start_disabled: bool,
        travel: tuple[Sequence[float], Sequence[float]],
        on_change: Callable[[ControllerStatus], None],
        on_refusal: Callable[[str, Refusal], None],
    ) -> None:
        """Wait for the machine, or to be enabled.

        Args:
            engine: not started yet.
            supervisor: of the measured heights.
            period: time of one cycle [s].
            streams: of what has to be renewed.
            in_position_bounds: when a target counts as reached.
            start_disabled: whether ``enable`` has to be called first.
            travel: lower and upper ends of the sliders' travel, each of shape (3,) [m].
            on_change: gets the first status, and each one with another state or reason.
            on_refusal: gets why a command that had waited is refused, in words and for programs.
        """
        first = (DISABLED, STARTED_DISABLED) if start_disabled else (WAITING, NO_MEASUREMENT)
        super().__init__(
            engine,
            EngineCommands(engine, period, streams, self._give_up),
            StateMachine(*first, lambda: on_change(self.status)),
            streams,
            NewestTarget(in_position_bounds),
            on_refusal,
        )
        self._supervisor = supervisor
        self._start = StartingPlace(supervisor, travel)
        self._commanded: Vector3 | None = None
        self._period = period
        self._has_ended = False
        on_change(self.status)

    def cycle(
        self, now: float, may_go_on: Callable[[], bool] | None = lambda: True
    ) -> SliderState | None:
        """Advance by one period and return the new setpoint; None while not leading.

        ``may_go_on`` is asked, after each piece of planning, for another one before the setpoint;
        without it, nothing is planned before that.

        Raises:
            Exception: if the held plan cannot be stepped, so that nothing is left to drive.
        """
        try:
            if self.failure is None:
                self._decide(now, may_go_on)
        except Exception as error:
            self.fail(error)
        if not self._leading:
            return None
        setpoint = self._step()
        self._commanded = setpoint.heights
        try:
            if self.failure is None:
                self._look_after(now)
        except Exception as error:
            self.fail(error)
        if self.failure is not None and self._engine.phase is MotionPhase.IDLE:
            self._end_leading()
        return setpoint

    def _decide(self, now: float, may_go_on: Callable[[], bool] | None) -> None:
        """Do what comes before the setpoint of a cycle."""
        self.streams.looked(now)
        self._commands.next_cycle(now)
        if not self._leading:
            return
        if self.state is not FAULT:
            silence = self._supervisor.cycle(now)
            if silence is not None:
                self._fault(silence)
            elif (stream := self._stream) and (silence := stream.silence(now)) is not None:
                self._brake(silence, asked_for=False)
        # In motion the setpoint comes first: a plan begins later anyway.
        self._take(
            lambda moving: self._commands.carry_out(
                moving, may_go_on if self._engine.phase is MotionPhase.IDLE else None
            )
        )

    def _step(self) -> SliderState:
        """Return the next setpoint, of the held plan alone if there is no other."""
        try:
            if self.failure is None:
                return self._commands.step()
        except Exception as error:
            self.fail(error)
        return self._engine.step(self._period)

    def _look_after(self, now: float) -> None:
        """Do what comes after the setpoint of a cycle."""
        self._commands.tell_refusal()
        # A plan that was ready begins with this setpoint.
        self._take(self._commands.taken)
        if self._engine.phase is MotionPhase.IDLE and self._commands.target is None:
            self._stand_still(now)
            if self._goals:
                self._goals.stand_still(self.newest_target.bounds, now)
        if self._goals:
            self._goals.look(self._is_current, self._newest_text, now)

    def measured(self, heights: Vector3, now: float, stamp: float = 0.0) -> None:
        """Take in measured heights [m]; the first usable ones end the waiting.

        ``stamp`` is the time of the measurement by the sender's clock, 0 if it has none [s].

        Raises:
            KinematicsError: if they are no place to start from, while this is waited for.
        """
        if not self._leading:
            self._supervisor.restart()
        reason = self._supervisor.measured(heights, self._commanded, now, stamp)
        self._start.measured(heights)
        if self._leading:
            if reason is not None:
                self._fault(reason)
                return
            if self.newest_target.is_judged:
                self.newest_target.measured(self._engine.distance_from_target(heights), now)
            if self._goals:
                self._goals.measured(self._supervisor.tracking_error, now)
        elif self.state is WAITING:
            if reason is not None:
                raise CommandRefusedError(reason.text, Refusal.NO_MEASUREMENT)
            if self._start.obstacle is None:
                self._lead(self._start.checked(now), MEASURED)

    @property
    def measured_heights(self) -> Vector3 | None:
        """Latest measured heights that are finite. Shape (3,) [m]; None before the first."""
        return self._start.heights

    @property
    def commanded_heights(self) -> Vector3:
        """Heights of the latest setpoint. Shape (3,) [m].

        Raises:
            NotStartedError: before the first start.
        """
        return self._engine.state.heights

    @property
    def remaining(self) -> float:
        """Time to the end of what was asked for; inf where it is not known [s]."""
        return self._engine.remaining

    def stop(self) -> str:
        """Ramp to a stop, and return what happens in words.

        Poses are refused until the sliders are at rest; streams until they have paused.
        """
        self.streams.need_release()
        dropped = self._commands.drop_target()
        self._goals.end_all(GoalCode.STOPPED, STOP_ASKED.text, but_cancelled=True)
        state, reason = self.state, self.reason
        if state is FAULT and self._leading:
            return f"ramping to a stop already: {state.value}: {reason}"
        if state not in IN_MOTION:
            return f"nothing moves: {state.value}" + (f"; dropped {dropped}" if dropped else "")
        if state is STOPPING:
            self._states.stop_was_asked_for = True
            return f"ramping to a stop already: {reason}"
        self._brake(STOP_ASKED)
        return f"ramping to a stop: was {state.value}, {reason}"

    def enable(self, now: float) -> str:
        """Lead the machine again, from where it is measured to be, and clear a fault.

        Returns:
            What happens in words.

        Raises:
            KinematicsError: with the reason, if that is not possible now.
        """
        if self.failure is not None:
            raise self.failure
        if self._has_ended:
            raise CommandRefusedError(self.reason.text, Refusal.STOPPING)
        state = self.state
        if state is STOPPING and self._states.after_stop is DISABLED:
            self._states.after_stop = IDLE
            return "stays enabled"
        if state not in (DISABLED, FAULT):
            return f"is enabled already: {state.value}"
        if self._leading:
            raise CommandRefusedError(RAMP_NOT_OVER, Refusal.STOPPING)
        self._lead(self._start.checked(now), ENABLED)
        return "enabled"

    def disable(self) -> str:
        """Ramp to a stop and lead the machine no more; return what happens in words.

        Raises:
            CommandRefusedError: while a fault still ramps to a stop.
        """
        self.streams.need_release()
        self._commands.drop_target()
        if self.state is FAULT and self._leading:
            raise CommandRefusedError(RAMP_NOT_OVER, Refusal.STOPPING)
        return self._disable(DISABLED_BY_REQUEST, GoalCode.DISABLED)

    def end(self, text: str) -> None:
        """Ramp to a stop and lead the machine no more, for good; again it changes nothing.

        Args:
            text: says why.
        """
        if self._has_ended or self.failure is not None:
            return
        self._has_ended = True
        self._commands.drop_target()
        if self.state is FAULT:
            self._goals.end_all(GoalCode.SHUTDOWN, text)
        else:
            self._disable(Reason(Cause.NODE_ENDS, text), GoalCode.SHUTDOWN)

    def _disable(self, reason: Reason, code: GoalCode) -> str:
        self._goals.end_all(code, reason.text)
        if self.state in IN_MOTION:
            self._brake(reason, then=DISABLED)
            return "ramping to a stop, then disabled"
        self._end_leading()
        self._states.change(DISABLED, reason)
        return "disabled"

    def set_obstacle(self, reason: Reason | None) -> None:
        """Lead no machine for a ``reason`` from outside: fault, or wait; None if there is none."""
        self._start.obstacle = reason
        if self.state is WAITING:
            self._states.change(WAITING, reason or NO_MEASUREMENT)
        elif reason is not None and self._leading:
            self._fault(reason)

    def _lead(self, heights: Vector3, reason: Reason) -> None:
        self._engine.start(heights)
        # So that whoever listens gets the place from which the machine sets off.
        self._commands.rest_first()
        self._commanded = heights
        self._leading = True
        self._states.change(IDLE, reason)

    def _end_leading(self) -> None:
        self._leading = False
        self._commanded = None
        self.newest_target.end()

    def _fault(self, reason: Reason) -> None:
        if self.state is not FAULT:
            self.streams.need_release()
            self._commands.drop_target()
            self._goals.end_all(GoalCode.FAULT, reason.text)
            self._states.change(FAULT, reason)
            self._come_to_rest()

    def _stand_still(self, now: float) -> None:
        """Go on from the present state, as the setpoints stand still and no target waits."""
        states = self._states
        if states.state is FAULT:
            self._end_leading()
        elif states.state is STOPPING:
            if states.after_stop is DISABLED:
                self._end_leading()
            states.stopped()
        elif states.state in ON_THE_WAY and self._engine.target is None:
            # Its way was found to be blocked when it was its turn, which has been told.
            refused = Reason(Cause.TARGET_REFUSED, f"{states.reason} was refused")
            self._end_driven(GoalCode.REFUSED, refused.text)
            states.change(IDLE, at_rest(refused))
        elif states.state in ON_THE_WAY and not self.newest_target.is_judged:
            self.newest_target.judge_from(now)
        else:
            arrival, reason = self.newest_target.arrival(now)
            if reason is None:
                return
            if arrival in CODE_OF:
                self._end_driven(CODE_OF[arrival], reason.text)
            if arrival is Arrival.TOO_FAR:
                self._fault(reason)
            elif arrival is Arrival.REACHED or states.state in ON_THE_WAY:
                states.change(IDLE, at_rest(reason))
