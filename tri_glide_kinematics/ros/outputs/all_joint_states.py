"""The values of all joints of the URDF, while somebody listens."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from tri_glide_kinematics.description import PASSIVE_JOINTS, Parts
from tri_glide_kinematics.vectors import Vector3

TOPIC = "all_joint_states"

# robot_state_publisher takes no more of them by default [s].
PERIOD = 0.02


class AllJointStates:
    """Publishes ``all_joint_states``: sliders, platform and rods at one and the same time.

    A URDF has no loops, so its rods meet its platform only where all of these values belong
    together. Nothing is published while nobody listens.
    """

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
        self._newest: tuple[int, int, Vector3, Vector3] | None = None
        self._publisher = node.create_publisher(JointState, TOPIC, QoSProfile(depth=10))
        node.create_timer(PERIOD, self._publish, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def keep(self, seconds: int, nanoseconds: int, heights: Vector3, position: Vector3) -> None:
        """Keep a measurement until the next message.

        Args:
            seconds: of its stamp.
            nanoseconds: of its stamp, beyond the seconds.
            heights: true ones. Shape (3,) [m].
            position: of the platform. Shape (3,) [m].
        """
        self._newest = (seconds, nanoseconds, heights, position)

    def _publish(self) -> None:
        """Publish the newest measurement, if there is a new one and somebody listens."""
        newest, self._newest = self._newest, None
        if newest is None or not self._publisher.get_subscription_count():
            return
        seconds, nanoseconds, heights, position = newest
        message = JointState(name=self._names)
        message.header.stamp = Time(sec=seconds, nanosec=nanoseconds)
        message.position = [
            *(height - offset for height, offset in zip(heights, self._offsets)),
            *self._parts.passive_values(heights, position),
        ]
        self._publisher.publish(message)
