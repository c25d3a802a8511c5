"""The tab of the swing on a real page server: its curve, its fields, and what they ask for."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from typing import Any

import pytest
from joined_domain import joined_domain
from mechanisms_rig import page_server
from sensor_msgs.msg import Imu
from viser import GuiEvent

from testing.client import Probe
from testing.swings import strongest_frequency
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.link import MachineFacts, MachineLink, SwingFeed
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.tabs import SwingTab
from tri_glide_kinematics.panel.tabs.curves import SWING_SPAN, Shaping
from tri_glide_kinematics.settings import IK_NODE
from tri_glide_kinematics.simulation import PlatformMode, SimulatedSwing, SwingModel

pytestmark = pytest.mark.nodes

FACTS = MachineFacts({parameter.name: parameter.default for parameter in IK_NODE})
TWO_MODES = FACTS.with_changes(
    {"shaper": "zvd", "mode_frequencies": [12.5, 31.25], "mode_dampings": [0.035, 0.0]}
)
OPERATOR, OTHER = 0, 1
PERIOD = 0.002  # s, of a simulated machine
BOUND = 20.0  # s, for what takes a fraction of this


class Rig:
    """A tab, and what is told to its page."""

    def __init__(self, probe: Probe, gui: Any) -> None:
        self.probe = probe
        self.refusals: list[str] = []
        link = MachineLink(probe.node, self.refusals.append)
        self.requests = OperatorRequests(link, lambda: None)
        for page in (OPERATOR, OTHER):
            self.requests.controls.opened(page)
        self.tab = SwingTab(gui, self.requests)
        self.feed = SwingFeed(probe.node)

    @property
    def words(self) -> str:
        return self.tab._words.content

    @property
    def fields(self) -> tuple[Any, ...]:
        """What the page shows."""
        tab = self.tab
        modes = tab._modes if tab._has_second._handle.value else tab._modes[:1]
        shown = (tuple(float(field._input._handle.value) for field in mode) for mode in modes)
        return (tab._shaper._handle.value, *shown)

    def type(self, frequency: str, page: int = OPERATOR) -> None:
        """Type the frequency of the first mode."""
        field = self.tab._modes[0][0]._input
        field._handle.value = frequency
        asyncio.run(field._take(GuiEvent(None, page, field._handle)))  # type: ignore[arg-type]
        self.requests.fulfil()


@pytest.fixture
def rig() -> Iterator[Rig]:
    with joined_domain() as context, page_server() as server:
        probe = Probe(context, "/swinging", "panel")
        rig = Rig(probe, server.gui)
        yield rig
        rig.feed.close()
        probe.close()


def test_the_curve_has_the_frequency_of_the_simulated_swing(rig: Rig) -> None:
    frequency = 15.0
    publisher = rig.probe.node.create_publisher(Imu, "imu/data_raw", 100)
    swing = SimulatedSwing((0.0, 0.0, 0.25), SwingModel((PlatformMode(0, (frequency,), 0.01),)))
    rig.tab.draw(rig.feed)
    assert not rig.tab.curves.plot.visible
    assert rig.tab._silence.visible
    rig.feed.listen()
    rig.probe.wait_for(publisher.get_subscription_count, "the panel to listen")
    message = Imu()
    begin, told = time.monotonic(), 0
    # A jump, and all of its swing that the curve can hold.
    while (passed := time.monotonic() - begin) < SWING_SPAN:
        while told < int(passed / PERIOD):
            told += 1
            stamp = divmod(round(1e9 * PERIOD * told), 10**9)
            message.header.stamp.sec, message.header.stamp.nanosec = stamp
            felt = message.linear_acceleration
            felt.x, felt.y, felt.z = swing.step((0.001, 0.0, 0.25), PERIOD).acceleration
            felt.z += 9.81
            publisher.publish(message)
        rig.tab.draw(rig.feed)
        time.sleep(0.02)
    assert rig.tab.curves.plot.visible
    assert not rig.tab._silence.visible
    ages, x, _, z = rig.tab.curves.plot.data
    calm = ages > -SWING_SPAN + 1.0
    assert strongest_frequency(ages[calm], x[calm]) == pytest.approx(frequency, rel=0.02)
    assert max(abs(z[calm])) < 1e-6 < max(abs(x[calm]))


def test_the_fields_show_what_the_machine_has(rig: Rig) -> None:
    rig.tab.show(FACTS, waits=False)
    assert rig.fields == ("none", (15.0, 5.0))
    assert "in force: no shaper" in rig.words
    rig.tab.show(TWO_MODES, waits=True)
    assert rig.fields == ("zvd", (12.5, 3.5), (31.25, 0.0))
    assert "from the next rest on: zvd for 12.5 Hz, 3.5 % and 31.25 Hz, 0 %" in rig.words
    rig.tab.show(TWO_MODES, waits=False)
    assert "in force: zvd" in rig.words


def test_what_is_being_typed_stays_until_the_machine_has_something_else(rig: Rig) -> None:
    rig.tab.show(FACTS, waits=False)
    rig.type("18")
    rig.tab.show(FACTS.with_changes({"speed_scale": 0.5}), waits=False)
    assert rig.fields[1] == (18.0, 5.0)
    rig.tab.show(FACTS.with_changes({"mode_frequencies": (20.0,)}), waits=False)
    assert rig.fields[1] == (20.0, 5.0)
    # An ik_node that was started anew has what it has.
    rig.type("18")
    rig.tab.show(None, waits=False)
    assert rig.words == ""
    rig.tab.show(FACTS.with_changes({"mode_frequencies": (20.0,)}), waits=False)
    assert rig.fields[1] == (20.0, 5.0)


def test_a_page_without_the_controls_changes_no_field(rig: Rig) -> None:
    rig.tab.show(FACTS, waits=False)
    rig.type("18", OTHER)
    assert rig.fields[1] == (15.0, 5.0)
    assert "the controls are with page 1" in rig.requests.refusal


def test_one_damping_is_that_of_all_modes() -> None:
    shaping = Shaping.of(FACTS.with_changes({"mode_frequencies": (10.0, 17.0)}))
    assert shaping.modes == ((10.0, 5.0), (17.0, 5.0))


def test_with_nobody_there_a_shaper_is_refused(rig: Rig) -> None:
    rig.tab._set()
    assert rig.refusals == ["shaper: nobody answers as /swinging/ik_node"]


def test_no_frequency_means_that_there_is_no_second_mode(rig: Rig) -> None:
    rig.tab.show(TWO_MODES, waits=False)
    assert rig.tab.wanted == Shaping.of(TWO_MODES)
    rig.tab._modes[1][0].set(0.0)
    assert rig.tab.wanted.modes == ((12.5, 3.5), (0.0, 0.0))
    rig.type("")
    with pytest.raises(KinematicsError, match=r"nothing done: Mode \[Hz\]: '' must be a number"):
        _ = rig.tab.wanted
    assert rig.fields[1] == (12.5, 3.5)


def test_percent_are_sent_as_typed() -> None:
    for percent in (0.0, 0.1, 2.3, 3.0, 5.7, 14.9, 50.0):
        values = Shaping("ei", ((15.0, percent),)).values
        assert values["mode_dampings"] == [float(f"{percent}e-2")]
        assert values["mode_frequencies"] == [15.0]
