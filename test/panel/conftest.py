"""One page server for all tests of the panel that need it, and a ROS domain for those of a file.

Where neither ROS nor viser is, the rest is tested: so they are imported by what needs them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from panel_rig import PanelRig
    from rclpy.context import Context
    from viser import ViserServer

    from tri_glide_kinematics.panel.machine import ShownMachine

_COUNTER = itertools.count()


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    from joined_domain import joined_domain

    with joined_domain() as context:
        yield context


@pytest.fixture(scope="session")
def server() -> Iterator[ViserServer]:
    """Serve a page on this computer alone."""
    from viser import ViserServer

    server = ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture
def rig(context: Context, server: ViserServer) -> Iterator[PanelRig]:
    from panel_rig import PanelRig

    rig = PanelRig(context, server, f"/panel_{next(_COUNTER)}")
    yield rig
    rig.probe.close()
    server.gui.reset()
    server.scene.reset()


@pytest.fixture
def machine(rig: PanelRig) -> ShownMachine:
    """Return the machine at rest in its middle, as its ``ik_node`` has told it."""
    from panel_rig import known_machine

    return known_machine(rig)
