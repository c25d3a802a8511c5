"""What a client that ends without a clean shutdown does to the control cycle."""

from __future__ import annotations

import heapq
import os
import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray

from testing import calling_client
from testing.calling_client import EXIT, KILL
from testing.client import Client, values_of
from testing.machine import Machine

MOST_OUTPUT = 100_000  # bytes of a client that are looked at
TOGETHER = 4  # clients at a time
WAYS = {EXIT: 0, KILL: -signal.SIGKILL}  # how a client ends, and its exit code then


def run_in_real_time(pid: int, main: int = 20) -> bool:
    """Put a process before all others, if that is allowed here, and its main thread first.

    Then a delay of its cycle is made by the middleware, not by who wants a processor, be it
    another process or the threads that deal with several new clients at once.

    Args:
        pid: number of the process.
        main: priority of the main thread; that of the others is 10.
    """
    try:
        for task in Path(f"/proc/{pid}/task").iterdir():
            priority = main if task.name == str(pid) else 10
            os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        return False
    return True


class Delays:
    """The largest delay of a control cycle in each second, as ``ik_node`` itself measures it.

    A listener that waits for a processor loses commands: their stamps would show its gaps.
    """

    def __init__(self, machine: Machine) -> None:
        """Listen to the diagnostics of the ``machine``."""
        self._client: Client = machine.client
        self._delays: list[float] = []
        topic, callback = "/diagnostics", self._hear
        machine.client.node.create_subscription(DiagnosticArray, topic, callback, 100)

    def _hear(self, message: DiagnosticArray) -> None:
        for status in self._client.statuses([message]):
            self._delays.append(float(values_of(status)["largest delay of a cycle [s]"]))

    def start(self) -> None:
        """Forget what was heard, and wait for the end of the second."""
        self._wait_for_more()
        self._delays.clear()

    def largest(self) -> list[float]:
        """Return the five largest delays until now [s], the largest first; of different seconds."""
        self._wait_for_more()
        return heapq.nlargest(5, self._delays)

    def _wait_for_more(self) -> None:
        count = len(self._delays)
        self._client.wait_for(lambda: len(self._delays) > count, "diagnostics of ik_node")


def delays_alone(machine: Machine, delays: Delays, seconds: float) -> list[float]:
    """Return the largest delays of a cycle [s] while nothing happens."""
    delays.start()
    machine.client.spin_for(seconds)
    return delays.largest()


def delays_beside_ends(machine: Machine, delays: Delays, way: str, count: int) -> list[float]:
    """Return the largest delays of a cycle [s] while ``count`` clients end, a few at a time."""
    delays.start()
    for first in range(0, count, TOGETHER):
        with ExitStack() as stack:
            clients = [
                stack.enter_context(EndingClient(machine.namespace, way))
                for _ in range(min(TOGETHER, count - first))
            ]
            machine.client.wait_for(partial(_have_ended, clients), "the end of clients")
    return delays.largest()


def _have_ended(clients: list[EndingClient]) -> bool:
    return all([client.has_ended() for client in clients])


class EndingClient:
    """A process that asks ``ik_node`` for a parameter, and ends in one of the ways."""

    def __init__(self, namespace: str, way: str) -> None:
        """Start it for the ``ik_node`` in a ``namespace``; the ``way`` is one of ``WAYS``."""
        self._way = way
        self._output = tempfile.TemporaryFile()
        arguments = [way, f"{namespace}/ik_node", "0", "get_parameters"]
        self._process = subprocess.Popen(
            [sys.executable, calling_client.__file__, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
        )

    def has_ended(self) -> bool:
        """Kill it as soon as it has its answer, if it is to be killed; tell whether it is gone."""
        # Not by seeking: the process writes where this file is at.
        output = os.pread(self._output.fileno(), MOST_OUTPUT, 0).decode()
        if self._way == KILL and "true" in output:
            self._process.kill()
        if self._process.poll() is None:
            return False
        assert self._process.returncode == WAYS[self._way] and "true" in output, output
        return True

    def __enter__(self) -> EndingClient:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it for certain."""
        self._process.kill()
        self._process.wait()
        self._output.close()
