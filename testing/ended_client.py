"""A client that ends without a clean shutdown: run as a process beside nodes.

Arguments: namespace, and ``exit`` (as a crash would) or ``wait`` (to be killed). It asks
``ik_node`` for a parameter, and says ``answered`` when it has the answer.
"""

import os
import signal
import sys
import time

import rclpy
from rclpy.parameter_client import AsyncParameterClient

RETRY_TIME = 5.0  # s: an answer may get lost while two nodes are still finding each other


def main() -> None:
    """Ask, and end or wait."""
    namespace, how = sys.argv[1:]
    rclpy.init(args=[])
    node = rclpy.create_node("ended_client", namespace=namespace)
    client = AsyncParameterClient(node, "ik_node")
    answer = None
    asked = 0.0
    while answer is None or not answer.done():
        if time.monotonic() > asked + RETRY_TIME and client.services_are_ready():
            answer = client.get_parameters(["rate"])
            asked = time.monotonic()
        rclpy.spin_once(node, timeout_sec=0.01)
    print("answered", flush=True)
    if how == "exit":
        os._exit(0)
    signal.pause()


if __name__ == "__main__":
    main()
