"""Moves the machine: targets and measured joint states in, a stream of joint commands out."""

from __future__ import annotations

import time
from collections import deque

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from tri_glide_kinematics.control.controller import MotionController
from tri_glide_kinematics.control.controller_health import health_of, status_of
from tri_glide_kinematics.control.health import Health
from tri_glide_kinematics.control.loop_statistics import LoopStatistics
from tri_glide_kinematics.control.operating_state import FAULT, JOGGING, TRACKING
from tri_glide_kinematics.control.reason_log import ReasonLog
from tri_glide_kinematics.control.status import ControllerStatus
from tri_glide_kinematics.control.streams import Streams
from tri_glide_kinematics.control.supervision import Supervisor
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import MotionEngine, MotionKind, MotionPhase, SliderState
from tri_glide_kinematics.ros.command_outputs import CommandOutputs
from tri_glide_kinematics.ros.cycle_loop import Cycle
from tri_glide_kinematics.ros.diagnostics import DiagnosticsPublisher, status_message
from tri_glide_kinematics.ros.from_parameters import (
    check_joint_names,
    in_position_bounds_of,
    limits_of,
    machine_of,
    supervision_bounds_of,
    workspace_limits_of,
)
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.messages import (
    age_of_target,
    moving_target,
    target_position,
    target_velocity,
)
from tri_glide_kinematics.ros.other_publishers import OtherPublishers
from tri_glide_kinematics.ros.parameter_table import Values
from tri_glide_kinematics.ros.parameters import IK_NODE
from tri_glide_kinematics.ros.patient_services import PatientServices
from tri_glide_kinematics.ros.run import FatalError
from tri_glide_kinematics.ros.slider_measurements import SliderMeasurements
from tri_glide_kinematics.workspace.workspace import Workspace

# Twists are renewed all the time: the latest one counts, and none is sent again after the
# connection was lost.
LATEST_ONLY = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=10)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

# What changes all the time, as the twist of a joystick does, is told this often [s].
STATUS_PERIOD = 0.1

# Planning may delay the setpoint by this part of a period: so from rest the first one that leads
# to a target comes in the same cycle, and none comes late.
PLANNING_PART = 0.3


# Motions that change with each message that renews them.
RENEWED = (JOGGING, TRACKING)


