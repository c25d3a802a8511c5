"""Floods a machine with target poses, two in three of them impossible: run as a process by tests.

Arguments: namespace, targets per second, seconds. Prints how many were published.
"""

from __future__ import annotations

import math
import random
import sys
import time

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.qos import QoSProfile


def main() -> None:
    """Publish, and print how many."""
    namespace, rate, seconds = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
    rclpy.init()
    node = rclpy.create_node("flood", namespace=namespace)
    publisher = node.create_publisher(PoseStamped, "target_pose", QoSProfile(depth=1000))
    deadline = time.monotonic() + 20.0
    while not publisher.get_subscription_count():
        assert time.monotonic() < deadline, "nobody listens"
        rclpy.spin_once(node, timeout_sec=0.05)
    source = random.Random(1)
    messages = []
    for _ in range(1000):
        message = PoseStamped()
        point = message.pose.position
        point.x, point.y = source.uniform(-0.08, 0.08), source.uniform(-0.08, 0.08)
        point.z = source.choice((source.uniform(0.2, 0.4), 2.0, math.nan))
        messages.append(message)
    begin = time.monotonic()
    count = 0
    while (elapsed := time.monotonic() - begin) < seconds:
        while count < rate * elapsed:
            publisher.publish(messages[count % len(messages)])
            count += 1
        rclpy.spin_once(node, timeout_sec=0.0)
    print(count)
    rclpy.shutdown()


if __name__ == "__main__":
    main()
