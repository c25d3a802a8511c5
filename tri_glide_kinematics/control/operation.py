"""Whether a machine is led: from where, until when, and how that ends."""

from __future__ import annotations

import math
import os
import traceback
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from tri_glide_kinematics.control.operating_state import (
    DISABLED,
    FAULT,
    IDLE,
    IN_MOTION,
    STOPPING,
    WAITING,
    Cause,
    CommandRefusedError,
    OperatingState,
    Reason,
    StateMachine,
)
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion.engine import GoalCode, MotionEngine
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text

if TYPE_CHECKING:
    from tri_glide_kinematics.control.command_queue import CommandQueue
    from tri_glide_kinematics.control.newest_target import NewestTarget
    from tri_glide_kinematics.control.supervision import Streams, Supervisor
    from tri_glide_kinematics.control.underway import Underway

NO_MEASUREMENT = Reason(Cause.NO_MEASUREMENT, "no measured slider heights yet")
MEASURED = Reason(Cause.MEASUREMENT, "measured slider heights received")
ENABLED = Reason(Cause.ENABLE_ASKED, "enabled by request")
DISABLED_BY_REQUEST = Reason(Cause.DISABLE_ASKED, "disabled by request")
STOP_ASKED = Reason(Cause.STOP_ASKED, "stop was asked for")
RAMP_NOT_OVER = "the ramp to a stop is not over yet"

# Encoders of sliders at their end stops may read a little beyond the travel [m].
TRAVEL_TOLERANCE = 1e-3


class BrokenError(KinematicsError):
    """Something in the program is wrong, so that it cannot go on."""

    refusal = Refusal.FAULT

    def __init__(self, cause: Exception) -> None:
        """Tell the ``cause``, and where it was raised."""
        places = traceback.extract_tb(cause.__traceback__)
        where = "".join(
            f" in {place.name} ({os.path.basename(place.filename)}, line {place.lineno})"
            for place in places[-1:]
        )
        super().__init__(f"the control cycle failed{where}: {type(cause).__name__}: {cause}")
        self.cause = cause


class StartingPlace:
    """The latest measured heights, and what keeps the machine from being led from there.

    Attributes:
        obstacle: reason from outside to lead no machine; None if there is none.
        heights: latest ones that are finite. Shape (3,) [m]; None before the first.
    """

    def __init__(
        self, supervisor: Supervisor, travel: tuple[Sequence[float], Sequence[float]]
    ) -> None:
        """Know no place yet.

        Args:
            supervisor: of the measured heights.
            travel: lower and upper ends of the sliders' travel, each of shape (3,) [m].
        """
        self.obstacle: Reason | None = None
        self._supervisor = supervisor
        self._travel = travel
        self.heights: Vector3 | None = None

    def measured(self, heights: Vector3) -> None:
        """Take in measured ``heights`` [m]."""
        self.heights = heights if all(map(math.isfinite, heights)) else None

    def check_free(self) -> None:
        """Check that there is no obstacle.

        Raises:
            CommandRefusedError: if there is one.
        """
        if self.obstacle is not None:
            raise CommandRefusedError(self.obstacle.text, Refusal.OTHER_PUBLISHER)

    def checked(self, now: float) -> Vector3:
        """Return the heights from which the machine can be led ``now`` [s]. Shape (3,) [m].

        Raises:
            CommandRefusedError: if there is no such place, or an obstacle.
        """
        if self.heights is None or not self._supervisor.is_fresh(now):
            text = "there are no measured slider heights to start from"
            raise CommandRefusedError(text, Refusal.NO_MEASUREMENT)
        self.check_free()
        for slider, (lower, height, upper) in enumerate(
            zip(self._travel[0], self.heights, self._travel[1])
        ):
            if not lower - TRAVEL_TOLERANCE <= height <= upper + TRAVEL_TOLERANCE:
                raise CommandRefusedError(
                    f"slider {slider + 1} is measured at {number_text(height, 6)} m, outside its "
                    f"travel from {number_text(lower, 6)} to {number_text(upper, 6)} m",
                    Refusal.OUTSIDE_TRAVEL,
                )
        return self.heights