class IkNode(Node):
    """Turns messages into calls of the controller, and its setpoints into messages.

    Attributes:
        cycle: what it does again and again.
    """

    def __init__(self) -> None:
        """Declare the parameters and wait for the machine.

        Raises:
            KinematicsError: if a parameter has a value that it cannot work with.
        """
        super().__init__("ik_node")
        parameters = LiveParameters(self, IK_NODE, _check)
        values = parameters.values
        period = 1.0 / values["rate"]
        self._planning_time = PLANNING_PART * period
        self._target_timeout = values["target_timeout"]
        self._tracking_latency = values["tracking_latency"]
        self._base_frame = values["base_frame"]
        self._platform_frame = values["platform_frame"]
        check_joint_names(values)
        self._reader = SliderMeasurements(values["joint_names"])
        self._refused = ReasonLog(self.get_logger().warning, lines_per_second=10)
        self._unusable = ReasonLog(self.get_logger().warning, lines_per_second=1)
        self._stalls = ReasonLog(self.get_logger().warning, lines_per_second=1)
        self._loop = LoopStatistics(period)
        self._changes: deque[ControllerStatus] = deque()
        # Each place that logs has one severity, as rclpy refuses another one: this one is its own.
        self._states = ReasonLog(lambda text: self.get_logger().info(text), lines_per_second=5)
        self._told: Health | None = None
        self._remark = ""
        self._stream_topics: tuple[str, ...] = ()
        self._logged: ControllerStatus | None = None
        self._status_publisher = self.create_publisher(DiagnosticStatus, "~/status", LATCHED)
        self._outputs = CommandOutputs(self, values)
        self._supervisor = Supervisor(supervision_bounds_of(values), values["joint_names"])
        self._engine = MotionEngine(
            Workspace(machine_of(values), workspace_limits_of(values)),
            limits_of(values),
            kind=MotionKind[values["motion"].upper()],
            speed_scale=values["speed_scale"],
            in_pieces=True,
        )
        self._controller = MotionController(
            self._engine,
            self._supervisor,
            period=period,
            streams=Streams.with_timeouts(values["twist_timeout"], values["target_timeout"]),
            in_position_bounds=in_position_bounds_of(values),
            start_disabled=values["start_disabled"],
            travel=(values["lower_heights"], values["upper_heights"]),
            on_change=self._changes.append,
            on_refusal=lambda reason: self._refused.add(f"refused a target: {reason}"),
        )
        parameters.on_change(self._apply)
        self._others = OtherPublishers(self, self._outputs.publishers, self._on_others)
        self.create_service(SetBool, "~/enable", self._on_enable)
        DiagnosticsPublisher(self, self._health)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(STATUS_PERIOD, self._publish_status, clock=steady)
        poses = self.create_subscription(PoseStamped, "target_pose", self._on_pose, RELIABLE)
        twists = self.create_subscription(TwistStamped, "target_twist", self._on_twist, LATEST_ONLY)
        states = self.create_subscription(Odometry, "target_state", self._on_state, LATEST_ONLY)
        self._stream_topics = (twists.topic_name, states.topic_name)
        urgent = (
            self.create_subscription(
                JointState, "joint_states", self._on_measured, qos_profile_sensor_data, raw=True
            ),
            poses,
            twists,
            states,
            self.create_service(Trigger, "~/stop", self._on_stop),
        )
        # The way to a pose takes a millisecond to plan: it begins in the sleep before the cycle.
        self.cycle = Cycle(urgent, period, self._cycle, self._plan, early=(poses,))
        PatientServices(self, lambda: self._engine.phase is MotionPhase.IDLE)

    def _cycle(self) -> None:
        now = time.monotonic()
        delay = self._loop.cycle(now)
        if delay is not None:
            self._stalls.add(f"a cycle came {1000.0 * delay:.3g} ms late: no setpoint in that time")
        try:
            setpoint = self._setpoint(now)
            if setpoint is not None:
                self._outputs.publish(setpoint, self._engine)
        finally:
            self._tell_changes()

    def _setpoint(self, now: float) -> SliderState | None:
        try:
            until = now + self._planning_time
            return self._controller.cycle(now, lambda: time.monotonic() < until)
        except Exception as error:
            raise _fatal(error) from error

    def _plan(self, until: float) -> None:
        """Use what is left of a cycle, ``until`` some time.monotonic(), to plan."""
        try:
            self._controller.plan(lambda: time.monotonic() < until)
        except Exception as error:
            raise _fatal(error) from error
        self._tell_changes()

    def _on_measured(self, data: bytes) -> None:
        try:
            reading = self._reader.read(data)
            if reading is not None:
                stamp = reading.seconds + 1e-9 * reading.nanoseconds
                self._controller.measured(reading.heights, time.monotonic(), stamp)
        except KinematicsError as error:
            self._unusable.add(f"unusable measurement: {error}")

    def _on_pose(self, message: PoseStamped) -> None:
        try:
            self._controller.move_to(target_position(message, self._base_frame))
        except KinematicsError as error:
            self._refused.add(f"refused a target pose: {error}")

    def _on_twist(self, message: TwistStamped) -> None:
        now = time.monotonic()
        try:
            velocity = target_velocity(message, self._base_frame, self._platform_frame)
            self._outputs.check_jogging()
            self._controller.jog(velocity, now)
        except KinematicsError as error:
            self._refused.add(f"refused a target twist: {error}")

    def _on_state(self, message: Odometry) -> None:
        now = time.monotonic()
        try:
            position, velocity = moving_target(message, self._base_frame)
            age = age_of_target(message.header.stamp, self.get_clock(), self._target_timeout)
            self._outputs.check_jogging()
            self._controller.track(position, velocity, now - age - self._tracking_latency, now)
        except KinematicsError as error:
            self._refused.add(f"refused a target state: {error}")

    def _on_others(self, text: str | None) -> None:
        self._controller.set_obstacle(text)
        self._tell_changes()
        self._remark = "; ".join(
            f"{count} publishers of {topic}: the newest message wins"
            for topic in self._stream_topics
            if (count := self.count_publishers(topic)) > 1
        )

    def _on_stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = self._controller.stop()
        response.success = True
        self._tell_changes()
        return response

    def _on_enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        try:
            if request.data:
                self._on_others(self._others.look())
                response.message = self._controller.enable(time.monotonic())
            else:
                response.message = self._controller.disable()
            response.success = True
        except KinematicsError as error:
            response.message = str(error)
            self._refused.add(f"refused to {'enable' if request.data else 'disable'}: {error}")
        self._tell_changes()
        return response

    def _tell_changes(self) -> None:
        """Log and publish new states: before a service answers, but after the first command.

        That need not wait for it, as it takes 0.1 ms.
        """
        while self._changes:
            status = self._changes.popleft()
            # A joystick gives another twist all the time; that is told now and then.
            if self._is_new(status):
                self._log(status)
                self._publish_status(status)

    def _is_new(self, status: ControllerStatus) -> bool:
        """Return whether this is more than the same jog or tracking, renewed."""
        last, self._logged = self._logged, status
        if last is None or last.state is not status.state or status.state not in RENEWED:
            return True
        return last.held_at_edge != status.held_at_edge

    def _log(self, status: ControllerStatus) -> None:
        text = f"{status.state.value}: {status.reason}"
        # Each place that logs has one severity: rclpy refuses another one.
        if status.state is FAULT:
            self.get_logger().error(text)
        elif status.target_missed:
            self.get_logger().warning(text)
        else:
            self._states.add(text)

    def _publish_status(self, status: ControllerStatus | None = None) -> None:
        """Publish a status, the present one by default, unless that is told already."""
        health = status_of(status or self._controller.status, self._refused, self._remark)
        if health != self._told:
            self._told = health
            name = self.get_fully_qualified_name()[1:]
            self._status_publisher.publish(status_message(name, health))

    def _apply(self, values: Values) -> None:
        streams = self._controller.streams
        streams.twists.timeout = values["twist_timeout"]
        streams.targets.timeout = self._target_timeout = values["target_timeout"]
        self._tracking_latency = values["tracking_latency"]
        self._controller.newest_target.bounds = in_position_bounds_of(values)
        self._supervisor.bounds = supervision_bounds_of(values)
        self._controller.set_limits(limits_of(values), values["speed_scale"])

    def _health(self) -> Health:
        unusable = self._unusable.end_of_second()
        self._states.end_of_second()
        self._stalls.end_of_second()
        return health_of(
            self._controller, self._supervisor, self._loop, self._refused, unusable, self._remark
        )


def _fatal(error: Exception) -> FatalError:
    return FatalError(f"the control cycle failed: {type(error).__name__}: {error}")


def _check(values: Values) -> None:
    """Check what can be set live; all else is checked by what is made of it at the start."""
    limits_of(values)
    in_position_bounds_of(values)
