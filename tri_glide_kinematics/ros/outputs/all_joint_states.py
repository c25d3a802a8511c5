"""The values of all joints of the URDF, while somebody listens."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from tri_glide_kinematics.description import PASSIVE_JOINTS, Parts
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
