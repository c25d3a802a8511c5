"""Fixtures: a ROS domain of our own, the installed executables as processes, and a client node.

A module of its own, as tests that are run by hand use the same fixtures.
"""

from __future__ import annotations

import itertools
import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from subprocess import Popen
from typing import Any

import domain_coordinator
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from tri_glide_kinematics.ros.processes import NodeProcesses, default_parameter_file
from tri_glide_kinematics.ros.transport import (
    COMPUTER,
    MIDDLEWARE_VARIABLES,
    VARIABLE,
    transport_of,
)

JOINTS = ("slider_1", "slider_2", "slider_3")
TIMEOUT = 60.0  # s, for what takes a fraction of this unless the computer is very busy
RETRY_AFTER = 10.0  # s
# A computer that runs other things too may keep the simulator waiting for longer than a machine
# should be silent; then its sliders are late, and jump.
PATIENCE = {"measured_timeout": 1.0, "jump_limit": 0.1, "tracking_error_limit": 0.3}
DEEP_QUEUE = QoSProfile(depth=5000)
# Deeper than that of the publisher: a client that is kept waiting must not miss a state.
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class RunningNode:
    """One executable as a process."""

    def __init__(self, name: str, process: Popen[bytes], log: Path) -> None:
        self.name = name
        self.process = process
        self._log = log

    @property
    def pid(self) -> int:
        return self.process.pid

    @property
    def output(self) -> str:
        """All that it has written so far."""
        return self._log.read_text(errors="replace")

    @property
    def is_running(self) -> bool:
        return self.process.poll() is None

    def signal(self, number: int) -> int:
        """Send a signal and return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(TIMEOUT)


class Launcher:
    """Starts nodes of one test, all with the parameter file of the README."""

    def __init__(self, folder: Path, namespace: str) -> None:
        self._processes = NodeProcesses()
        self._folder = folder
        self._namespace = namespace
        self._count = itertools.count()
        self.started: list[RunningNode] = []

    def start(
        self,
        name: str,
        parameters: dict[str, Any] | None = None,
        *,
        namespace: str | None = None,
        arguments: Sequence[str] = (),
        prefix: Sequence[str] = (),
    ) -> RunningNode:
        """Start the executable ``name``; parameters are written as in YAML."""
        log = self._folder / f"{name}_{next(self._count)}.log"
        command = ["--params-file", str(default_parameter_file())]
        command += ["-r", f"__ns:={namespace or self._namespace}"]
        for key, value in (parameters or {}).items():
            command += ["-p", f"{key}:={_as_yaml(value)}"]
        process = self._processes.start(name, [*command, *arguments], log, prefix)
        self.started.append(RunningNode(name, process, log))
        return self.started[-1]

    def stop(self) -> None:
        self._processes.stop()


class Client:
    """A node as a user would write it, with bounded waiting."""

    def __init__(self, context: Context, namespace: str) -> None:
        self.namespace = namespace
        self.node = Node("client", namespace=namespace, context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._pose = self.node.create_publisher(PoseStamped, "target_pose", 10)
        self._twist = self.node.create_publisher(TwistStamped, "target_twist", 10)
        self._services: dict[str, Any] = {}
        self._parameters: dict[str, AsyncParameterClient] = {}

    def close(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()

    def spin_once(self) -> None:
        self._executor.spin_once(timeout_sec=0.05)

    def now(self) -> int:
        """Return the time of the node's clock [ns]."""
        return int(self.node.get_clock().now().nanoseconds)

    def time_of(self, message: Any) -> int:
        """Return the stamp of a message [ns]."""
        stamp = message.header.stamp
        return int(stamp.sec * 1_000_000_000 + stamp.nanosec)

    def wait_for(self, condition: Callable[[], Any], what: str, timeout: float = TIMEOUT) -> None:
        """Spin until ``condition`` holds; fail if it does not in time."""
        end = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < end, f"waited {timeout:g} s in vain for {what}"
            self.spin_once()

    def record(
        self, kind: type, topic: str, qos: QoSProfile = DEEP_QUEUE, keep: int | None = None
    ) -> Any:
        """Return a list of all messages of a topic, or a deque of the last ``keep`` ones."""
        messages: Any = [] if keep is None else deque(maxlen=keep)
        self.node.create_subscription(kind, topic, lambda message: messages.append(message), qos)
        return messages

    def publisher(self, kind: type, topic: str, qos: QoSProfile | int = 10) -> Any:
        return self.node.create_publisher(kind, topic, qos)

    def wait_for_subscribers(self, *publishers: Any) -> None:
        self.wait_for(
            lambda: all(publisher.get_subscription_count() for publisher in publishers),
            "somebody who listens",
        )

    def send_pose(self, position: Sequence[float], frame: str = "tri_glide_base") -> None:
        self.wait_for_subscribers(self._pose)
        message = PoseStamped()
        message.header.frame_id = frame
        point = message.pose.position
        point.x, point.y, point.z = map(float, position)
        self._pose.publish(message)

    def send_twist(self, velocity: Sequence[float], frame: str = "tri_glide_base") -> None:
        self.wait_for_subscribers(self._twist)
        message = TwistStamped()
        message.header.frame_id = frame
        linear = message.twist.linear
        linear.x, linear.y, linear.z = map(float, velocity)
        self._twist.publish(message)

    def call(self, kind: type, service: str, request: Any) -> Any:
        """Call a service and return its response."""
        if service not in self._services:
            self._services[service] = self.node.create_client(kind, service)
        client = self._services[service]
        self.wait_for(client.service_is_ready, f"service {service}")
        return self._answer(lambda: client.call_async(request), f"the response of {service}")

    def stop(self, node: str = "ik_node") -> Any:
        return self.call(Trigger, f"{node}/stop", Trigger.Request())

    def enable(self, data: bool = True, node: str = "ik_node") -> Any:
        return self.call(SetBool, f"{node}/enable", SetBool.Request(data=data))

    def set_parameters(self, node: str, values: dict[str, Any]) -> Any:
        """Set parameters of a node as a set, and return the result."""
        if node not in self._parameters:
            self._parameters[node] = AsyncParameterClient(self.node, node)
        client = self._parameters[node]
        self.wait_for(client.services_are_ready, f"the parameter services of {node}")
        parameters = [Parameter(name, value=value) for name, value in values.items()]
        ask = partial(client.set_parameters_atomically, parameters)
        return self._answer(ask, f"{node} to answer").result

    def _answer(self, ask: Callable[[], Future], what: str) -> Any:
        """Ask, and ask again once a server that had not discovered this client knows it.

        rmw_fastrtps drops an answer that has nowhere to go yet.
        """
        futures = [ask()]
        patience = time.monotonic() + RETRY_AFTER

        def answered() -> bool:
            if len(futures) == 1 and time.monotonic() > patience:
                futures.append(ask())
            return any(future.done() for future in futures)

        self.wait_for(answered, what)
        return next(future.result() for future in futures if future.done())


