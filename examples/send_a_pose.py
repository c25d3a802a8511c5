#!/usr/bin/env python3
"""Sends the platform to a position and waits until it is there, or says why it is not.

    python3 examples/send_a_pose.py 0.05 0.0 0.28

Position in metres. ik_node has to run, with a machine or the simulator.
"""

import argparse
import sys

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.utilities import remove_ros_args


class PoseSender(Node):
    """Publishes one target and listens to what becomes of it."""

    def __init__(self, position: list[float]) -> None:
        """Prepare to send ``position`` [m]."""
        super().__init__("pose_sender")
        self.result: str | None = None
        self.reached = False
        self._target = PoseStamped()
        point = self._target.pose.position
        point.x, point.y, point.z = position
        self._refusals_before: int | None = None
        self._has_moved = False
        self._publisher = self.create_publisher(PoseStamped, "target_pose", 10)
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(DiagnosticStatus, "ik_node/status", self._on_status, latched)
        self.create_timer(0.1, self._send)

    def _send(self) -> None:
        # Once: when the state of the machine is known, and somebody listens.
        if self._refusals_before is None or self._publisher.get_subscription_count() == 0:
            return
        self._publisher.publish(self._target)
        for timer in self.timers:
            timer.cancel()

    def _on_status(self, status: DiagnosticStatus) -> None:
        values = {entry.key: entry.value for entry in status.values}
        refusals = int(values["refused commands"])
        if self._refusals_before is None:
            self._refusals_before = refusals
        elif refusals > self._refusals_before:
            self.result = values["last refusal"]
        elif values["state"] == "moving":
            self._has_moved = True
        elif self._has_moved:
            # Idle, and in place as measured; or stopped, disabled or in a fault.
            self.result = status.message
            self.reached = values["state"] == "idle" and "is reached" in values["reason"]


def main() -> int:
    """Send, wait, and return 0 if the position was reached."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("position", nargs=3, type=float, metavar=("x", "y", "z"))
    position = parser.parse_args(remove_ros_args(sys.argv)[1:]).position
    rclpy.init()
    node = PoseSender(position)
    while node.result is None:
        rclpy.spin_once(node)
    print(node.result)
    rclpy.shutdown()
    return 0 if node.reached else 1


if __name__ == "__main__":
    sys.exit(main())
