#!/usr/bin/env python3
"""Sends the platform to a position and waits until it is there, or says why it is not.

    python3 examples/send_a_pose.py 0.05 0.0 0.28

Position in metres. ik_node has to run, with a machine or the simulator.
"""

import argparse
import signal
import sys
from contextlib import suppress

# Until ROS handles it, Ctrl-C just ends the process.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.utilities import remove_ros_args

from tri_glide_interfaces.msg import MachineState


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
        self.create_subscription(MachineState, "ik_node/machine_state", self._on_state, latched)
        self.create_timer(0.1, self._send)

    def _send(self) -> None:
        # Once: when the state of the machine is known, and somebody listens.
        if self._refusals_before is None or self._publisher.get_subscription_count() == 0:
            return
        self._publisher.publish(self._target)
        for timer in self.timers:
            timer.cancel()

    def _on_state(self, machine: MachineState) -> None:
        if self._refusals_before is None:
            self._refusals_before = machine.refused
        elif machine.refused > self._refusals_before:
            self.result = machine.refusal_text
        elif machine.state == MachineState.MOVING:
            self._has_moved = True
        elif self._has_moved:
            # Idle, and in place as measured; or stopped, disabled or in a fault.
            self.result = machine.reason
            self.reached = machine.target_reached


def main() -> int:
    """Send, wait, and return 0 if the position was reached."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("position", nargs=3, type=float, metavar=("x", "y", "z"))
    position = parser.parse_args(remove_ros_args(sys.argv)[1:]).position
    rclpy.init()
    node = PoseSender(position)
    try:
        while node.result is None:
            rclpy.spin_once(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 1
    except Exception:
        # Ctrl-C ends ROS at once, also while the timer publishes.
        if rclpy.ok():
            raise
        return 1
    finally:
        # Ctrl-C may end ROS at this very moment (rclpy issue 1352).
        with suppress(RuntimeError):
            rclpy.try_shutdown()
    print(node.result)
    return 0 if node.reached else 1


if __name__ == "__main__":
    sys.exit(main())
