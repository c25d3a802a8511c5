"""The machine of an ``ik_node``, as probes and searches for modes lead it and listen to it."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool

from tri_glide_interfaces.msg import MachineState, MotionState
from tri_glide_kinematics.calibration.session import (
    ACCELEROMETER,
    Delivery,
    IkSettings,
    Leading,
    LeadingError,
    MachineView,
)
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.goal_sender import GoalSender
from tri_glide_kinematics.ros.loop import UrgentInputs
from tri_glide_kinematics.ros.messages import set_stamp
from tri_glide_kinematics.ros.outputs import cause_of, read_motion, state_of
from tri_glide_kinematics.settings import (
    CALIBRATION_NODE,
    IK_NODE,
    NO_SHAPER,
    workspace_of,
)

MACHINE_STATE = "ik_node/machine_state"
MOTION = "ik_node/motion_state"
NEWEST = QoSProfile(depth=1)
# None may be missing: a short one may be that of another's command.
ALL_STATES = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# None may be missing between two looks, nor after a short stall: half a second at 1 kHz.
SAMPLES = QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT)
# Looks for samples take no longer than this in a cycle [s].
LOOKING = 0.003

# Parameters that ik_node has to tell of itself: its geometry, its limits, its shaper.
_OF_BOTH = {entry.name for entry in CALIBRATION_NODE} | {"shaper"}
PARAMETERS = tuple(entry for entry in IK_NODE if entry.name in _OF_BOTH)

# REP 145: such an element says that a sensor does not measure this.
NOT_MEASURED = -1.0


class CalibrationLink(GoalSender):
    """A ``JoggedMachine`` and a ``SwungMachine``; what comes in is handed to their leader.

    Attributes:
        leading: that decides whose turn it is.
        contacts: subscription that has to be looked at in each cycle.
    """

    def __init__(self, node: Node, base_frame: str, unusable: ReasonLog) -> None:
        """Talk as a part of ``node``.

        Args:
            node: that talks with ik_node.
            base_frame: of twists.
            unusable: is told of messages that cannot be read.
        """
        super().__init__(node)
        self.leading = Leading()
        self._base_frame = base_frame
        self._unusable = unusable
        self._parameters = AsyncParameterClient(node, "ik_node")
        self._subscriptions: list[Any] = []
        self._inputs: UrgentInputs | None = None
        self._twists = node.create_publisher(TwistStamped, "target_twist", NEWEST)
        node.create_subscription(MachineState, MACHINE_STATE, self._on_machine, ALL_STATES)
        node.create_subscription(
            PoseStamped, "target_pose", lambda _: self.leading.leader.target_pose(), NEWEST
        )
        # rclpy's type hints know of no callback that gets to know when a message was sent.
        on_contact: Any = self._on_contact
        self.contacts = node.create_subscription(
            Bool, "contact", on_contact, qos_profile_sensor_data
        )

    def step(self) -> None:
        """Do what is due; to be called in each cycle."""
        if self._inputs is not None:
            self._inputs.handle(time.monotonic() + LOOKING)
        self.leading.look(time.monotonic())

    # Requests of a probe

    @property
    def is_there(self) -> bool:
        """Whether anybody tells the state of the machine."""
        return bool(self._node.count_publishers(MACHINE_STATE))

    def jog(self, upwards: float) -> None:
        """Let it move upwards with this speed [m/s], for a moment."""
        message = TwistStamped()
        message.twist.linear.z = upwards
        message.header.frame_id = self._base_frame
        set_stamp(message.header.stamp, self._node.get_clock())
        self._twists.publish(message)

    # Requests of a search for modes

    @property
    def is_ready(self) -> bool:
        """Whether there is somebody who takes goals and tells parameters."""
        return super().is_ready and self._parameters.services_are_ready()

    def ask(self) -> Callable[[], IkSettings | None]:
        """Ask for the settings; what is returned returns None until they have come."""
        asked = self._parameters.get_parameters([entry.name for entry in PARAMETERS])
        return lambda: _settings(asked.result().values) if asked.done() else None

    def listen(self, by_heights: bool) -> str:
        """Begin to listen to the swing and to setpoints, and return the topic of the swing.

        Nobody is sent these messages all the time for a search now and then.
        """
        # rclpy's type hints know of no callback that gets to know when a message was sent.
        node: Any = self._node
        subscribe = node.create_subscription
        self._subscriptions = [subscribe(MotionState, MOTION, self._on_motion, NEWEST, raw=True)]
        if not by_heights:
            self._subscriptions.append(subscribe(Imu, ACCELEROMETER, self._on_sample, SAMPLES))
        self._inputs = UrgentInputs(
            self._subscriptions,
            lambda error: self._unusable.add(f"unusable message: {type(error).__name__}: {error}"),
        )
        return node.resolve_topic_name("joint_states" if by_heights else ACCELEROMETER)

    def let_go(self) -> None:
        """Listen no more."""
        assert self._inputs is not None
        self._inputs.close()
        self._inputs = None
        for each in self._subscriptions:
            self._node.destroy_subscription(each)
        self._subscriptions = []

    # Incoming messages

    def _on_machine(self, message: MachineState) -> None:
        view = MachineView(state_of(message), cause_of(message), message.reason, message.stops)
        self.leading.told(view)

    def _on_contact(self, message: Bool, info: dict[str, Any]) -> None:
        self.leading.contact(message.data, delivery_of(info))

    def _on_motion(self, data: bytes, info: dict[str, Any]) -> None:
        try:
            commanded = read_motion(data).commanded
        except struct.error:
            return
        self.leading.leader.setpoints(commanded, delivery_of(info))

    def _on_sample(self, message: Imu, info: dict[str, Any]) -> None:
        stamp, felt = message.header.stamp, message.linear_acceleration
        is_measured = message.linear_acceleration_covariance[0] != NOT_MEASURED
        values = (felt.x, felt.y, felt.z) if is_measured else None
        self.leading.leader.sample(values, stamp.sec + 1e-9 * stamp.nanosec, delivery_of(info))


def delivery_of(info: dict[str, Any]) -> Delivery:
    """Return when a message was under way that comes in now."""
    return Delivery(1e-9 * info["source_timestamp"], time.time(), time.monotonic())


def _settings(told: Sequence[Any]) -> IkSettings:
    """Return what the parameters say that ik_node has told.

    Raises:
        KinematicsError: if it has told others, or values that it cannot have.
    """
    if len(told) != len(PARAMETERS):
        raise LeadingError(f"ik_node has told {len(told)} of {len(PARAMETERS)} parameters")
    values = {
        entry.name: entry.checked(parameter_value_to_python(value))
        for entry, value in zip(PARAMETERS, told)
    }
    shaper = values["shaper"]
    return IkSettings(
        workspace_of(values), values["height_offsets"], None if shaper == NO_SHAPER else shaper
    )