class Operation:
    """Leads a machine: each cycle has a setpoint while it does.

    However it ends, short of a kill, it ends after a ramp: ``end`` brakes, ``fail`` does so if it
    can, and the held plan leads to rest in any case.

    Attributes:
        leads: whether there is a setpoint in each cycle.
        underway: setpoints on their way to the motors.
        failure: what is broken in here; None as long as nothing is.
        stops: how often a stop was asked for, a program was lost, the lead was taken away, or a
            fault came; also while nothing moved.
    """

    def __init__(
        self,
        engine: MotionEngine,
        queue: CommandQueue,
        states: StateMachine,
        streams: Streams,
        newest_target: NewestTarget,
        start: StartingPlace,
        underway: Underway,
    ) -> None:
        """Lead no machine yet.

        Args:
            engine: that moves it.
            queue: of commands for the engine.
            states: tell what is done.
            streams: need a release after a stop.
            newest_target: is judged no more when the lead ends.
            start: from where the machine can be led.
            underway: is empty while the machine is not led.
        """
        self.leads = False
        self.underway = underway
        self.failure: BrokenError | None = None
        self.stops = 0
        self._engine = engine
        self._queue = queue
        self._states = states
        self._streams = streams
        self._newest_target = newest_target
        self._start = start
        self._has_ended = False

    def begin(self, now: float) -> None:
        """Lead the machine from where it is measured ``now`` [s], if that is waited for.

        Raises:
            KinematicsError: if that is no place to start from.
        """
        if self._states.state is WAITING and self._start.obstacle is None:
            self._lead(now, MEASURED)

    def stop(self, why: Reason = STOP_ASKED) -> str:
        """Ramp to a stop, and return what happens in words.

        Poses are refused until the sliders are at rest; streams until they have paused.
        """
        self.stops += 1
        self._streams.need_release()
        dropped = self._queue.drop_target(GoalCode.STOPPED, why.text)
        self._newest_target.end_driven(GoalCode.STOPPED, why.text)
        state, reason = self._states.state, self._states.reason
        if state is FAULT and self.leads:
            return f"ramping to a stop already: {state.value}: {reason}"
        if state not in IN_MOTION:
            if state is IDLE and why is not STOP_ASKED:
                self._states.change(IDLE, why)
            return f"nothing moves: {state.value}" + (f"; dropped {dropped}" if dropped else "")
        if state is STOPPING:
            self._states.stop_was_asked_for = True
            return f"ramping to a stop already: {reason}"
        self.brake(why)
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
            raise CommandRefusedError(self._states.reason.text, Refusal.STOPPING)
        state = self._states.state
        if state is STOPPING and self._states.after_stop is DISABLED:
            self._states.after_stop = IDLE
            return "stays enabled"
        if state not in (DISABLED, FAULT):
            return f"is enabled already: {state.value}"
        if self.leads:
            raise CommandRefusedError(RAMP_NOT_OVER, Refusal.STOPPING)
        self._lead(now, ENABLED)
        return "enabled"

    def disable(self) -> str:
        """Ramp to a stop and lead the machine no more; return what happens in words.

        Raises:
            CommandRefusedError: while a fault still ramps to a stop.
        """
        self._streams.need_release()
        self._queue.drop_target(GoalCode.DISABLED, DISABLED_BY_REQUEST.text)
        if self._states.state is FAULT and self.leads:
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
        self._queue.drop_target(GoalCode.SHUTDOWN, text)
        if self._states.state is FAULT:
            self._end_all(GoalCode.SHUTDOWN, text)
        else:
            self._disable(Reason(Cause.NODE_ENDS, text), GoalCode.SHUTDOWN)

    def set_obstacle(self, reason: Reason | None) -> None:
        """Lead no machine for a ``reason`` from outside: fault, or wait; None if there is none."""
        self._start.obstacle = reason
        if self._states.state is WAITING:
            self._states.change(WAITING, reason or NO_MEASUREMENT)
        elif reason is not None and self.leads:
            self.fault(reason)

    def brake(self, reason: Reason, asked_for: bool = True, then: OperatingState = IDLE) -> None:
        """Ramp to a stop for a ``reason``, which may be one that somebody has ``asked_for``.

        Args:
            reason: for the new state.
            asked_for: whether the stop must not be cut short.
            then: the state that follows, idle or disabled.
        """
        self._states.stop(reason, asked_for=asked_for, then=then)
        # Goals have ended before, but the jog or moving target that is driven may not have.
        self._newest_target.end_driven(GoalCode.STOPPED, reason.text)
        self._come_to_rest()

    def fault(self, reason: Reason) -> None:
        """Ramp to a stop, as the machine does not do what it was told; again it changes nothing."""
        if self._states.state is not FAULT:
            self.stops += 1
            self._streams.need_release()
            self._queue.drop_target(GoalCode.FAULT, reason.text)
            self._end_all(GoalCode.FAULT, reason.text)
            self._states.change(FAULT, reason)
            self._come_to_rest()

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
            self.stops += 1
            self.failure = BrokenError(cause)
            with suppress(Exception):
                self._engine.stop()
            self._engine.keep_to_plan()
            text = str(self.failure)
            reason = Reason(Cause.PROGRAM_ERROR, text)
            self._states.change(FAULT if self.leads else self._states.state, reason)
            self._queue.end_waiting(GoalCode.FAULT, text)
            self._end_all(GoalCode.FAULT, text)
        return self.failure

    def end_ramp(self) -> None:
        """Go on after a ramp, as the setpoints stand still."""
        states = self._states
        if states.state is FAULT:
            self.end_lead()
        elif states.state is STOPPING:
            if states.after_stop is DISABLED:
                self.end_lead()
            states.stopped()

    def end_lead(self) -> None:
        """Lead the machine no more; it stands still."""
        self.leads = False
        self.underway.clear()
        self._newest_target.end()

    def _lead(self, now: float, reason: Reason) -> None:
        heights = self._start.checked(now)
        self._engine.start(heights)
        # So that whoever listens gets the place from which the machine sets off.
        self._queue.rest_first()
        self.underway.send(heights, now)
        self.leads = True
        self._states.change(IDLE, reason)

    def _disable(self, reason: Reason, code: GoalCode) -> str:
        self.stops += 1
        self._end_all(code, reason.text)
        if self._states.state in IN_MOTION:
            self.brake(reason, then=DISABLED)
            return "ramping to a stop, then disabled"
        self.end_lead()
        self._states.change(DISABLED, reason)
        return "disabled"

    def _end_all(self, code: GoalCode, text: str) -> None:
        """Note how all ended for which the machine moves, or comes to rest."""
        self._newest_target.end_driven(code, text)
        self._newest_target.end_cancelled(code, text)

    def _come_to_rest(self) -> None:
        """Let the engine brake; where that fails, the held plan leads to rest as well."""
        try:
            self._queue.stop()
        except Exception as error:
            self.fail(error)
