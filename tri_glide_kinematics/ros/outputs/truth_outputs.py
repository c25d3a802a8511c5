"""Publishes what a simulator alone knows: where the platform truly is, and touches of a plate."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Bool

from tri_glide_kinematics.control import SimulatedPlate
from tri_glide_kinematics.ros.cdr import FIRST, StampedTriples
from tri_glide_kinematics.vectors import Vector3

RELIABLE = QoSProfile(depth=10)

# A contact is told when it begins and when it ends, and again and again, so that who listens knows
# that the switch is there [s].
CONTACT_PERIOD = 0.02


class TruthOutputs:
    """The topics ``true_pose`` and ``contact`` of a simulated machine.

    Attributes:
        plate: that can be touched; another one counts from the next cycle on.
    """

    def __init__(self, node: Node, base_frame: str, period: float, plate: SimulatedPlate) -> None:
        """Create the publishers.

        Args:
            node: that publishes.
            base_frame: frame of the poses.
            period: from one call of ``publish`` to the next [s].
            plate: that can be touched.
        """
        self.plate = plate
        pose = PoseStamped()
        pose.header.frame_id = base_frame
        point = pose.pose.position
        point.x, point.y, point.z = FIRST
        self._pose = StampedTriples(pose, 1)
        self._contact = Bool()
        self._poses = node.create_publisher(PoseStamped, "true_pose", RELIABLE)
        self._contacts = node.create_publisher(Bool, "contact", RELIABLE)
        self._quiet_cycles = max(1, round(CONTACT_PERIOD / period))
        self._quiet = self._quiet_cycles

    def publish(self, position: Vector3, seconds: int, nanoseconds: int) -> None:
        """Publish where the platform is [m], at this time, and whether it touches the plate."""
        is_touched = self.plate.is_touched(position)
        self._quiet += 1
        if is_touched != self._contact.data or self._quiet >= self._quiet_cycles:
            self._contact.data, self._quiet = is_touched, 0
            self._contacts.publish(self._contact)
        self._poses.publish(self._pose.at(seconds, nanoseconds, position))
