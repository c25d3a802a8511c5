"""What a client that ends without a clean shutdown does to the stream of commands."""

from __future__ import annotations

import heapq
import itertools
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from node_harness import Client, Machine
from sensor_msgs.msg import JointState

ENDED_CLIENT = Path(__file__).with_name("ended_client.py")
WAYS = {"exit": 0, "kill": -signal.SIGKILL}  # how a client ends, and its exit code then


class Stream:
    """The stamps of a machine's commands: times of the publisher, whenever they are heard."""

    def __init__(self, machine: Machine) -> None:
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
    stream.start()
    end = time.monotonic() + seconds
    machine.client.wait_for(lambda: time.monotonic() > end, "the end", seconds + 1.0)
    return stream.longest_gaps()


def gaps_beside_ends(machine: Machine, stream: Stream, way: str, count: int) -> list[float]:
    """Return the longest gaps in the commands [s] while ``count`` clients end one by one."""
    stream.start()
    for _ in range(count):
        _end_a_client(machine, way)
    return stream.longest_gaps()


def _end_a_client(machine: Machine, way: str) -> None:
    role = "exit" if way == "exit" else "wait"
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(
            [sys.executable, str(ENDED_CLIENT), machine.namespace, role],
            stdout=output,
            stderr=subprocess.STDOUT,
        )

        def said() -> str:
            output.seek(0)
            return output.read()

        try:
            if way == "kill":
                machine.client.wait_for(lambda: "answered" in said(), "an answer to a client")
                process.kill()
            machine.client.wait_for(lambda: process.poll() is not None, "the end of a client")
        finally:
            process.kill()
            process.wait()
        assert "answered" in said(), said()
        assert process.returncode == WAYS[way], said()
