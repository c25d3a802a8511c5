"""A client that sends targets until it is killed: run as a process by tests.

Arguments: kind of target (as in ``testing.flood``, or ``path``), then two places [m] or velocities
[m/s] of three numbers each. SIGUSR1 has it send the one and the other in turn, SIGUSR2 has it
cease, which it confirms.
"""

from __future__ import annotations

import signal
import sys
from itertools import cycle

import rclpy
from geometry_msgs.msg import Point, PoseStamped, TwistStamped
from nav_msgs.msg import Path
from rclpy.signals import SignalHandlerOptions

from testing.flood import KINDS

READY, CEASED = "somebody listens", "ceased"
PERIOD = 0.02  # s
# What is sent again and again; a place or a path is sent once.
RENEWED = ("twist", "state")


def main() -> None:
    """Publish whatever is asked for."""
    asked: list[int] = []
    for number in (signal.SIGUSR1, signal.SIGUSR2):
        signal.signal(number, lambda number, _: asked.append(number))
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    kind, *numbers = sys.argv[1], *map(float, sys.argv[2:8])
    node = rclpy.create_node("held_client")
    topic, message_type = {**KINDS, "path": ("target_path", Path)}[kind]
    publisher = node.create_publisher(message_type, topic, 10)
    messages = cycle(
        [_message(message_type(), *numbers[:3]), _message(message_type(), *numbers[3:])]
    )
    while not publisher.get_subscription_count():
        rclpy.spin_once(node, timeout_sec=PERIOD)
    print(READY, flush=True)
    held = None
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=PERIOD)
        if asked:
            held = next(messages) if asked.pop(0) == signal.SIGUSR1 else None
            if held is None:
                print(CEASED, flush=True)
        if held is not None:
            held.header.stamp = node.get_clock().now().to_msg()
            publisher.publish(held)
            held = held if kind in RENEWED else None


def _message(message: object, x: float, y: float, z: float) -> object:
    """Fill in a target."""
    if isinstance(message, TwistStamped):
        linear = message.twist.linear
        linear.x, linear.y, linear.z = x, y, z
        return message
    pose = PoseStamped()
    pose.pose.position = Point(x=x, y=y, z=z)
    if isinstance(message, Path):
        message.poses = [pose]
    elif isinstance(message, PoseStamped):
        message.pose = pose.pose
    else:
        message.pose.pose = pose.pose
    return message


if __name__ == "__main__":
    main()
