"""A client that calls services of a node as soon as it sees them: run as a process by tests.

It prepares itself, says "ready", and joins the domain when it is told to by a line. It writes as
JSON which services have answered, and ends in one of the ways.
"""

import json
import os
import signal
import sys
import time
from typing import Any

import rclpy
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

PATIENCE = 40.0  # s
NAP = 0.001  # s
REQUESTS: dict[str, tuple[type, Any]] = {
    "stop": (Trigger, Trigger.Request()),
    "get_parameters": (GetParameters, GetParameters.Request(names=["rate"])),
}
# As nodes do, as a crash would, or killed by somebody else.
CLEANLY, EXIT, KILL = "cleanly", "exit", "kill"


def main() -> None:
    """Take the way to end, the node's full name, the number of subscriptions, names of services."""
    way, server, subscriptions, *services = sys.argv[1:]
    print("ready", flush=True)
    sys.stdin.readline()
    rclpy.init(args=[])
    node = Node("calling_client")
    # Readers of answers become known after all these.
    for number in range(int(subscriptions)):
        node.create_subscription(Empty, f"unused_{number}", lambda _: None, 1)
    answered = {service: is_answered(node, f"{server}/{service}", service) for service in services}
    print(json.dumps(answered), flush=True)
    if way == EXIT:
        os._exit(0)
    if way == KILL:
        signal.pause()
    rclpy.shutdown()


def is_answered(node: Node, name: str, service: str) -> bool:
    """Call a service as soon as it is seen, once, and tell whether it answers."""
    kind, request = REQUESTS[service]
    client = node.create_client(kind, name)
    end = time.monotonic() + PATIENCE
    while not client.service_is_ready() and time.monotonic() < end:
        time.sleep(NAP)
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE)
    return future.done()


if __name__ == "__main__":
    main()
