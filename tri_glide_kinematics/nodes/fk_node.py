"""Publishes where the platform is, from the measured slider heights."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState

from tri_glide_kinematics.control import Health, Level
from tri_glide_kinematics.description import PASSIVE_JOINTS, Parts
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.cdr import FIRST, StampedTriples
from tri_glide_kinematics.ros.inputs import SliderMeasurements
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle
from tri_glide_kinematics.ros.outputs import DiagnosticsPublisher
from tri_glide_kinematics.ros.serving import PatientServices
from tri_glide_kinematics.settings import FK_NODE, check_joint_names, machine_of
from tri_glide_kinematics.vectors import Vector3

# As often as the launch file lets robot_state_publisher tell transforms [s].
PERIOD = 0.02


class AllJointStates:
    """Publishes ``all_joint_states``: sliders, platform and rods at one and the same time.

    A URDF has no loops, so its rods meet its platform only where all of these values belong
    together. Nothing is published while nobody listens.
    """

    TOPIC = "all_joint_states"

    def __init__(
        self, node: Node, parts: Parts, joint_names: Sequence[str], height_offsets: Vector3
    ) -> None:
        """Create the publisher on ``node``.

        Args:
            node: that publishes.
            parts: of the machine.
            joint_names: of the sliders. Shape (3,).
            height_offsets: true heights minus those that the drives report. Shape (3,) [m].
        """
        self._parts = parts
        self._names = [*joint_names, *PASSIVE_JOINTS]
        self._offsets = height_offsets
        self._due = -math.inf
        self._publisher = node.create_publisher(JointState, self.TOPIC, QoSProfile(depth=10))

    def offer(self, seconds: int, nanoseconds: int, heights: Vector3, position: Vector3) -> None:
        """Publish a measurement, unless another one has just been, or nobody listens.

        Args:
            seconds: of its stamp.
            nanoseconds: of its stamp, beyond the seconds.
            heights: true ones. Shape (3,) [m].
            position: of the platform. Shape (3,) [m].
        """
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + PERIOD
        if not self._publisher.get_subscription_count():
            return
        message = JointState(name=self._names)
        message.header.stamp = Time(sec=seconds, nanosec=nanoseconds)
        message.position = [
            *(height - offset for height, offset in zip(heights, self._offsets)),
            *self._parts.passive_values(heights, position),
        ]
        self._publisher.publish(message)


class FkNode(Node):
    """Answers each measurement with a pose and, if it holds velocities, a twist of the same time.

    The platform does not rotate, so the twist holds for every point of it. Whoever draws the
    machine gets the values of all its joints, less often.
    """

    def __init__(self) -> None:
        """Declare the parameters and start listening.

        Raises:
            KinematicsError: if a parameter has a value that it cannot work with.
        """
        super().__init__("fk_node")
        values = LiveParameters(self, FK_NODE, check_joint_names).values
        self._machine = machine_of(values)
        self._reader = SliderMeasurements(values["joint_names"], values["height_offsets"])
        self._reasons = ReasonLog(self.get_logger().warning, lines_per_second=1)
        self._poses = 0
        pose, twist = PoseStamped(), TwistStamped()
        pose.header.frame_id = twist.header.frame_id = values["base_frame"]
        point, linear = pose.pose.position, twist.twist.linear
        point.x, point.y, point.z = linear.x, linear.y, linear.z = FIRST
        self._pose = StampedTriples(pose, 1)
        self._twist = StampedTriples(twist, 1)
        reliable = QoSProfile(depth=10)
        self._pose_publisher = self.create_publisher(PoseStamped, "platform_pose", reliable)
        self._twist_publisher = self.create_publisher(TwistStamped, "platform_twist", reliable)
        parts = Parts.of(self._machine.geometry, values["platform_radius"])
        self._all_joints = AllJointStates(
            self, parts, values["joint_names"], values["height_offsets"]
        )
        DiagnosticsPublisher(self, self._health)
        measured = self.create_subscription(
            JointState, "joint_states", self._on_joint_state, qos_profile_sensor_data, raw=True
        )
        self.cycle = Cycle((measured,))
        PatientServices(self)

    def _on_joint_state(self, data: bytes) -> None:
        try:
            reading = self._reader.read(data)
            if reading is None:
                return
            if reading.velocities is None:
                position, velocity = self._machine.forward(reading.heights), None
            else:
                position, velocity = self._machine.forward_velocity(
                    reading.heights, reading.velocities
                )
        except KinematicsError as error:
            self._reasons.add(f"no pose: {error}")
            return
        self._poses += 1
        stamp = reading.seconds, reading.nanoseconds
        self._pose_publisher.publish(self._pose.at(*stamp, position))
        self._all_joints.offer(*stamp, reading.heights, position)
        if velocity is not None:
            self._twist_publisher.publish(self._twist.at(*stamp, velocity))

    def _health(self) -> Health:
        poses, self._poses = self._poses, 0
        refused = self._reasons.end_of_second()
        values = {
            "poses per second": poses,
            "refused measurements per second": refused,
            "refused measurements": self._reasons.total,
            "last reason": self._reasons.last,
        }
        if refused:
            return Health(Level.WARN if poses else Level.ERROR, self._reasons.last, values)
        if not poses:
            return Health(Level.STALE, "no measured slider heights", values)
        return Health(Level.OK, "platform pose is published", values)
