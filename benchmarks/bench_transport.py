"""What it costs to do without shared memory: latency and processor time of a running machine."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import partial

from benchmarks.harness import Figure, Missing, NoAnswerError, attempt, figure, in_turn
from benchmarks.transport_probe import AGE, LOAD
from tri_glide_kinematics.ros.starting import CELL, COMPUTER, MIDDLEWARE_VARIABLES, RANGE, VARIABLE

ROUNDS = 4
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
        [sys.executable, "-m", "benchmarks.transport_probe"],
        env={**inherited, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    if run.returncode:
        raise NoAnswerError(run.stderr.strip())
    result: dict[str, float] = json.loads(run.stdout)
    return result
