"""One page server for all tests of the panel that need it, and a ROS domain for those of a file."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest
from joined_domain import joined_domain
from mechanisms_rig import page_server
from panel_rig import FACTS, PanelRig, tell
from rclpy.context import Context
from viser import ViserServer

from tri_glide_kinematics.panel.machine import ShownMachine

_COUNTER = itertools.count()


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    with joined_domain() as context:
        yield context


@pytest.fixture(scope="session")
def server() -> Iterator[ViserServer]:
    with page_server() as server:
        yield server


@pytest.fixture
def rig(context: Context, server: ViserServer) -> Iterator[PanelRig]:
    rig = PanelRig(context, server, f"/panel_{next(_COUNTER)}")
    yield rig
    rig.probe.close()
    server.gui.reset()
    server.scene.reset()


@pytest.fixture
def machine(rig: PanelRig) -> ShownMachine:
    """Return the machine at rest in its middle, as its ``ik_node`` has told it."""
    machine = ShownMachine(rig.probe.node, rig.requests)
    machine._take(FACTS)
    tell(machine)
    return machine
