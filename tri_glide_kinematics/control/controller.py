"""Decides what the motion engine is asked to do. Times are seconds of the caller's steady clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from tri_glide_kinematics.control.command_queue import CommandQueue
from tri_glide_kinematics.control.commanded_motion import CommandedMotion
from tri_glide_kinematics.control.newest_target import Arrival, InPositionBounds, NewestTarget
from tri_glide_kinematics.control.operating_state import (
    DISABLED,
    FAULT,
    IDLE,
    JOGGING,
    ON_THE_WAY,
    STOPPING,
    TRACKING,
    WAITING,
    Cause,
    CommandRefusedError,
    ControllerStatus,
    MotionProgress,
    OperatingState,
    Reason,
    StateMachine,
    at_rest,
)
from tri_glide_kinematics.control.operation import (
    NO_MEASUREMENT,
    BrokenError,
    Operation,
    StartingPlace,
)
from tri_glide_kinematics.control.supervision import Streams, Supervisor
from tri_glide_kinematics.control.underway import Underway
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.motion.engine import (
    GoalCode,
    MotionEngine,
    MotionPhase,
    PathProgress,
    TransferProgress,
)
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.vectors import Vector3

STARTED_DISABLED = Reason(Cause.STARTED_DISABLED, "started disabled")

# The setpoint is at a place if it is nearer than rounding [m].
NOT_APART = 1e-12

# A target that is too far away is a fault, which ends all goals.
CODE_OF = {Arrival.REACHED: GoalCode.SUCCEEDED, Arrival.NOT_REACHED: GoalCode.NOT_REACHED}


class MotionController:
    """A motion engine under supervision.

    While it leads, each cycle has a setpoint. It leads from the first usable measurement, or from
    ``enable``, until it is disabled or has ramped down in a fault; each time it starts from the
    measured heights. So while it does not lead, somebody may move the machine by hand.

    It is made of parts, and what may be asked of a part is asked of it as if it were one object.

    Attributes:
        streams: of what has to be renewed; their timeouts can be changed.
        newest_target: when it counts as reached can be changed.
        passed_outputs: of the path, where the motors have just been; who tells them clears it.
        move_to, jog, track, follow, follow_pose, set_limits, set_teach_mode: motions, as
            ``CommandedMotion`` says.
        pursue, pursue_position, renew, pause, resume, cancel, leads_to: motions whose end somebody
            waits for, as ``CommandedMotion`` says.
        stop, enable, disable, end, set_obstacle, fail: as ``Operation`` says.
        check_free: as ``StartingPlace`` says.
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
        drive_delay: float = 0.0,
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
            drive_delay: from a setpoint to the motors [s].
        """
        first = (DISABLED, STARTED_DISABLED) if start_disabled else (WAITING, NO_MEASUREMENT)
        self.streams = streams
        self.newest_target = NewestTarget(in_position_bounds)
        self.passed_outputs: list[Any] = []
        self._engine = engine
        self._supervisor = supervisor
        self._period = period
        self._queue = CommandQueue(engine, period, streams, self.newest_target)
        self._states = StateMachine(*first, lambda: on_change(self.status))
        self._start = StartingPlace(supervisor, travel)
        parts = (engine, self._queue, self._states, streams, self.newest_target)
        self._underway = Underway(drive_delay)
        self._operation = operation = Operation(*parts, self._start, self._underway)
        self._motion = motion = CommandedMotion(*parts, operation, on_refusal)
        # The parts' own methods: each signature stands in one place.
        self.stop, self.enable, self.disable = operation.stop, operation.enable, operation.disable
        self.end, self.set_obstacle = operation.end, operation.set_obstacle
        self.check_free = self._start.check_free
        self.fail = operation.fail
        self.move_to, self.jog, self.track = motion.move_to, motion.jog, motion.track
        self.follow, self.set_limits = motion.follow, motion.set_limits
        self.follow_pose = motion.follow_pose
        self.set_teach_mode = motion.set_teach_mode
        self.pursue, self.pursue_position = motion.pursue, motion.pursue_position
        self.pause, self.resume = motion.pause, motion.resume
        self.renew = motion.renew
        self.cancel, self.leads_to = motion.cancel, motion.leads_to
        on_change(self.status)

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
            self.leads,
            self._engine.speed_scale,
            self._engine.path_speed_scale,
            self._engine.shaper_pending,
            self._motion.is_teaching,
            self._engine.limits.platform_speed,
            self._operation.stops,
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
        return self._operation.leads

    @property
    def rests(self) -> bool:
        """Whether setpoints and motors stand still, or there are no setpoints."""
        is_idle = self._engine.phase is MotionPhase.IDLE
        return not self.leads or (is_idle and not self._underway.moves)

    @property
    def failure(self) -> BrokenError | None:
        """What is broken in here; None as long as nothing is."""
        return self._operation.failure

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

    @property
    def path_progress(self) -> PathProgress | None:
        """How far the path is driven that is followed, or was followed last.

        None without one, and until its length is known.
        """
        return self._engine.path_progress

    @property
    def drive_delay(self) -> float:
        """From a setpoint to the motors [s]."""
        return self._underway.delay

    @property
    def transfer_progress(self) -> TransferProgress | None:
        """How far the transfer is that is carried out; None without one."""
        return self._engine.transfer_progress

    @property
    def progress(self) -> MotionProgress:
        """Where the setpoints are, and what is left of the motion."""
        engine = self._engine
        if not self.leads:
            return MotionProgress()
        position, velocity = engine.platform
        here = position, math.hypot(*velocity)
        if engine.phase is MotionPhase.IDLE:
            return MotionProgress(*here, 0, 0.0, 0.0)
        if engine.driven_path is not None:
            path = engine.path_progress
            if path is None:
                return MotionProgress(*here)
            way = max(path.way_remaining, 0.0)
            return MotionProgress(*here, path.segment, way, path.time_remaining)
        if engine.target is None:
            return MotionProgress(*here)
        way, time = math.dist(position, engine.target), engine.remaining
        return MotionProgress(*here, 0, way, time if math.isfinite(time) else math.nan)

    @property
    def shaper_duration(self) -> float:
        """How much longer the shaper in force makes a motion; 0 without one [s]."""
        shaper = self._engine.shaper
        return 0.0 if shaper is None else shaper.duration

    @property
    def tracking_distance(self) -> float:
        """How far the setpoint is from a moving target that is followed; NaN without one [m]."""
        return self._engine.tracking_distance

    def cycle(
        self, now: float, may_go_on: Callable[[], bool] | None = lambda: True
    ) -> SliderState | None:
        """Advance by one period and return the new setpoint; None while not leading.

        ``may_go_on`` is asked, after each piece of planning, for another one before the setpoint;
        without it, nothing is planned before that.

        Raises:
            Exception: if the held plan cannot be stepped, so that nothing is left to drive.
        """
        operation = self._operation
        try:
            if operation.failure is None:
                self._decide(now, may_go_on)
        except Exception as error:
            operation.fail(error)
        if not operation.leads:
            return None
        setpoint = self._step()
        try:
            self._underway.send(setpoint.heights, now)
            if operation.failure is None:
                self._look_after(now)
        except Exception as error:
            operation.fail(error)
        if operation.failure is not None and self._engine.phase is MotionPhase.IDLE:
            operation.end_lead()
        return setpoint

    def plan(self, may_go_on: Callable[[], bool]) -> None:
        """Go on with the planning of commands: by a piece at least, and while ``may_go_on``."""
        if self._operation.leads:
            self._motion.go_on(may_go_on)

    def measured(self, heights: Vector3, now: float, stamp: float = 0.0) -> None:
        """Take in measured heights [m]; the first usable ones end the waiting.

        ``stamp`` is the time of the measurement by the sender's clock, 0 if it has none [s].

        Raises:
            KinematicsError: if they are no place to start from, while this is waited for.
        """
        operation = self._operation
        if not operation.leads:
            self._supervisor.restart()
        reason = self._supervisor.measured(heights, self._underway.at_motors(now), now, stamp)
        self._start.measured(heights)
        if operation.leads:
            if reason is not None:
                operation.fault(reason)
                return
            if self.newest_target.is_judged:
                self.newest_target.measured(self._engine.distance_from_target(heights), now)
            if self.newest_target.cancelled:
                self.newest_target.rest_measured(self._supervisor.tracking_error, now)
        elif self._states.state is WAITING:
            if reason is not None:
                raise CommandRefusedError(reason.text, Refusal.NO_MEASUREMENT)
            operation.begin(now)

    def _decide(self, now: float, may_go_on: Callable[[], bool] | None) -> None:
        """Do what comes before the setpoint of a cycle."""
        self.streams.looked(now)
        self._queue.next_cycle(now)
        if not self._operation.leads:
            return
        state = self._states.state
        if state is not FAULT:
            silence = self._supervisor.cycle(now)
            if silence is not None:
                self._operation.fault(silence)
            elif state is JOGGING or state is TRACKING:
                self._motion.end_poses(now)
                stream = self.streams.twists if state is JOGGING else self.streams.targets
                silence = stream.silence(now)
                if silence is not None:
                    self._operation.brake(silence, asked_for=False)
        # In motion the setpoint comes first: a plan begins later anyway.
        self._motion.go_on(may_go_on if self._engine.phase is MotionPhase.IDLE else None)

    def _step(self) -> SliderState:
        """Return the next setpoint, of the held plan alone if there is no other."""
        try:
            if self._operation.failure is None:
                return self._queue.step()
        except Exception as error:
            self._operation.fail(error)
        return self._engine.step(self._period)

    def _look_after(self, now: float) -> None:
        """Do what comes after the setpoint of a cycle."""
        self._motion.look_after()
        if self.newest_target.outputs:
            self._pass_outputs()
        due = self.newest_target.due
        while due and due[0].instant <= now + 0.5 * self._period:
            self._underway.pass_output(due.popleft().output)
        if self._underway.outputs:
            self.passed_outputs += self._underway.passed_outputs()
        is_idle = self._engine.phase is MotionPhase.IDLE
        if is_idle and not self._underway.moves and self._queue.target is None:
            self._stand_still(now)
            if self.newest_target.cancelled:
                self.newest_target.come_to_rest(now)

    def _pass_outputs(self) -> None:
        """Note which outputs the setpoint has passed."""
        outputs, engine = self.newest_target.outputs, self._engine
        if engine.driven_path is None:
            # The path was given up. Where the platform does not get, nothing is told.
            outputs.clear()
        place = engine.path_place + NOT_APART
        while outputs and outputs[0][0] <= place:
            self._underway.pass_output(outputs.popleft()[1])

    def _stand_still(self, now: float) -> None:
        """Go on from the present state, as the setpoints stand still and no target waits."""
        states, target = self._states, self.newest_target
        if states.state is FAULT or states.state is STOPPING:
            self._operation.end_ramp()
        elif states.state in ON_THE_WAY and self._engine.target is None:
            # Its way was found to be blocked when it was its turn, which has been told.
            refused = Reason(Cause.TARGET_REFUSED, f"{states.reason} was refused")
            target.end_driven(GoalCode.REFUSED, refused.text)
            states.change(IDLE, at_rest(refused))
        elif states.state in ON_THE_WAY and not target.is_judged:
            target.judge_from(now)
        else:
            arrival, reason = target.arrival(now)
            if reason is None:
                return
            if arrival in CODE_OF:
                target.end_driven(CODE_OF[arrival], reason.text)
            if arrival is Arrival.TOO_FAR:
                self._operation.fault(reason)
            elif arrival is Arrival.REACHED or states.state in ON_THE_WAY:
                states.change(IDLE, at_rest(reason))
