#!/usr/bin/env python3
"""Has pick_node place some parts, and prints what becomes of each. Ctrl-C ends this script only.

python3 examples/pick_parts.py 2
"""

import sys
import time

import rclpy
from rclpy.action import ActionClient
from rclpy.node import Node

from tri_glide_interfaces.action import Pick
from tri_glide_interfaces.msg import PartEvent, PickState

TRIES = 10


def result_of(node: Node, client: ActionClient, goal: Pick.Goal) -> Pick.Result:
    """Send a goal, and return its result."""
    sent = client.send_goal_async(goal)
    rclpy.spin_until_future_complete(node, sent)
    ended = sent.result().get_result_async()
    rclpy.spin_until_future_complete(node, ended)
    return ended.result().result


def main() -> int:
    """Pick, and return 0 if all are placed."""
    rclpy.init()
    node = rclpy.create_node("pick_parts")
    seen: list[int] = []
    node.create_subscription(
        PickState, "pick_node/pick_state", lambda told: seen.extend(told.parts), 10
    )
    node.create_subscription(
        PartEvent, "pick_node/part_events", lambda told: print(f"part {told.part}: {told.text}"), 10
    )
    while not seen:
        rclpy.spin_once(node)
    client = ActionClient(node, Pick, "pick_node/run")
    client.wait_for_server()
    for _ in range(TRIES):
        result = result_of(node, client, Pick.Goal(count=int(sys.argv[1])))
        if result.code != Pick.Result.REFUSED:
            break
        # A node that was just started has not heard of the machine yet.
        time.sleep(1.0)
    print(result.text)
    return 0 if result.code == Pick.Result.SUCCEEDED else 1


if __name__ == "__main__":
    sys.exit(main())
