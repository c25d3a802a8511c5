"""What it costs to do without shared memory: latency and processor time of a running machine.

``python -m benchmarks.bench_transport`` measures the transport of its own process. It prints one
JSON object: the median age of a command of ``ik_node`` when it is heard [s], and the processor time
that ``ik_node`` and ``simulator_node`` take per second [s].
"""

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

from benchmarks.harness import Figure, Missing, NoAnswerError, attempt, figure, in_turn
from benchmarks.machine import processor_time
from benchmarks.ros_session import session
from tri_glide_kinematics.ros.starting import CELL, COMPUTER, MIDDLEWARE_VARIABLES, RANGE, VARIABLE

ROUNDS = 4
WARM_UP_TIME = 2.0  # s
TIME = 5.0  # s
AGE, LOAD = "age", "load"
SHARED_MEMORY = {RANGE: "LOCALHOST"}  # where rmw_fastrtps adds it
REFERENCE = "shared memory"
MEASURED = {
    AGE: "a command from ik_node to a listener",
    LOAD: "CPU time per second of simulator_node and ik_node at 500 Hz",
}


def figures() -> Iterator[Figure | Missing]:
    """Measure each transport and shared memory in turn."""
    for name in (COMPUTER, CELL):
        rounds: dict[str, tuple[list[float], list[float]]] = {}
        # Each round gives a latency and a load: the second row has the rounds of the first.
        for what in MEASURED:
            title = f"transport {name}: {MEASURED[what]}"
            yield attempt(title, partial(_compared, title, what, name, rounds))


def _compared(
    title: str, what: str, name: str, rounds: dict[str, tuple[list[float], list[float]]]
) -> Figure:
    if not rounds:
        measured = in_turn(
            ROUNDS, lambda: _probe({VARIABLE: name}), lambda: _probe(SHARED_MEMORY), warm_up=0
        )
        for key in MEASURED:
            ours, theirs = ([result[key] for result in results] for results in measured)
            rounds[key] = (ours, theirs)
    return figure(title, REFERENCE, *rounds[what])


def _probe(variables: dict[str, str]) -> dict[str, float]:
    """Measure in a process of its own: Fast DDS reads its profiles only once."""
    inherited = {key: value for key, value in os.environ.items() if key not in MIDDLEWARE_VARIABLES}
    inherited.pop(VARIABLE, None)
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.bench_transport"],
        env={**inherited, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    if run.returncode:
        raise NoAnswerError(run.stderr.strip())
    result: dict[str, float] = json.loads(run.stdout)
    return result


def main() -> int:
    """Measure, and print the result."""
    ages: list[float] = []

    # rclpy gives what the middleware knows to whoever takes it.
    def hear(_: JointState, info: Any) -> None:
        ages.append(1e-9 * (time.time_ns() - info["source_timestamp"]))

    with session() as running:
        pids = [running.start_node(name, "/probed") for name in ("simulator_node", "ik_node")]
        running.node.create_subscription(
            JointState,
            "/probed/joint_commands",
            hear,  # type: ignore[arg-type]
            qos_profile_sensor_data,
        )
        try:
            running.spin_until(lambda: ages, "commands")
        except NoAnswerError as error:
            print(error, file=sys.stderr)
            return 1
        running.spin_for(WARM_UP_TIME)
        ages.clear()
        begin, before = time.monotonic_ns(), sum(map(processor_time, pids))
        running.spin_for(TIME)
        load = (sum(map(processor_time, pids)) - before) / (time.monotonic_ns() - begin)
    print(json.dumps({AGE: statistics.median(ages), LOAD: load}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
