"""A ROS domain of our own, the installed executables as processes, and a client node."""

import itertools
import math
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from action_bench import ActionBench
from rclpy.context import Context
from rclpy.node import Node
from shared_machine import shared_nodes

from testing.browser import Browser, browser
from testing.client import Client
from testing.commands import KINEMATICS, assert_within_limits
from testing.domain import own_context, own_domain, set_transport
from testing.forks import ForkedNodes
from testing.machine import Machine
from testing.panel import Panel
from testing.processes import Launcher, launched
from tri_glide_kinematics.ros.starting import COMPUTER

_COUNTER = itertools.count()


HERE = Path(__file__).parent
# Heights of the sliders by default of simulator_node [m].
START = (0.6, 0.6, 0.6)
# Files that take more than half a minute.
LONG = (
    "test_tutorials",
    "test_demo",
    "test_panel",
    "test_panel_texts",
    "test_drive",
    "test_cia402_node",
    "test_pick",
    "test_robustness",
    "test_executables",
    "test_process_faults",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """All tests of this folder start nodes; files that take long come first, the longest of them.

    Files are given to workers as a whole, so that what they start is started once: what is long
    would be waited for in the end.
    """
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.nodes)
    items.sort(key=lambda item: (*LONG, item.path.stem).index(item.path.stem))


@pytest.fixture(scope="session")
def ros_domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """Reserve a domain that no other test run on this computer uses; nodes and client join it."""
    with own_domain() as domain, pytest.MonkeyPatch.context() as patch:
        set_transport(patch, COMPUTER)
        # The token of a panel is not that of whoever runs the tests.
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield domain


@pytest.fixture(scope="session")
def ros_context(ros_domain: int) -> Iterator[Context]:
    with own_context() as context:
        yield context


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


@pytest.fixture(scope="module")
def lasting_machine(
    ros_context: Context, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Machine]:
    """Start a machine for all tests of a file that leave one as it was."""
    with shared_nodes(ros_context, tmp_path_factory, "lasting") as (first, launcher):
        started = Machine(first, launcher, listen=False).start()
        # Whoever does not listen is not to be sent anything.
        first.close()
        yield started


@pytest.fixture
def running_machine(ros_context: Context, lasting_machine: Machine) -> Iterator[Machine]:
    """Return a machine with parameters by default, at rest at its start, and a client of its own.

    Other tests of the file have used it, and others will: no parameter may be left changed, and no
    node ended.
    """
    client = Client(ros_context, lasting_machine.namespace)
    machine = lasting_machine.heard_by(client)
    if math.dist(machine.heights(), START) > 1e-6:
        machine.move(KINEMATICS.forward(START))
        machine.forget()
    yield machine
    client.close()


@pytest.fixture(scope="module")
def panel(ros_context: Context, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Panel]:
    """Start one machine with its panel for all tests of a file: a browser starts slowly here."""
    with shared_nodes(ros_context, tmp_path_factory, "panel") as (client, launcher):
        # More setpoints would only take the processor from the pages.
        yield Panel(client, launcher, tmp_path_factory.mktemp("files"), rate=50.0)


@pytest.fixture(scope="module")
def bench(ros_context: Context, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ActionBench]:
    """Start one machine for all tests of goals of a file."""
    with shared_nodes(ros_context, tmp_path_factory, "bench") as (client, launcher):
        bench = ActionBench(client, launcher).start()
        yield bench
        assert_within_limits(bench.machine)


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as running:
        yield running


@pytest.fixture
def other_machine(client: Client, nodes: Launcher, namespace: str) -> Machine:
    """Return a second machine in a namespace of its own."""
    return Machine(client, nodes, f"{namespace}_other")


@pytest.fixture
def nodes(ros_domain: int, tmp_path: Path, namespace: str) -> Iterator[Launcher]:
    with launched(tmp_path, namespace, ForkedNodes) as launcher:
        yield launcher


@pytest.fixture
def unfit_node(ros_domain: int) -> Iterator[Node]:
    """Return a node of another participant, for clients that no service can answer."""
    context = Context()
    rclpy.init(context=context, args=[])
    node = Node("unfit", context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()
