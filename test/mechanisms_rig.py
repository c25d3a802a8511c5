"""The mechanisms tab on a page server."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import viser

from testing.waiting import wait_until
from tri_glide_kinematics.panel.mechanisms import NONE, MechanismsTab

CONFIG = Path(__file__).parents[1] / "config"
NAP = 0.01  # s


class Rig:
    """A tab that is stepped here."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Add the tab to a page ``server``."""
        self.server = server
        self.tab = MechanismsTab(server.gui, server.scene, CONFIG)

    def wait_for(self, condition, what):
        def holds():
            self.tab.step(time.monotonic())
            return condition()

        wait_until(holds, what, NAP)

    def choose(self, name):
        """Have a mechanism drawn as it is in its file."""
        self.tab.choice.value = NONE
        self.tab.step(time.monotonic())
        self.tab.choice.value = name
        self.wait_for(
            lambda: self.tab.drawing.root.visible and self.is_visible("path_0"),
            f"{name} and its branch to be drawn",
        )

    def turn(self, degrees):
        self.tab.crank.value = degrees

    def points(self, name):
        return np.array(self.tab.drawing.nodes[name].points, dtype=np.float64)

    def is_visible(self, name):
        return self.tab.drawing.nodes[name].visible
