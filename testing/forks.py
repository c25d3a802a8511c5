"""Nodes as forks of one process that has imported them, for tests that start hundreds of them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from multiprocessing import Pipe
from pathlib import Path

from testing.fork_server import Job
from tri_glide_kinematics.ros.starting import NodeProcesses, Process, executable


class ForkServer:
    """The process that forks; it ends with this one."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        """Start it with the ``environment`` in which it finds its modules."""
        self._connection, its = Pipe()
        self._codes: dict[int, int] = {}
        with its:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "testing.fork_server", str(its.fileno())],
                pass_fds=[its.fileno()],
                stdin=subprocess.DEVNULL,
                env=environment,
                start_new_session=True,
            )

    def start(self, job: Job) -> Fork:
        """Start a fork, and return it."""
        self._connection.send(tuple(job))
        while True:
            message = self._connection.recv()
            if isinstance(message, int):
                return Fork(self, message, job.command)
            self._take(*message)

    def code_of(self, pid: int, timeout: float | None) -> int | None:
        """Return the exit code of a fork; None if it still runs after ``timeout`` seconds."""
        end = None if timeout is None else time.monotonic() + timeout
        while pid not in self._codes:
            left = None if end is None else max(end - time.monotonic(), 0.0)
            try:
                if not self._connection.poll(left):
                    return None
                self._take(*self._connection.recv())
            except (EOFError, OSError):
                # The server is gone, and its forks with it.
                _server.cache_clear()
                self._take(pid, -signal.SIGKILL)
        return self._codes[pid]

    def _take(self, pid: int, code: int) -> None:
        self._codes[pid] = code


class Fork:
    """One node; it has those methods of a subprocess.Popen that are used here."""

    def __init__(self, server: ForkServer, pid: int, command: Sequence[str]) -> None:
        """Watch the process ``pid`` of a ``server``."""
        self.pid = pid
        self.args = command
        self.returncode: int | None = None
        self._server = server

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""
        return self._look(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end, for at most ``timeout`` seconds, and return the exit code."""
        code = self._look(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
        return code

    def send_signal(self, number: int) -> None:
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill it, unless it has ended."""
        self.send_signal(signal.SIGKILL)

    def _look(self, timeout: float | None) -> int | None:
        if self.returncode is None:
            self.returncode = self._server.code_of(self.pid, timeout)
        return self.returncode


class ForkedNodes(NodeProcesses):
    """Processes of nodes, of which those of this package, and modules, are forks."""

    def start_command(self, command: Sequence[str], log: Path | None = None) -> Process:
        """Start a node by its whole ``command``; ``log`` as for ``start``."""
        if command[1:2] != ["-m"] and Path(command[0]).parent != executable("ik_node").parent:
            return super().start_command(command, log)
        server = _server(self._environment["PYTHONPATH"])
        if log is not None:
            # Somebody may read it before the fork writes.
            log.touch()
        fork = server.start(Job(tuple(command), self._environment, str(log) if log else None))
        self._processes.append(fork)
        return fork


@cache
def _server(python_path: str) -> ForkServer:
    """Return the only server of this process that finds modules in ``python_path``."""
    return ForkServer({**os.environ, "PYTHONPATH": python_path})
