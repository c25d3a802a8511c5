"""What a client that ends without a clean shutdown does to the stream of commands."""

from __future__ import annotations

import heapq
import itertools
import os
import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from sensor_msgs.msg import JointState

from testing.client import Client
from testing.machine import Machine

ENDED_CLIENT = Path(__file__).with_name("ended_client.py")
TOGETHER = 8  # clients at a time
WAYS = {"exit": 0, "kill": -signal.SIGKILL}  # how a client ends, and its exit code then


def run_in_real_time(pid: int) -> bool:
    """Put a process before all others, if that is allowed here.

    Then a gap in what it publishes is made by the middleware, not by others that want a processor.
    """
    try:
        for task in Path(f"/proc/{pid}/task").iterdir():
            os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(10))
    except PermissionError:
        return False
    return True


class Stream:
    """The stamps of a machine's commands: times of the publisher, whenever they are heard."""

    def __init__(self, machine: Machine) -> None:
        """Listen to the commands of the ``machine``."""
        self._client: Client = machine.client
        self._stamps: list[int] = []
        topic = f"{machine.namespace}/joint_commands"
        machine.client.node.create_subscription(JointState, topic, self._hear, 5000)

    def _hear(self, message: JointState) -> None:
        self._stamps.append(self._client.time_of(message))

    def start(self) -> None:
        """Forget what was heard, and wait for the next command."""
        self._stamps.clear()
        self._client.wait_for(lambda: self._stamps, "a command")

    def longest_gaps(self) -> list[float]:
        """Return the five longest times between two commands until now [s], the longest first."""
        now = self._client.now()
        self._client.wait_for(lambda: self._stamps[-1] >= now, "a command of this moment")
        gaps = (1e-9 * (after - before) for before, after in itertools.pairwise(self._stamps))
        return heapq.nlargest(5, gaps)


def gaps_alone(machine: Machine, stream: Stream, seconds: float) -> list[float]:
    """Return the longest gaps in the commands while nothing happens [s]."""
    machine.client.spin_for(seconds)
    return stream.longest_gaps()


def gaps_beside_ends(machine: Machine, stream: Stream, way: str, count: int) -> list[float]:
    """Return the longest gaps in the commands [s] while ``count`` clients end, a few at a time."""
    stream.start()
    for first in range(0, count, TOGETHER):
        with ExitStack() as stack:
            clients = [
                stack.enter_context(EndingClient(machine.namespace, way))
                for _ in range(min(TOGETHER, count - first))
            ]
            machine.client.wait_for(partial(_have_ended, clients), "the end of clients")
    return stream.longest_gaps()


def _have_ended(clients: list[EndingClient]) -> bool:
    # Each has to be asked, as that is what ends it.
    return all([client.has_ended() for client in clients])


class EndingClient:
    """A process that asks ``ik_node`` for a parameter, and ends in one of the ways."""

    def __init__(self, namespace: str, way: str) -> None:
        """Start the process beside the machine in ``namespace``."""
        self._way = way
        self._output = tempfile.TemporaryFile("w+")
        role = "exit" if way == "exit" else "wait"
        self._process = subprocess.Popen(
            [sys.executable, str(ENDED_CLIENT), namespace, role],
            stdout=self._output,
            stderr=subprocess.STDOUT,
        )

    def has_ended(self) -> bool:
        """Kill it as soon as it has its answer, if it is to be killed; tell whether it is gone."""
        self._output.seek(0)
        output = self._output.read()
        if self._way == "kill" and "answered" in output:
            self._process.kill()
        if self._process.poll() is None:
            return False
        assert self._process.returncode == WAYS[self._way], output
        return True

    def __enter__(self) -> EndingClient:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process for certain."""
        self._process.kill()
        self._process.wait()
        self._output.close()
