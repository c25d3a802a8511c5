"""The mechanisms tab on a page server of its own, with a mechanism_node as a process."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import viser
from rclpy.context import Context

from testing.client import Probe
from testing.forks import ForkedNodes
from testing.processes import Launcher, launched
from tri_glide_kinematics.panel.mechanisms import NONE, MechanismRequests, MechanismsTab

CONFIG = Path(__file__).parents[1] / "config"
NAP = 0.01  # s

_COUNTER = itertools.count()


class Rig:
    """A tab that is stepped by the one who spins the node."""

    def __init__(self, context: Context, namespace: str, server: viser.ViserServer) -> None:
        """Join the ``namespace`` of a mechanism_node, and add the tab to a page ``server``."""
        self.probe = Probe(context, namespace, "panel")
        self.server = server
        self.requests = MechanismRequests(self.probe.node)
        self.tab = MechanismsTab(server.gui, server.scene, self.requests, CONFIG)

    def close(self):
        self.probe.close()

    def wait_for(self, condition, what, timeout=20.0):
        def stepped():
            self.tab.step(time.monotonic())
            return condition()

        self.probe.wait_for(stepped, what, timeout, NAP)

    def choose(self, name):
        """Have a mechanism drawn as it is in its file."""
        self.tab.choice.value = NONE
        self.tab.step(time.monotonic())
        self.tab.choice.value = name
        self.wait_for(
            lambda: self.tab.drawing.is_seen and self.is_visible("path_0"),
            f"{name} and its branch to be drawn",
        )

    def turn(self, degrees):
        self.tab.crank.value = degrees

    def points(self, name):
        return np.array(self.tab.drawing.nodes[name].points, dtype=np.float64)

    def is_visible(self, name):
        return self.tab.drawing.nodes[name].visible


@contextmanager
def mechanism_nodes(folder: Path) -> Iterator[tuple[Launcher, str]]:
    """Run mechanism_node in a namespace of its own, and start more nodes."""
    namespace = f"/mechanisms_{os.getpid()}_{next(_COUNTER)}"
    with launched(folder, namespace, ForkedNodes) as launcher:
        launcher.start("mechanism_node")
        yield launcher, namespace


@contextmanager
def page_server() -> Iterator[viser.ViserServer]:
    """Serve a page on this computer alone."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        yield server
    finally:
        server.stop()
