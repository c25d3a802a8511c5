"""The view of the machine on a page without a browser."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Point
from panel_rig import FACTS, PanelRig, tell
from visualization_msgs.msg import Marker, MarkerArray

from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.tabs import LiveView
from tri_glide_kinematics.ros.outputs import PROGRAMMED

pytestmark = pytest.mark.nodes

PATH = [(0.0, 0.0, 0.3), (0.1, 0.0, 0.3), (0.1, 0.1, 0.3)]


def test_a_path_that_was_told_before_the_machine_is_drawn_with_it_and_with_the_next(
    rig: PanelRig,
) -> None:
    machine = ShownMachine(rig.probe.node, rig.requests)
    tabs = rig.gui.add_tab_group()
    view = LiveView(tabs, rig.requests, machine, print, lambda _: True, None)

    def drawn() -> Any:
        view.step()
        view.draw()
        handle: Any = rig.server.scene.get_handle_by_name("/programmed")
        return None if handle is None else handle.points

    path = Marker(ns=PROGRAMMED.name, points=[Point(x=x, y=y, z=z) for x, y, z in PATH])
    machine.feeds._on_markers(MarkerArray(markers=[path]))
    assert drawn() is None
    for facts in (FACTS, FACTS.with_changes({"arm_length": 0.41})):
        machine._take(facts)
        tell(machine)
        assert np.array(drawn()) == pytest.approx(np.array([PATH[:2], PATH[1:]]), abs=1e-6)
    path.action = Marker.DELETE
    machine.feeds._on_markers(MarkerArray(markers=[path]))
    assert len(drawn()) == 0
