"""A ROS domain of its own with processes in it, and a node that probes them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import domain_coordinator
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from benchmarks.machine import ROOT
from tri_glide_kinematics.nodes.processes import default_parameter_file, executable
from tri_glide_kinematics.nodes.transport import COMPUTER, Transport, choose_transport

TIMEOUT = 90.0  # s


class NoAnswerError(Exception):
    """Something that had to happen did not."""


class Session:
    """Processes in one domain, and the node ``probe`` beside them."""

    def __init__(self) -> None:
        """Join the domain."""
        self.probe = Node("probe")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.probe)
        self._processes: list[subprocess.Popen[bytes]] = []

    def start_node(self, name: str, namespace: str, **parameters: object) -> int:
        """Start an installed executable of this project and return its process id."""
        arguments = ["--params-file", str(default_parameter_file()), "--log-level", "ERROR"]
        for key, value in parameters.items():
            arguments += ["-p", f"{key}:={value}"]
        return self._start([str(executable(name))], namespace, arguments)

    def start_bare(self, role: str, namespace: str, rate: float = 0.0) -> int:
        """Start a node of ``bare_nodes`` and return its process id."""
        return self.start_module("benchmarks.bare_nodes", [role, str(rate)], namespace)

    def start_module(
        self,
        module: str,
        arguments: Sequence[str],
        namespace: str,
        remaps: Sequence[str] = (),
        **parameters: object,
    ) -> int:
        """Start a Python module as a process and return its id."""
        ros_arguments = ["--log-level", "ERROR"]
        for remap in remaps:
            ros_arguments += ["-r", remap]
        if parameters:
            ros_arguments += ["--params-file", str(default_parameter_file())]
        for key, value in parameters.items():
            ros_arguments += ["-p", f"{key}:={value}"]
        return self._start([sys.executable, "-m", module, *arguments], namespace, ros_arguments)

    def _start(self, command: list[str], namespace: str, arguments: Sequence[str]) -> int:
        # What is installed comes first; the folder above us is for the modules of this package.
        paths = [*filter(None, [os.environ.get("PYTHONPATH")]), str(ROOT)]
        process = subprocess.Popen(
            [*command, "--ros-args", "-r", f"__ns:={namespace}", *arguments],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            stdin=subprocess.DEVNULL,
        )
        self._processes.append(process)
        return process.pid

    def spin_until(self, condition: Callable[[], Any], what: str, longest_nap: float = 0.1) -> None:
        """Spin until ``condition`` holds.

        Args:
            condition: is looked at after each message.
            what: is waited for.
            longest_nap: time after which it is looked at without a message, too [s].

        Raises:
            NoAnswerError: if it does not.
        """
        end = time.monotonic() + TIMEOUT
        while not condition():
            if time.monotonic() > end:
                raise NoAnswerError(f"waited {TIMEOUT:g} s in vain for {what}")
            self._executor.spin_once(longest_nap)

    def spin_for(self, duration: float) -> None:
        """Spin for ``duration`` seconds."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def stop(self) -> None:
        """End all processes that were started and not yet ended."""
        for process in self._processes:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for process in self._processes:
            try:
                process.wait(10.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._processes.clear()


@contextmanager
def own_domain() -> Iterator[Transport]:
    """Choose a domain that nobody else on this computer uses, and a transport.

    By default the loopback address alone; what is set in the environment is used instead.
    """
    with domain_coordinator.domain_id() as domain:
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        yield choose_transport(COMPUTER)


@contextmanager
def session() -> Iterator[Session]:
    """Give a session in a domain of its own."""
    with own_domain():
        rclpy.init()
        running = Session()
        try:
            yield running
        finally:
            running.stop()
            rclpy.try_shutdown()
