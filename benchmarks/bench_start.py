"""How long a node takes from the start of its process until it answers a service call."""

import time
from collections.abc import Iterator
from functools import partial

from rcl_interfaces.srv import ListParameters

from benchmarks.harness import Figure, Missing, attempt, figure, in_turn
from benchmarks.ros_session import session

ROUNDS = 10
POLL_TIME = 0.005  # s
BARE = "bare"
NAMESPACE = "/started"
NODES = ("ik_node", "fk_node", "simulator_node", "mechanism_node")
RETRY_TIME = 0.2  # s: a call can get lost while two nodes are still finding each other


def figures() -> Iterator[Figure | Missing]:
    """Start each node and a bare one in turn."""
    for node in NODES:
        what = f"start of {node} until it serves"
        yield attempt(what, partial(_compared, what, node))


def _compared(what: str, node: str) -> Figure:
    times = in_turn(ROUNDS, lambda: _time_to_serve(node), lambda: _time_to_serve(BARE))
    return figure(what, "rclpy.init() and one bare node", *times, goal=1.5)


def _time_to_serve(node: str) -> float:
    """Start a node and return the time to its first answer [s].

    Who asks has just joined the domain, too. A participant makes itself known when it joins, and
    each 0.1 s for half a second, and then each second; where an old one asked, many starts waited
    for that.
    """
    with session() as running:
        client = running.node.create_client(ListParameters, f"{NAMESPACE}/{node}/list_parameters")
        begin = time.monotonic()
        if node == BARE:
            running.start_bare(node, NAMESPACE)
        else:
            running.start_node(node, NAMESPACE)
        running.spin_until(client.service_is_ready, f"{node} to be found", POLL_TIME)
        while True:
            answer = client.call_async(ListParameters.Request())
            asked = time.monotonic()
            running.spin_until(
                lambda: answer.done() or time.monotonic() > asked + RETRY_TIME,  # noqa: B023
                "an answer",
            )
            if answer.done():
                return time.monotonic() - begin
