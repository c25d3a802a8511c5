"""A ROS domain of its own with processes in it, and a node that probes them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import domain_coordinator
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from benchmarks.harness import NoAnswerError
from benchmarks.machine import ROOT
from tri_glide_kinematics.ros.processes import default_parameter_file, executable
from tri_glide_kinematics.ros.transport import COMPUTER, Transport, choose_transport

TIMEOUT = 90.0  # s
STATUS_TIMEOUT = 5.0  # s, for the latched status of a node, once something went wrong
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class StartedProcess(NamedTuple):
    """A process of a session.

    Attributes:
        name: of its node.
        namespace: of its node.
        process: itself.
    """

    name: str
    namespace: str
    process: subprocess.Popen[bytes]


class Session:
    """Processes in one domain, and the node ``probe`` beside them."""

    def __init__(self) -> None:
        """Join the domain."""
        self.probe = Node("probe")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.probe)
        self._processes: list[StartedProcess] = []

    def start_node(self, name: str, namespace: str, **parameters: object) -> int:
        """Start an installed executable of this project and return its process id."""
        arguments = ["--params-file", str(default_parameter_file()), "--log-level", "ERROR"]
        for key, value in parameters.items():
            arguments += ["-p", f"{key}:={value}"]
        return self._start(name, [str(executable(name))], namespace, arguments)

    def start_bare(self, role: str, namespace: str, rate: float = 0.0) -> int:
        """Start a node of ``bare_nodes`` and return its process id."""
        return self.start_module("benchmarks.bare_nodes", [role, str(rate)], role, namespace)

    def start_module(
        self,
        module: str,
        arguments: Sequence[str],
        name: str,
        namespace: str,
        remaps: Sequence[str] = (),
        **parameters: object,
    ) -> int:
        """Start a Python module, which is the node ``name``, as a process and return its id."""
        ros_arguments = ["--log-level", "ERROR"]
        for remap in remaps:
            ros_arguments += ["-r", remap]
        if parameters:
            ros_arguments += ["--params-file", str(default_parameter_file())]
        for key, value in parameters.items():
            ros_arguments += ["-p", f"{key}:={value}"]
        command = [sys.executable, "-m", module, *arguments]
        return self._start(name, command, namespace, ros_arguments)

    def _start(
        self, name: str, command: list[str], namespace: str, arguments: Sequence[str]
    ) -> int:
        # What is installed comes first; the folder above us is for the modules of this package.
        paths = [*filter(None, [os.environ.get("PYTHONPATH")]), str(ROOT)]
        process = subprocess.Popen(
            [*command, "--ros-args", "-r", f"__ns:={namespace}", *arguments],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            stdin=subprocess.DEVNULL,
        )
        self._processes.append(StartedProcess(name, namespace, process))
        return process.pid

    def spin_until(self, condition: Callable[[], Any], what: str, longest_nap: float = 0.1) -> None:
        """Spin until ``condition`` holds.

        Args:
            condition: is looked at after each message.
            what: is waited for.
            longest_nap: time after which it is looked at without a message, too [s].

        Raises:
            NoAnswerError: if it does not; the text says how each process is.
        """
        end = time.monotonic() + TIMEOUT
        while not condition():
            if time.monotonic() > end:
                states = "; ".join(map(self._state_of, self._processes))
                raise NoAnswerError(f"waited {TIMEOUT:g} s in vain for {what}: {states}")
            self._executor.spin_once(longest_nap)

    def _state_of(self, started: StartedProcess) -> str:
        """Tell whether a process runs, and what ``ik_node`` says of itself."""
        name, namespace, process = started
        code = process.poll()
        if code is not None:
            return f"{name} in {namespace} ended with exit code {code}"
        if name != "ik_node":
            return f"{name} in {namespace} is running"
        # It is latched, so it can be listened to when it is needed.
        statuses: list[DiagnosticStatus] = []
        topic = f"{namespace.rstrip('/')}/ik_node/status"
        listener = self.probe.create_subscription(DiagnosticStatus, topic, statuses.append, LATCHED)
        end = time.monotonic() + STATUS_TIMEOUT
        while not statuses and time.monotonic() < end:
            self._executor.spin_once(0.1)
        self.probe.destroy_subscription(listener)
        status = statuses[-1].message if statuses else "without a status"
        return f"{name} in {namespace} is running, {status}"

    def spin_for(self, duration: float) -> None:
        """Spin for ``duration`` seconds."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def stop(self) -> None:
        """End all processes that were started and not yet ended."""
        processes = [started.process for started in self._processes]
        for process in processes:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for process in processes:
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
