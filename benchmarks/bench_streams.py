"""Whether streams of commands disturb the cycle of ``ik_node``: by when its setpoints are sent.

Each kind of command is compared with the same node while nothing is commanded, in turn.
"""

import math
import random
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from benchmarks.harness import Missing, attempt
from benchmarks.ros_session import Session, session
from benchmarks.table import print_lines
from testing.client import Client, Probe
from testing.taking import taken_as_sent

RATES = (500.0, 1000.0)  # 1/s
ROUNDS = 3
ROUND_TIME = 4.0  # s
PAUSE = 0.001  # s between two looks at what has come in
LATE = 1.5  # periods
TURNS = 0.5  # of a twist, per second
SPEED = 0.1  # m/s
HEIGHT = 0.25  # m
RADIUS = 0.03  # m

HEAD = ("commanded", "cycles a second", "idle", "late", "idle", "longest gap", "reached")
# What is to be reached: part of the commands of the idle node, and late cycles more than it has.
GOALS = {500.0: (0.995, 0.005), 1000.0: (0.99, 0.01)}


@dataclass
class Stream:
    """Setpoints under one kind of command.

    Attributes:
        what: is commanded.
        rate: of the node [1/s].
        cycles: setpoints a second, in each round.
        late: part of them that came late, in each round.
        longest: time between two of them [s].
    """

    what: str
    rate: float
    cycles: list[float] = field(default_factory=list)
    late: list[float] = field(default_factory=list)
    longest: float = 0.0

    def add(self, stamps: list[float]) -> None:
        """Add a round, by the times of its setpoints [s]."""
        intervals = np.diff(stamps)
        self.cycles.append(len(intervals) / (stamps[-1] - stamps[0]))
        self.late.append(float(np.mean(intervals > LATE / self.rate)))
        self.longest = max(self.longest, float(intervals.max()))


Command = Callable[[float], Any]


class Commander:
    """A node that sends commands and takes in setpoints, without an executor.

    Attributes:
        has_heard: whether setpoints come.
    """

    def __init__(self, node: Node) -> None:
        """Listen with ``node``, and send as a client beside it."""
        self._client = Client(node.context, "/")
        self._setpoints = node.create_subscription(
            JointState, "joint_commands", self._hear, QoSProfile(depth=5000)
        )
        self.has_heard = False
        self._limits = AsyncParameterClient(node, "ik_node")
        self._chance = random.Random(3)

    def _hear(self, _: JointState) -> None:
        self.has_heard = True

    def stamps(self) -> list[float]:
        """Return the times of the setpoints that have come in [s]."""
        return [1e-9 * Probe.time_of(message) for message in taken_as_sent(self._setpoints)]

    def nothing(self, _: float) -> None:
        """Send nothing."""

    def twist(self, now: float) -> None:
        """Send a twist that turns."""
        angle = 2.0 * math.pi * TURNS * now
        self._client.send_twist((SPEED * math.cos(angle), SPEED * math.sin(angle), 0.0))

    def pose(self, now: float) -> None:
        """Send a place on a circle."""
        angle = 2.0 * math.pi * TURNS * now
        self._client.send_pose((RADIUS * math.cos(angle), RADIUS * math.sin(angle), HEIGHT))

    def random_pose(self, _: float) -> None:
        """Send a place anywhere."""
        x, y = self._chance.uniform(-0.07, 0.07), self._chance.uniform(-0.07, 0.07)
        self._client.send_pose((x, y, self._chance.uniform(0.15, 0.3)))

    def state(self, now: float) -> None:
        """Send the state of a target that moves on a circle."""
        rate = 2.0 * math.pi * TURNS
        x, y = RADIUS * math.cos(rate * now), RADIUS * math.sin(rate * now)
        self._client.send_state((x, y, HEIGHT), (-rate * y, rate * x, 0.0))

    def limits(self, now: float) -> None:
        """Set other limits, in the middle of moves."""
        if self._chance.random() < 0.2:
            self.random_pose(now)
        scale = self._chance.uniform(0.3, 1.0)
        self._limits.set_parameters([Parameter("speed_scale", value=scale)])

    def close(self) -> None:
        """Send no more."""
        self._client.close()


