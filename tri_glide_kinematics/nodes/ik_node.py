"""Moves the machine: targets and measured joint states in, a stream of joint commands out."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from datetime import datetime
from functools import partial

from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import JointState

from tri_glide_interfaces.msg import Output, ProgramRun, StationState
from tri_glide_kinematics.control import (
    FAULT,
    FeedForward,
    Health,
    LoopStatistics,
    MotionController,
    ProgramRuns,
    Reason,
    Streams,
    Supervisor,
    ToldRun,
    health_of,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import MotionEngine, MotionPhase, Station
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.motion.moves import MotionKind
from tri_glide_kinematics.reason_log import ReasonLog, RefusalLog
from tri_glide_kinematics.recordings import FaultRecorder
from tri_glide_kinematics.ros.cdr import read_kinds_within_bytes
from tri_glide_kinematics.ros.inputs import (
    NODE_ENDS,
    MachineServices,
    MotionActions,
    SliderMeasurements,
    renewal_of,
)
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle, PlanningTime, steady_timer
from tri_glide_kinematics.ros.messages import (
    LATEST_OUTPUTS,
    age_of,
    age_of_target,
    has_stamp,
    moving_target,
    target_position,
    target_velocity,
    told_pose,
    told_state,
    told_twist,
)
from tri_glide_kinematics.ros.other_publishers import OtherPublishers, publisher_names
from tri_glide_kinematics.ros.outputs import (
    CommandOutputs,
    DiagnosticsPublisher,
    Markers,
    MotionStates,
    StateReports,
)
from tri_glide_kinematics.ros.serving import PatientServices
from tri_glide_kinematics.ros.starting import FatalError
from tri_glide_kinematics.settings import (
    IK_NODE,
    Values,
    check_joint_names,
    forces_of,
    in_position_bounds_of,
    machine_of,
    motion_limits_of,
    shaper_of,
    supervision_bounds_of,
    true_travel_of,
    workspace_limits_of,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace, places_inside

# Twists are renewed all the time: the latest one counts, and none is sent again after the
# connection was lost.
LATEST_ONLY = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=10)
# A path may be long.
LATEST_PATH = QoSProfile(depth=1)

# Period [s] of telling values that change all the time, as the twist of a joystick does.
STATUS_PERIOD = 0.1

# Planning may delay the setpoint by this part of a period: so from rest the first one that leads
# to a target comes in the same cycle, and none comes late.
PLANNING_PART = 0.3

# So long a newer motion of a station waits for the plan that is being made [s].
RENEWAL_WAITS = 0.05

# After this part of a period, further requests to the actions wait for the next cycle.
REQUESTS_PART = 0.5


class IkNode(Node):
    """Turns messages into calls of the controller, and its setpoints into messages."""

    def __init__(self) -> None:
        """Declare the parameters and wait for the machine.

        Raises:
            KinematicsError: if a parameter has a value that it cannot work with.
        """
        super().__init__("ik_node")
        self._made: tuple[TriGlide, FloatArray] | None = None
        parameters = LiveParameters(self, IK_NODE, self._check)
        values = parameters.values
        period = 1.0 / values["rate"]
        self._time_before_setpoint = PLANNING_PART * period
        self._time_for_requests = REQUESTS_PART * period
        self._planning = PlanningTime()
        self._renewal: tuple[int, Station, float] | None = None
        self._renewal_came = 0.0
        self._target_timeout = values["target_timeout"]
        self._tracking_latency = values["tracking_latency"]
        self._follow_poses = values["follow_poses"]
        self._base_frame = values["base_frame"]
        self._platform_frame = values["platform_frame"]
        check_joint_names(values)
        self._reader = SliderMeasurements(values["joint_names"], values["height_offsets"])
        self._refused = RefusalLog(self.get_logger().warning, lines_per_second=10)
        self._unusable = ReasonLog(self.get_logger().warning, lines_per_second=1)
        self._warnings = ReasonLog(self.get_logger().warning, lines_per_second=1)
        self._loop = LoopStatistics(period)
        self._reports = StateReports(self, self._refused, values["base_frame"])
        self._stream_topics: tuple[str, ...] = ()
        self._reliable_topics: tuple[str, ...] = ()
        self._outputs = CommandOutputs(self, values)
        self._motion_states = MotionStates(self, values)
        self._path_outputs = self.create_publisher(Output, "outputs", LATEST_OUTPUTS)
        self._supervisor = Supervisor(
            supervision_bounds_of(values),
            values["joint_names"],
            lambda: publisher_names(self, self._measured.topic_name),
        )
        machine, _ = self._machine_of(values)
        self._feed_forward = FeedForward(period, values["force_window"])
        self._feed_forward.forces = forces_of(values, machine)
        workspace = Workspace(machine, workspace_limits_of(values))
        self._engine = MotionEngine(
            workspace,
            motion_limits_of(values, machine, self._feed_forward.forces),
            kind=MotionKind[values["motion"].upper()],
            speed_scale=values["speed_scale"],
            path_speed_scale=values["path_speed_scale"],
            rapid_scale=values["rapid_scale"],
            in_pieces=True,
        )
        self._engine.set_shaper(shaper_of(values))
        self._engine.set_follow_horizon(values["follow_horizon"])
        self._controller = MotionController(
            self._engine,
            self._supervisor,
            period=period,
            streams=Streams.with_timeouts(values["twist_timeout"], values["target_timeout"]),
            in_position_bounds=in_position_bounds_of(values),
            start_disabled=values["start_disabled"] or bool(values["drives_enable"]),
            travel=true_travel_of(values),
            on_change=self._reports.add,
            on_refusal=lambda text, refusal: self._refused.refuse(
                f"refused a target: {text}", refusal
            ),
            drive_delay=values["drive_delay"],
        )
        self._reports.progress = lambda: self._controller.progress
        self._runs = ProgramRuns(values["program_timeout"])
        self._recorder = FaultRecorder(
            self.get_namespace(),
            period,
            values["height_offsets"],
            datetime.now,
            lambda text: self.get_logger().info(text),
            lambda text: self.get_logger().warning(text),
        )
        self._records = values["fault_recordings"]
        parameters.on_change(self._apply)
        self._others = OtherPublishers(self, self._outputs.publishers, self._on_others)
        self._requests = services = MachineServices(
            self,
            self._controller,
            self._reports,
            self._refused,
            lambda: self._on_others(self._others.look()),
            values["drives_enable"],
        )
        DiagnosticsPublisher(self, self._health)
        steady_timer(self, STATUS_PERIOD, self._tell_progress)
        poses = self.create_subscription(
            PoseStamped, "target_pose", self._on_pose, RELIABLE, raw=True
        )
        twists = self.create_subscription(
            TwistStamped, "target_twist", self._on_twist, LATEST_ONLY, raw=True
        )
        states = self.create_subscription(
            Odometry, "target_state", self._on_state, LATEST_ONLY, raw=True
        )
        paths = self.create_subscription(Path, "target_path", self._on_path, LATEST_PATH, raw=True)
        self._measured = self.create_subscription(
            JointState, "joint_states", self._on_measured, qos_profile_sensor_data, raw=True
        )
        read_kinds_within_bytes((ProgramRun,))
        runs = self.create_subscription(ProgramRun, "program_run", self._on_run, RELIABLE)
        stations = self.create_subscription(
            StationState, "station_state", self._on_station, LATEST_ONLY
        )
        self._stream_topics = (twists.topic_name, states.topic_name, stations.topic_name)
        self._reliable_topics = (poses.topic_name, paths.topic_name)
        urgent = (self._measured, poses, twists, states, stations, paths, runs, *services.urgent)
        # To read these, and to plan the way to a pose, takes time: it begins before the cycle.
        early = poses, twists, states
        self.cycle = Cycle(urgent, period, self._cycle, self._plan, early, self._may_end, self._end)
        Markers(self, workspace, self._base_frame, self._engine)
        patient = PatientServices(self, lambda: self._engine.phase is MotionPhase.IDLE)
        self._actions = MotionActions(
            self,
            self._controller,
            machine,
            self._base_frame,
            self._engine.kind,
            self._refused,
            patient,
            values["path_tolerance"],
        )

    def _cycle(self) -> None:
        """Send the next setpoint, and do what comes before and after.

        Raises:
            FatalError: if something in here is broken, once the setpoints are at rest.
        """
        now = time.monotonic()
        self._try(partial(self._look, now))
        setpoint = self._setpoint(now)
        self._try(partial(self._tell, now, setpoint))
        failure = self._controller.failure
        if failure is not None and not self._controller.leads:
            raise FatalError(str(failure)) from failure.cause

    def _look(self, now: float) -> None:
        delay = self._loop.cycle(now)
        if delay is not None:
            self._warnings.add(
                f"a cycle came {1000.0 * delay:.3g} ms late: no setpoint in that time"
            )
        lost = self._runs.lost(now)
        if lost is not None:
            self._warnings.add(lost.text)
            self._controller.stop(lost)
        self._actions.look()
        self._requests.look()
        self._renew(now)

    def _setpoint(self, now: float) -> SliderState | None:
        """Return the next setpoint, which is sent.

        Raises:
            FatalError: if the held plan cannot be driven to its end, either.
        """
        try:
            self._planning.next_cycle()
            until = now + self._time_before_setpoint
            planning = self._planning
            may_go_on = planning.until(until) if planning.is_short(until) else None
            setpoint = self._controller.cycle(now, may_go_on)
            if setpoint is not None:
                self._outputs.publish(setpoint, self._engine, self._feed_forward.of(setpoint))
            return setpoint
        except Exception as error:
            earlier = self._controller.failure
            failure = self._controller.fail(error)
            if earlier is not None:
                text = f"nothing can be sent any more: {type(error).__name__}: {error}"
                raise FatalError(f"{failure}; {text}") from error
            return None

    def _tell(self, now: float, setpoint: SliderState | None) -> None:
        if self._records:
            self._record(now, setpoint)
        outputs = self._controller.passed_outputs
        if not outputs and self._runs.safe_outputs and self._controller.rests:
            outputs = self._runs.safe_outputs
        if outputs:
            for output in outputs:
                self._path_outputs.publish(output)
            outputs.clear()
        self._reports.tell()
        self._actions.answer(now + self._time_for_requests)
        if self._motion_states.is_due():
            is_fresh = self._supervisor.is_fresh(now)
            measured = self._controller.measured_heights if is_fresh else None
            self._motion_states.publish(setpoint, measured)

    def _record(self, now: float, setpoint: SliderState | None) -> None:
        controller = self._controller
        if setpoint is not None:
            self._recorder.add(now, setpoint, controller.measured_heights)
        fault = controller.reason.text if controller.state is FAULT else None
        self._recorder.look(now, fault, leads=controller.leads)

    def _plan(self, until: float) -> None:
        """Use what is left of a cycle, ``until`` some time.monotonic(), to plan.

        A command that comes in the sleep is planned at once where that makes the next setpoint no
        later than planning may.
        """
        if not self._planning.may_begin(until + self._time_before_setpoint):
            return
        self._try(lambda: self._controller.plan(self._planning.until(until)))
        self._try(self._reports.tell)

    def _may_end(self) -> bool:
        """Bring the machine to rest, and return whether it is there."""
        self._try(lambda: self._controller.end(NODE_ENDS))
        return not self._controller.leads

    def _end(self) -> None:
        self._reports.tell()
        self._actions.end()
        self._reports.wait_until_read()

    def _try(self, call: Callable[[], None]) -> None:
        """Do a part of the cycle; if that fails, the held plan is driven to its end."""
        try:
            call()
        except Exception as error:
            self._controller.fail(error)

    def _on_measured(self, data: bytes) -> None:
        try:
            reading = self._reader.read(data)
            if reading is not None:
                self._controller.measured(reading.heights, time.monotonic(), reading.stamp)
        except KinematicsError as error:
            self._unusable.add(f"unusable measurement: {error}")

    def _on_pose(self, data: bytes) -> None:
        try:
            told = told_pose(data)
            position = target_position(told, self._base_frame)
            if not self._follow_poses:
                self._controller.move_to(position)
                return
            now, stamp = time.monotonic(), told.stamp
            age = 0.0
            if has_stamp(stamp):
                clock, timeout = self.get_clock(), self._target_timeout
                age = age_of_target(stamp, clock, timeout, "target pose")
            self._outputs.check_jogging()
            self._controller.follow_pose(position, now - age - self._tracking_latency, now)
        except KinematicsError as error:
            self._refused.refuse(f"refused a target pose: {error}", error.refusal)

    def _on_twist(self, data: bytes) -> None:
        now = time.monotonic()
        try:
            told = told_twist(data)
            velocity = target_velocity(told, self._base_frame, self._platform_frame)
            self._outputs.check_jogging()
            stamp = told.stamp
            age = age_of(stamp, self.get_clock()) if has_stamp(stamp) else math.nan
            self._controller.jog(velocity, now, age)
        except KinematicsError as error:
            self._refused.refuse(f"refused a target twist: {error}", error.refusal)

    def _on_state(self, data: bytes) -> None:
        now = time.monotonic()
        try:
            told = told_state(data)
            position, velocity = moving_target(told, self._base_frame)
            age = age_of_target(told.stamp, self.get_clock(), self._target_timeout)
            self._outputs.check_jogging()
            self._controller.track(position, velocity, now - age - self._tracking_latency, now)
        except KinematicsError as error:
            self._refused.refuse(f"refused a target state: {error}", error.refusal)

    def _on_station(self, message: StationState) -> None:
        try:
            self._renewal = renewal_of(message, self._base_frame, self.get_clock())
            self._renewal_came = time.monotonic()
        except KinematicsError as error:
            self._refused.refuse(f"refused a station state: {error}", error.refusal)

    def _renew(self, now: float) -> None:
        """Let a transfer meet its station as that moves now, as soon as this can be planned."""
        if self._renewal is not None:
            is_late = now > self._renewal_came + RENEWAL_WAITS
            if self._controller.renew(*self._renewal) or is_late:
                self._renewal = None

    def _on_run(self, message: ProgramRun) -> None:
        line = f", line {message.line}" if message.line else ""
        told = ToldRun(f"{message.file}{line}", message.safe_outputs)
        self._runs.tell(message.run, told, has_ended=message.state == ProgramRun.ENDED)

    def _on_path(self, data: bytes) -> None:
        try:
            self._actions.follow_points(data)
        except KinematicsError as error:
            self._refused.refuse(f"refused a target path: {error}", error.refusal)

    def _on_others(self, reason: Reason | None) -> None:
        self._controller.set_obstacle(reason)
        self._reports.tell()
        # Poses, the first of them, are a stream where they are followed; elsewhere each is a move,
        # whoever sends it.
        poses = self._reliable_topics[:1] if self._follow_poses else ()
        remarks = [
            f"{count} publishers of {topic}: the newest message wins"
            for topic in (*self._stream_topics, *poses)
            if (count := self.count_publishers(topic)) > 1
        ]
        remarks += [
            f"{name} is not heard: it publishes {topic} best effort, not reliably"
            for topic in self._reliable_topics
            for name in publisher_names(self, topic, ReliabilityPolicy.BEST_EFFORT)
        ]
        self._reports.remark = "; ".join(remarks)

    def _tell_progress(self) -> None:
        self._reports.publish(self._controller.status)
        self._actions.tell_progress()

    def _apply(self, values: Values) -> None:
        streams = self._controller.streams
        streams.twists.timeout = values["twist_timeout"]
        streams.targets.timeout = self._target_timeout = values["target_timeout"]
        self._runs.timeout = values["program_timeout"]
        self._tracking_latency = values["tracking_latency"]
        self._follow_poses = values["follow_poses"]
        self._engine.set_follow_horizon(values["follow_horizon"])
        self._actions.path_tolerance = values["path_tolerance"]
        self._controller.newest_target.bounds = in_position_bounds_of(values)
        self._supervisor.bounds = supervision_bounds_of(values)
        machine, _ = self._machine_of(values)
        self._feed_forward.forces = forces = forces_of(values, machine)
        limits = motion_limits_of(values, machine, forces)
        scales = (values[name] for name in ("speed_scale", "path_speed_scale", "rapid_scale"))
        self._controller.set_limits(limits, *scales)
        self._engine.set_shaper(shaper_of(values))

    def _health(self) -> Health:
        unusable = self._unusable.end_of_second()
        self._reports.end_of_second()
        self._warnings.end_of_second()
        return health_of(
            self._controller,
            self._supervisor,
            self._loop,
            self._refused,
            unusable,
            self._reports.remark,
            self._feed_forward.continuous,
        )

    def _check(self, values: Values) -> None:
        """Check what can be set live; all else is checked by what is made of it at the start."""
        machine, places = self._machine_of(values)
        motion_limits_of(values, machine).check_holding(places)
        shaper_of(values)
        in_position_bounds_of(values)

    def _machine_of(self, values: Values) -> tuple[TriGlide, FloatArray]:
        """Return the machine, and places all over its workspace. Shape (n, 3) [m].

        No value that they are made of can be set live.
        """
        if self._made is None:
            machine = machine_of(values)
            self._made = machine, places_inside(machine, workspace_limits_of(values))
        return self._made
