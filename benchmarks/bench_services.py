"""A trace of a mechanism asked for by service, beside an empty service call."""

import math
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from rclpy.client import Client
from std_srvs.srv import Trigger

from benchmarks.bench_mechanisms import CRANK_VELOCITY, LENGTHS, example_2, full_turn_pose
from benchmarks.harness import Figure, Missing, attempt, figure, in_turn
from benchmarks.ros_session import Session, session
from tri_glide_interfaces.msg import CrankSweep, Point2
from tri_glide_interfaces.msg import FMechanism as FMechanismMessage
from tri_glide_interfaces.srv import TraceFMechanism, TraceFourBar

ROUNDS = 30
CALLS = 10  # in one round, each way
STEPS = 360
EMPTY_CALL = "empty call, std_srvs/Trigger, between bare nodes"


def figures() -> Iterator[Figure | Missing]:
    """Ask our server and a bare one in turn."""
    for mechanism, name, goal in (
        ("four-bar", "trace_four_bar", 10.0),
        ("F-mechanism", "trace_f_mechanism", 50.0),
    ):
        what = f"{mechanism} trace of {STEPS} steps by service"
        yield attempt(what, partial(_compared, what, name, goal))


def _compared(what: str, name: str, goal: float) -> Figure:
    kind, request_of = TRACES[name]
    request = request_of(STEPS)
    with session() as running:
        running.start_node("mechanism_node", "/ours")
        running.start_bare("server", "/bare")
        empty = running.node.create_client(Trigger, "/bare/server/trigger")
        client = running.node.create_client(kind, f"/ours/mechanism_node/{name}")
        running.spin_until(lambda: client.service_is_ready() and empty.service_is_ready(), name)
        times = in_turn(
            ROUNDS,
            lambda: mean_time(running, client, request, CALLS),
            lambda: mean_time(running, empty, Trigger.Request(), CALLS),
        )
    return figure(what, EMPTY_CALL, *times, goal)


def mean_time(running: Session, client: Client, request: Any, calls: int) -> float:
    """Return how long a call takes until its answer is here [s]."""
    begin = time.monotonic()
    for _ in range(calls):
        answer = client.call_async(request)
        running.spin_until(answer.done, "an answer")
        if not answer.result().success:
            raise RuntimeError(f"the request was refused: {answer.result().message}")
    return (time.monotonic() - begin) / calls


def four_bar_request(steps: int) -> TraceFourBar.Request:
    """Return the request for one turn of the textbook four-bar."""
    request = TraceFourBar.Request(sweep=_one_turn(steps), crank_velocity=CRANK_VELOCITY)
    linkage = request.linkage
    linkage.crank, linkage.coupler, linkage.rocker, linkage.ground = LENGTHS
    return request


def f_mechanism_request(steps: int) -> TraceFMechanism.Request:
    """Return the request for one turn of the second example of source 001."""
    mechanism = example_2()
    linkage = mechanism.linkage
    return TraceFMechanism.Request(
        mechanism=FMechanismMessage(
            base=[_point(pivot) for pivot in linkage.pivots],
            crank_lengths=linkage.cranks,
            rod_lengths=linkage.rods,
            platform=[_point(joint) for joint in linkage.joints],
            phase_b=mechanism.phase_b,
            phase_c=mechanism.phase_c,
            counter_rotating=mechanism.counter_rotating,
        ),
        sweep=_one_turn(steps),
        start_by=TraceFMechanism.Request.BY_ANGLE,
        pose_angle=full_turn_pose(mechanism).angle,
    )


def _one_turn(steps: int) -> CrankSweep:
    return CrankSweep(start_angle=0.0, end_angle=math.tau, steps=steps)


def _point(number: complex) -> Point2:
    return Point2(x=number.real, y=number.imag)


# Of each service its type, and what makes a request of so many steps.
TRACES: dict[str, tuple[type, Callable[[int], Any]]] = {
    "trace_four_bar": (TraceFourBar, four_bar_request),
    "trace_f_mechanism": (TraceFMechanism, f_mechanism_request),
}
