"""The view of the machine on a page without a browser."""

from __future__ import annotations

import asyncio
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Point
from panel_rig import FACTS, OPERATOR, OTHER, PanelRig, tell
from visualization_msgs.msg import Marker, MarkerArray

from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.tabs import LiveView
from tri_glide_kinematics.panel.tabs.curves import BIN
from tri_glide_kinematics.panel.tabs.live_view import GoToHandle
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


def test_a_machine_that_has_gone_is_not_shown_as_if_it_were_there(
    rig: PanelRig, machine: ShownMachine, monkeypatch: pytest.MonkeyPatch
) -> None:
    tabs = rig.gui.add_tab_group()
    view = LiveView(tabs, rig.requests, machine, print, lambda _: True, None)
    view.step()
    view.draw()
    assert "condition number" in view._numbers.content
    drawn: Any = rig.server.scene.get_handle_by_name("/measured")
    assert drawn.visible
    plot = view._curves.plots[0].handle

    def newest() -> int:
        return int(np.flatnonzero(np.isfinite(plot.data[1]))[-1])

    before = newest()
    machine._forget()
    later = time.monotonic() + 3.0
    monkeypatch.setattr("tri_glide_kinematics.panel.tabs.live_view.time.monotonic", lambda: later)
    view.draw()
    assert "no heights of the sliders are measured" in view._numbers.content
    assert not drawn.visible
    assert newest() < before - 1.0 / BIN


HERE, THERE = (0.01, 0.0, 0.25), (-0.08, 0.0, 0.3)


def test_the_machine_goes_to_where_the_page_with_the_controls_lets_the_handle_go(
    rig: PanelRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    pages = {OPERATOR: None, OTHER: None}
    monkeypatch.setattr(rig.server, "get_clients", lambda: pages)
    GoToHandle(rig.requests, 0.1, asked.append)
    handle: Any = rig.server.scene.get_handle_by_name("/go_to")

    def drag(page: int, phase: str, place: Any = None) -> None:
        if place is not None:
            handle.position = place
        (on_update,) = handle._impl_aux.update_cb
        asyncio.run(on_update(SimpleNamespace(client_id=page, phase=phase)))
        rig.requests.fulfil()

    drag(OPERATOR, "start")
    drag(OPERATOR, "update", HERE)
    # Another page changes nothing, and ends nothing.
    for phase in ("start", "update", "end"):
        drag(OTHER, phase, THERE)
    assert "the controls are with page 1" in rig.requests.refusal
    drag(OPERATOR, "end")
    assert asked == [HERE]
    # Who has not begun lets nothing go, nor does a page that has vanished.
    drag(OPERATOR, "update", THERE)
    drag(OPERATOR, "end")
    drag(OPERATOR, "start")
    drag(OPERATOR, "update", THERE)
    pages.clear()
    drag(OPERATOR, "end")
    assert asked == [HERE]
