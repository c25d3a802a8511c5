"""Calls services of a node as soon as it sees them, and writes the seconds to each answer as JSON.

It prepares itself, writes "ready", and joins the domain when it is told to by a line.
"""

import json
import sys
import time
from typing import Any

import rclpy
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

PATIENCE = 40.0  # s
REQUESTS: dict[str, tuple[type, Any]] = {
    "stop": (Trigger, Trigger.Request()),
    "get_parameters": (GetParameters, GetParameters.Request(names=["rate"])),
}


def main() -> None:
    """Take the node's full name, the number of subscriptions, and names of services."""
    server, subscriptions, *services = sys.argv[1:]
    print("ready", flush=True)
    sys.stdin.readline()
    rclpy.init()
    node = Node("fresh_client")
    # Readers of answers become known after all these.
    for number in range(int(subscriptions)):
        node.create_subscription(Empty, f"unused_{number}", lambda _: None, 1)
    answers = {service: call(node, f"{server}/{service}", service) for service in services}
    print(json.dumps(answers), flush=True)
    rclpy.shutdown()


def call(node: Node, name: str, service: str) -> float | None:
    """Call a service as soon as it is seen; return the seconds to its answer, None without one."""
    kind, request = REQUESTS[service]
    client = node.create_client(kind, name)
    end = time.monotonic() + PATIENCE
    while not client.service_is_ready() and time.monotonic() < end:
        time.sleep(0.0005)
    begin = time.monotonic()
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE)
    return time.monotonic() - begin if future.done() else None


if __name__ == "__main__":
    main()
