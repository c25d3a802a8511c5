#!/usr/bin/env python3
"""Homes the drives that cia402_node leads. Ctrl-C stops them.

    python3 examples/home_the_drives.py

All sliders go up to their switches, at the same speed: the platform must be free to go with them.
"""

import sys

import rclpy
from rclpy.action import ActionClient
from rclpy.signals import SignalHandlerOptions

from tri_glide_interfaces.action import Home


def main() -> int:
    """Home, and return 0 if each drive knows its place."""
    # Ctrl-C is not to end ROS: the goal has to be cancelled.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("home_the_drives")
    client = ActionClient(node, Home, "cia402_node/home")
    try:
        while not client.wait_for_server(0.1):
            pass
    except KeyboardInterrupt:
        return 1

    told: list[str] = []

    def tell(message: Home.Impl.FeedbackMessage) -> None:
        if told != message.feedback.waiting:
            told[:] = message.feedback.waiting
            print("waiting for", ", ".join(told) or "the way down into the travel", flush=True)

    sent = client.send_goal_async(Home.Goal(), tell)
    rclpy.spin_until_future_complete(node, sent)
    ended = sent.result().get_result_async()
    try:
        rclpy.spin_until_future_complete(node, ended)
    except KeyboardInterrupt:
        sent.result().cancel_goal_async()
        rclpy.spin_until_future_complete(node, ended)
    result = ended.result().result
    print(result.text)
    return 0 if result.code == Home.Result.SUCCEEDED else 1


if __name__ == "__main__":
    sys.exit(main())
