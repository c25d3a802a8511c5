"""How soon after a path is sent the machine moves, and whether a long one makes cycles late.

Paths of one segment, of many and of very many, as a CAM program writes them, take turns on real
nodes.
"""

import math
import time
from array import array
from typing import NamedTuple

import numpy as np

from benchmarks.soak_nodes import context_in_own_domain, session
from benchmarks.table import print_lines
from testing.goals import GoalClient
from testing.machine import Machine

ROUNDS = 10
SEGMENTS = (1, 10_000, 200_000)
STEP = 1e-4  # m, length of a segment of the long paths
RATE = 500.0  # 1/s
LATE = 1.5  # periods
START = (0.0, 0.0, 0.3)  # m
MOVES = 1e-9  # m, by which a setpoint differs from that at rest


class Begin(NamedTuple):
    """What one path did.

    Attributes:
        delay: from when it was sent to its first setpoint [s].
        late: setpoints that came late meanwhile.
        cycles: setpoints that came meanwhile.
        longest: time between two setpoints meanwhile [s].
    """

    delay: float
    late: int
    cycles: int
    longest: float


def run() -> bool:
    """Measure and print the table; it is always complete."""
    paths = [circle(count) for count in SEGMENTS]
    found: dict[int, list[Begin]] = {count: [] for count in SEGMENTS}
    with context_in_own_domain() as context, session(context, "goals") as (client, launcher):
        machine = Machine(client, launcher).start({"rate": RATE})
        goals = GoalClient(client)
        for _ in range(ROUNDS):
            for path in paths:
                found[len(path)].append(begin(machine, goals, path))
        goals.close()
    rows = [("segments", "first setpoint after", "5 to 95 %", "late cycles", "longest gap")]
    for count, begins in found.items():
        delays = 1e3 * np.array([each.delay for each in begins])
        low, high = np.quantile(delays, (0.05, 0.95))
        rows.append(
            (
                f"{count:,}",
                f"{np.median(delays):.1f} ms",
                f"{low:.1f} to {high:.1f} ms",
                f"{sum(each.late for each in begins)} of {sum(each.cycles for each in begins)}",
                f"{1e3 * max(each.longest for each in begins):.1f} ms",
            )
        )
    return print_lines(rows)


def circle(count: int) -> list[tuple[float, float, float]]:
    """Return the points of segments on a circle, the last one away from the first."""
    radius = 0.05
    angles = np.arange(1, count + 1) * STEP / radius
    away = 0.05 if count == 1 else 0.0
    return [
        (START[0] + radius * math.sin(a) + away, START[1] + radius * (1.0 - math.cos(a)), START[2])
        for a in angles.tolist()
    ]


def begin(machine: Machine, goals: GoalClient, path: list[tuple[float, float, float]]) -> Begin:
    """Send a path from rest at its start, and cancel it once the machine has moved a while."""
    numbers = array("d", np.ravel(path))
    client = machine.client
    goals.move_to(START).result()
    client.spin_for(0.3)
    machine.commands.clear()
    client.wait_for(lambda: machine.commands, "a setpoint")
    rest = tuple(machine.commands[-1].position)
    running = goals.follow(path, numbers=numbers, tolerances=[1e-4])
    sent = client.now() - int(1e9 * (time.monotonic() - running.sent))

    def has_moved() -> bool:
        return math.dist(machine.commands[-1].position, rest) > 1e-4

    client.wait_for(has_moved, "a motion")
    client.spin_for(0.3)
    running.cancel()
    running.result()
    stamps = np.array([client.time_of(message) for message in machine.commands])
    heights = np.array([message.position for message in machine.commands])
    moved = np.abs(heights - rest).max(axis=1) > MOVES
    first = int(np.argmax(moved & (stamps > sent)))
    since = int(np.searchsorted(stamps, sent))
    gaps = 1e-9 * np.diff(stamps[since - 1 : first + 50])
    late = int((gaps > LATE / RATE).sum())
    return Begin(1e-9 * float(stamps[first] - sent), late, len(gaps), gaps.max())