class Machine:
    """The simulator and ik_node of one namespace, and what the client hears of them."""

    def __init__(
        self,
        client: Client,
        launcher: Launcher,
        namespace: str | None = None,
        *,
        listen: bool = True,
    ) -> None:
        """Listen to the state, and unless ``listen`` is false to commands and measurements."""
        self.client = client
        self.namespace = namespace or client.namespace
        self._launcher = launcher
        self._listen = listen
        self.commands: list[JointState] = []
        self.measured: list[JointState] = []
        if listen:
            self.commands = client.record(JointState, f"{self.namespace}/joint_commands")
            self.measured = client.record(JointState, f"{self.namespace}/joint_states")
        self.states = client.record(DiagnosticStatus, f"{self.namespace}/ik_node/status", LATCHED)

    def start_simulator(
        self, parameters: dict[str, Any] | None = None, prefix: Sequence[str] = ()
    ) -> RunningNode:
        self.simulator = self._launcher.start(
            "simulator_node", parameters, namespace=self.namespace, prefix=prefix
        )
        return self.simulator

    def start_ik(self, parameters: dict[str, Any] | None = None) -> RunningNode:
        parameters = {**PATIENCE, **(parameters or {})}
        self.ik = self._launcher.start("ik_node", parameters, namespace=self.namespace)
        return self.ik

    def start(
        self,
        parameters: dict[str, Any] | None = None,
        simulator_parameters: dict[str, Any] | None = None,
    ) -> Machine:
        """Start both and wait until setpoints come."""
        self.start_simulator(simulator_parameters)
        self.start_ik(parameters)
        self.wait_until_connected()
        return self

    def wait_until_connected(self) -> None:
        """Wait until the machine is idle, commands come, and targets get there."""
        self.wait_for_state("idle")
        if self._listen:
            self.client.wait_for(lambda: self.commands and self.measured, "joint commands")
        if self.namespace == self.client.namespace:
            self.wait_until_targets_get_there()

    def wait_until_targets_get_there(self) -> None:
        """Send targets that are refused until both refusals have come.

        A publisher may know of a subscription before that knows of it, and what it publishes
        meanwhile is lost.
        """

        def connected() -> bool:
            refused = [f"refused a target {kind}: " in self.ik.output for kind in ("pose", "twist")]
            if not refused[0]:
                self.client.send_pose((0.0, 0.0, 0.0), "connecting")
            if not refused[1]:
                self.client.send_twist((0.0, 0.0, 0.0), "connecting")
            return all(refused)

        self.client.wait_for(connected, "ik_node to hear targets")

    @property
    def state(self) -> str:
        """Name of the latest state."""
        return self._value("state")

    @property
    def reason(self) -> str:
        """Reason of the latest state."""
        return self._value("reason")

    def wait_for_state(self, state: str, timeout: float = TIMEOUT) -> None:
        self.client.wait_for(lambda: self.state == state, f"state {state}", timeout)

    def wait_for_new_state(self, state: str, action: Callable[[], Any]) -> None:
        """Do something and wait until the machine has gone over to the state once more."""
        count = len(self.states)
        action()
        self.client.wait_for(lambda: state in self.states_since(count), f"state {state}")

    def states_since(self, count: int) -> list[str]:
        """Return the names of the states that the machine went over to after ``count`` messages.

        A message that only tells another reason or a refusal is left out.
        """
        names = [_value_of(status, "state") for status in self.states[max(count - 1, 0) :]]
        before = names[:1] if count else [""]
        names = names[1:] if count else names
        return [name for last, name in zip([*before, *names], names) if name != last]

    def move(self, position: Sequence[float]) -> None:
        """Send a target and wait until the sliders are at rest there."""
        self.wait_for_new_state("idle", lambda: self.client.send_pose(position))
        self.catch_up()

    def catch_up(self) -> None:
        """Wait until a command of this moment is here: messages wait in a queue before that."""
        now = self.client.now()
        self.client.wait_for(
            lambda: self.client.time_of(self.commands[-1]) >= now, "a command of this moment"
        )

    def wait_for_measured_rest(self) -> None:
        """Wait until the sliders are measured to stand still, from this moment on."""
        now = self.client.now()

        def resting() -> bool:
            message = self.measured[-1]
            slow = max(map(abs, message.velocity)) < 1e-6
            return slow and self.client.time_of(message) > now

        self.client.wait_for(resting, "the sliders to stand still")

    def heights(self, message: JointState | None = None) -> tuple[float, ...]:
        """Return the heights of a message, in the order of the sliders; of the latest command."""
        message = message or self.commands[-1]
        return tuple(message.position[message.name.index(name)] for name in JOINTS)

    def _value(self, key: str) -> str:
        return _value_of(self.states[-1], key) if self.states else ""


