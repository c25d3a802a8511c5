"""How the nodes grow: steps of a trace by service, and machines on one computer."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from std_srvs.srv import Trigger

from benchmarks.bench_cycle import TARGETS
from benchmarks.bench_services import (
    f_mechanism_request,
    four_bar_request,
    mean_time,
    service_name,
)
from benchmarks.harness import Missing, NoAnswerError
from benchmarks.ros_session import Session, session
from tri_glide_interfaces.srv import TraceFMechanism, TraceFourBar

MOST_STEPS = {TraceFourBar: 100_000, TraceFMechanism: 100_000}  # that a request may ask for
REQUESTS: dict[type, Callable[[int], object]] = {
    TraceFourBar: four_bar_request,
    TraceFMechanism: f_mechanism_request,
}
MACHINES = 8  # at most
MACHINES_IN_ONE_PROCESS = 5  # at most
MACHINE_TIME = 5.0  # s of motion that are judged
TARGET_PERIOD = 0.5  # s
LATE = "late cycles in the last second"
RATE = "loop rate [1/s]"


class ServiceGrowth(NamedTuple):
    """One curve: what a call took for each number of steps.

    Attributes:
        name: of the service.
        steps: of the trace.
        times: of the call [s].
    """

    name: str
    steps: list[int]
    times: list[float]


class MachineLoad(NamedTuple):
    """What ``ik_node`` says of its loop while several machines move on this computer.

    Attributes:
        machines: number of them.
        late: late cycles per second of each machine.
        rates: cycles per second of each machine.
    """

    machines: int
    late: list[float]
    rates: list[float]


def _start_machine(running: Session, namespace: str, one_process: bool) -> None:
    if one_process:
        running.start_module("benchmarks.one_process", [], "one_process", namespace)
        return
    for node in ("simulator_node", "ik_node", "fk_node"):
        running.start_node(node, namespace)


def services() -> Iterator[ServiceGrowth | Missing]:
    """Measure an empty call, which has no steps, and both traces."""
    curves: dict[str, Callable[[], ServiceGrowth]] = {"empty call": _empty_call}
    curves.update({service_name(kind): partial(_trace, kind) for kind in MOST_STEPS})
    for name, measure in curves.items():
        try:
            yield measure()
        except NoAnswerError as error:
            yield Missing(name, str(error), is_failure=True)


def _empty_call() -> ServiceGrowth:
    with session() as running:
        running.start_bare("server", "/bare")
        empty = running.probe.create_client(Trigger, "/bare/server/trigger")
        running.spin_until(empty.service_is_ready, "the bare server")
        mean_time(running, empty, Trigger.Request(), 50)
        return ServiceGrowth("empty call", [0], [mean_time(running, empty, Trigger.Request(), 200)])


def _trace(kind: type) -> ServiceGrowth:
    name = service_name(kind)
    growth = ServiceGrowth(name, [], [])
    with session() as running:
        running.start_node("mechanism_node", "/ours")
        client = running.probe.create_client(kind, f"/ours/mechanism_node/{name}")
        running.spin_until(client.service_is_ready, name)
        steps = 10
        mean_time(running, client, REQUESTS[kind](steps), 5)
        while steps <= MOST_STEPS[kind]:
            calls = max(1, min(50, 50_000 // steps))
            growth.steps.append(steps)
            growth.times.append(mean_time(running, client, REQUESTS[kind](steps), calls))
            steps *= 10
    return growth


def machines(most: int = MACHINES, one_process: bool = False) -> Iterator[MachineLoad | Missing]:
    """Move machines, up to so many, if they start, each with its nodes in its namespace.

    More than a computer can start end the curve; one machine it has to start.

    Args:
        most: number of machines.
        one_process: whether the nodes of a machine are threads of one process, and not processes.
    """
    for count in range(1, most + 1):
        with session() as running:
            reports: dict[str, list[tuple[float, float]]] = defaultdict(list)

            def on_diagnostics(message: DiagnosticArray) -> None:
                for status in message.status:
                    values = {entry.key: entry.value for entry in status.values}
                    if LATE in values:
                        report = (float(values[LATE]), float(values[RATE]))
                        reports[status.name].append(report)  # noqa: B023

            running.probe.create_subscription(DiagnosticArray, "/diagnostics", on_diagnostics, 100)
            publishers = []
            for number in range(count):
                _start_machine(running, f"/machine_{number}", one_process)
                topic = f"/machine_{number}/target_pose"
                publishers.append(running.probe.create_publisher(PoseStamped, topic, 10))
            try:
                running.spin_until(
                    lambda: len(reports) == count,  # noqa: B023
                    "diagnostics of each machine",
                )
            except NoAnswerError as error:
                yield Missing(f"{count} machines", str(error), is_failure=count == 1)
                return
            running.spin_for(3.0)
            reports.clear()
            for index in range(int(MACHINE_TIME / TARGET_PERIOD)):
                message = PoseStamped()
                point = message.pose.position
                point.x, point.y, point.z = TARGETS[index % len(TARGETS)]
                for publisher in publishers:
                    publisher.publish(message)
                running.spin_for(TARGET_PERIOD)
            means = [np.mean(values, axis=0) for _, values in sorted(reports.items())]
        late, rates = ([float(mean[column]) for mean in means] for column in (0, 1))
        yield MachineLoad(count, late, rates)