class Kind(NamedTuple):
    """A kind of command.

    Attributes:
        what: is commanded.
        method: of ``Commander`` that does it.
        interval: how often [s].
        shaped: whether the node has a shaper, also while nothing is commanded.
    """

    what: str
    method: str
    interval: float
    shaped: bool = False


# Parameters of the node.
SHAPER: dict[str, object] = {"shaper": "ei", "mode_frequencies": [15.0], "mode_dampings": [0.03]}

KINDS = (
    Kind("a turning twist every 10 ms", "twist", 0.01),
    Kind("a turning twist every 4 ms", "twist", 0.004),
    Kind("poses on a circle every 10 ms", "pose", 0.01),
    Kind("a moving target every 10 ms", "state", 0.01),
    Kind("10 random poses a second", "random_pose", 0.1),
    Kind("live limits 10 times a second", "limits", 0.1),
    Kind("a moving target every 10 ms, EI for a mode of 15 Hz", "state", 0.01, shaped=True),
    Kind("10 random poses a second, EI for a mode of 15 Hz", "random_pose", 0.1, shaped=True),
)


def run() -> bool:
    """Measure and print the table; return whether it is complete."""
    rows = list(streams())
    print_lines([HEAD, *map(_cells, rows)])
    return not any(isinstance(row, Missing) for row in rows)


def streams() -> Iterator[tuple[Stream, Stream] | Missing]:
    """Yield for each kind of command the node under it, and idle."""
    for rate in RATES:
        for kind in KINDS:
            yield attempt(kind.what, partial(_measured, rate, kind))


def _measured(rate: float, kind: Kind) -> tuple[Stream, Stream]:
    idle, busy = Stream("nothing", rate), Stream(kind.what, rate)
    with session() as running, closing(Commander(running.node)) as commander:
        running.start_node("simulator_node", "/")
        running.start_node("ik_node", "/", rate=rate, **(SHAPER if kind.shaped else {}))
        running.spin_until(lambda: commander.has_heard, "the nodes")
        command = getattr(commander, kind.method)
        for _ in range(ROUNDS):
            idle.add(_drive(running, commander, commander.nothing, kind.interval))
            busy.add(_drive(running, commander, command, kind.interval))
    return busy, idle


def _drive(
    running: Session, commander: Commander, command: Command, interval: float
) -> list[float]:
    """Send commands for a round; return the times of the setpoints meanwhile [s]."""
    begin = due = time.monotonic()
    commander.stamps()
    stamps: list[float] = []
    while (now := time.monotonic()) < begin + ROUND_TIME:
        if now >= due:
            command(now)
            due += interval
        stamps += commander.stamps()
        time.sleep(PAUSE)
    if len(stamps) < 2:
        raise running.no_answer(f"{len(stamps)} setpoints in {ROUND_TIME:g} s")
    return stamps


def _cells(row: tuple[Stream, Stream] | Missing) -> tuple[str, ...]:
    if isinstance(row, Missing):
        return (f"{row.what}: {row.reason}", "-", "-", "-", "-", "-", "not measured")
    busy, idle = row
    least, more = GOALS[busy.rate]
    cycles, cycles_idle = np.median(busy.cycles), np.median(idle.cycles)
    late, late_idle = np.median(busy.late), np.median(idle.late)
    reached = cycles >= least * cycles_idle and late <= late_idle + more
    return (
        f"{busy.what}, at {busy.rate:g} Hz",
        f"{cycles:.1f}",
        f"{cycles_idle:.1f}",
        f"{late:.2%}",
        f"{late_idle:.2%}",
        f"{1000.0 * busy.longest:.3g} ms ({1000.0 * idle.longest:.3g})",
        "yes" if reached else "NO",
    )
