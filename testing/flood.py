"""Floods a machine with targets, of which two in three are impossible: run as a process by tests.

Arguments: namespace, kind of target, targets per second, their number. It takes longer on a busy
computer.
"""

import math
import random
import sys
import time
from typing import Any

import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile

TIMEOUT = 60.0  # s
# Topic and type of each kind.
KINDS = {
    "pose": ("target_pose", PoseStamped),
    "twist": ("target_twist", TwistStamped),
    "state": ("target_state", Odometry),
}


def main() -> None:
    """Publish."""
    namespace, kind, rate, number = *sys.argv[1:3], float(sys.argv[3]), int(sys.argv[4])
    rclpy.init()
    node = rclpy.create_node("flood", namespace=namespace)
    topic, message_type = KINDS[kind]
    publisher = node.create_publisher(message_type, topic, QoSProfile(depth=1000))
    deadline = time.monotonic() + TIMEOUT
    while not publisher.get_subscription_count():
        assert time.monotonic() < deadline, "nobody listens"
        rclpy.spin_once(node, timeout_sec=0.05)
    source = random.Random(1)
    messages = [_target(message_type(), source) for _ in range(1000)]
    begin = time.monotonic()
    count = 0
    while count < number:
        due = min(rate * (time.monotonic() - begin), number)
        stamp = node.get_clock().now().to_msg()
        while count < due:
            message = messages[count % len(messages)]
            message.header.stamp = stamp
            publisher.publish(message)
            count += 1
        rclpy.spin_once(node, timeout_sec=0.0)
    rclpy.shutdown()


def _target(message: Any, source: random.Random) -> Any:
    """Return a ``message`` with numbers of its own."""
    if isinstance(message, TwistStamped):
        linear = message.twist.linear
        linear.x, linear.y = source.uniform(-0.2, 0.2), source.uniform(-0.2, 0.2)
        linear.z = source.choice((source.uniform(-0.2, 0.2), math.inf, math.nan))
        return message
    pose = message.pose if isinstance(message, PoseStamped) else message.pose.pose
    point = pose.position
    point.x, point.y = source.uniform(-0.08, 0.08), source.uniform(-0.08, 0.08)
    point.z = source.choice((source.uniform(0.2, 0.4), 2.0, math.nan))
    if isinstance(message, Odometry):
        message.twist.twist.linear.x = source.uniform(-1.0, 1.0)
    return message


if __name__ == "__main__":
    main()