def _value_of(status: DiagnosticStatus, key: str) -> str:
    return next(entry.value for entry in status.values if entry.key == key)


def _as_yaml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_as_yaml, value)) + "]"
    return str(value)


@pytest.fixture(scope="session")
def ros_domain() -> Iterator[int]:
    """Reserve a domain that no other test run on this computer uses; nodes and client join it."""
    with domain_coordinator.domain_id() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        set_transport(patch, COMPUTER)
        yield domain


def set_transport(patch: pytest.MonkeyPatch, name: str) -> None:
    """Choose a transport, whatever the shell of this test run has set for the middleware."""
    for variable in MIDDLEWARE_VARIABLES:
        patch.delenv(variable, raising=False)
    for variable, value in transport_of({VARIABLE: name}).variables.items():
        patch.setenv(variable, value)


@pytest.fixture(scope="session")
def ros_context(ros_domain: int) -> Iterator[Context]:
    context = Context()
    rclpy.init(context=context, args=[])
    yield context
    context.try_shutdown()


@pytest.fixture
def namespace(request: pytest.FixtureRequest) -> str:
    """Return a namespace that no other test has used."""
    return f"/{request.node.originalname}_{os.getpid()}_{next(_COUNTER)}"


@pytest.fixture
def client(ros_context: Context, namespace: str) -> Iterator[Client]:
    node = Client(ros_context, namespace)
    yield node
    node.close()


@pytest.fixture
def machine(client: Client, nodes: Launcher) -> Machine:
    """Return a machine that is not started yet."""
    return Machine(client, nodes)


@pytest.fixture
def other_machine(client: Client, nodes: Launcher, namespace: str) -> Machine:
    """Return a second machine in a namespace of its own."""
    return Machine(client, nodes, f"{namespace}_other")


@pytest.fixture
def nodes(ros_domain: int, tmp_path: Path, namespace: str) -> Iterator[Launcher]:
    with launched(tmp_path, namespace) as launcher:
        yield launcher


@contextmanager
def launched(folder: Path, namespace: str) -> Iterator[Launcher]:
    """Start nodes; afterwards none of them has ended by an error of its own, and all are gone."""
    launcher = Launcher(folder, namespace)
    try:
        yield launcher
    finally:
        launcher.stop()
    for node in launcher.started:
        assert "Traceback" not in node.output, f"{node.name}:\n{node.output}"
        assert node.process.returncode in (0, -9), f"{node.name}:\n{node.output}"


_COUNTER = itertools.count()
