"""How long a node takes from the start of its process until it answers a service call."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from rcl_interfaces.srv import ListParameters

from benchmarks.harness import Figure, figure
from benchmarks.ros_session import Session, session

ROUNDS = 15
# In some of the starts, of whichever node, the middleware finds the other side only when it looks
# again after 3 s; which of them is chance. The faster half of each side has none of these.
COUNTED = 8
NODES = ("ik_node", "fk_node", "simulator_node", "mechanism_node")
RETRY_TIME = 0.2  # s: a call can get lost while two nodes are still finding each other


def figures() -> Iterator[Figure]:
    """Start each node and a bare one in turn."""
    with session() as running:

        def bare() -> float:
            return _time_to_serve(running, "bare", lambda name: running.start_bare("bare", name))

        for node in NODES:

            def ours(node: str = node) -> float:
                return _time_to_serve(running, node, lambda name: running.start_node(node, name))

            times: tuple[list[float], list[float]] = ([], [])
            for index in range(-1, ROUNDS):  # the first is for warming up
                for side in (0, 1) if index % 2 else (1, 0):
                    taken = (ours, bare)[side]()
                    if index >= 0:
                        times[side].append(taken)
            ours_fastest, bare_fastest = (sorted(side)[:COUNTED] for side in times)
            yield figure(
                f"start of {node} until it serves",
                "rclpy.init() and one bare node",
                ours_fastest,
                bare_fastest,
                1.5,
            )


def _time_to_serve(running: Session, node: str, start: Callable[[str], int]) -> float:
    """Start a node in a namespace of its own and return the time to its first answer [s]."""
    namespace = f"/started_{time.monotonic_ns()}"
    client = running.probe.create_client(ListParameters, f"{namespace}/{node}/list_parameters")
    begin = time.monotonic()
    start(namespace)
    running.spin_until(client.service_is_ready, f"{node} to be found")
    answered = 0.0
    while not answered:
        answer = client.call_async(ListParameters.Request())
        asked = time.monotonic()
        running.spin_until(
            lambda: answer.done() or time.monotonic() > asked + RETRY_TIME,  # noqa: B023
            "an answer",
        )
        answered = time.monotonic() if answer.done() else 0.0
    running.stop()
    running.probe.destroy_client(client)
    return answered - begin
