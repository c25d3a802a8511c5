"""The tab of the swing on a real page server: its curve, its fields, and what they ask for."""

from __future__ import annotations

import math
import time
from typing import Any

import pytest
from panel_rig import FACTS, OTHER, PanelRig
from rclpy.time import Time
from sensor_msgs.msg import Imu

from testing.swings import strongest_frequency
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.link import SwingFeed
from tri_glide_kinematics.panel.tabs import SwingTab
from tri_glide_kinematics.panel.tabs.curves import Shaping

pytestmark = pytest.mark.nodes

TWO_MODES = FACTS.with_changes(
    {"shaper": "zvd", "mode_frequencies": [12.5, 31.25], "mode_dampings": [0.035, 0.0]}
)
# A swing [Hz], and the samples of it, with the time between them [s].
FREQUENCY, COUNT, PERIOD = 15.0, 750, 0.002


@pytest.fixture
def tab(rig: PanelRig) -> SwingTab:
    return SwingTab(rig.requests)


def words(tab: SwingTab) -> str:
    return tab._words.content


def fields(tab: SwingTab) -> tuple[Any, ...]:
    """Return what the page shows."""
    modes = tab._modes if tab._has_second._handle.value else tab._modes[:1]
    shown = (tuple(float(field._input._handle.value) for field in mode) for mode in modes)
    return (tab._shaper._handle.value, *shown)


def test_the_curve_has_the_frequency_of_the_swing_that_is_told(
    rig: PanelRig, tab: SwingTab
) -> None:
    feed = SwingFeed(rig.probe.node)
    publisher = rig.probe.node.create_publisher(Imu, "imu/data_raw", 100)
    tab.draw(feed)
    assert not tab.curves.plot.handle.visible
    assert tab._silence.visible
    feed.listen()
    rig.probe.wait_for(publisher.get_subscription_count, "the panel to listen")
    message = Imu()
    message.linear_acceleration.z = 9.81
    begin = time.monotonic()
    for number in range(COUNT):
        moment = PERIOD * number
        # As late as it is felt: stamps in the future are those of a clock that was set.
        while time.monotonic() - begin < moment:
            time.sleep(PERIOD)
        message.header.stamp = Time(seconds=moment).to_msg()
        message.linear_acceleration.x = 2.0 * math.sin(math.tau * FREQUENCY * moment)
        publisher.publish(message)
        if number % 10 == 0:
            tab.draw(feed)
    rig.probe.wait_for(lambda: tab.draw(feed) or tab.curves.plot.handle.visible, "the curve")
    assert not tab._silence.visible
    ages, x, _, z = tab.curves.plot.handle.data
    assert strongest_frequency(ages, x) == pytest.approx(FREQUENCY, rel=0.05)
    assert max(abs(z)) < 1e-6 < max(abs(x))
    feed.close()


def test_the_fields_show_what_the_machine_has(rig: PanelRig, tab: SwingTab) -> None:
    tab.show(FACTS, waits=False)
    assert fields(tab) == ("none", (15.0, 5.0))
    assert "in force: no shaper" in words(tab)
    tab.show(TWO_MODES, waits=True)
    assert fields(tab) == ("zvd", (12.5, 3.5), (31.25, 0.0))
    assert "from the next rest on: zvd for 12.5 Hz, 3.5 % and 31.25 Hz, 0 %" in words(tab)
    tab.show(TWO_MODES, waits=False)
    assert "in force: zvd" in words(tab)


def test_what_is_being_typed_stays_until_the_machine_has_something_else(
    rig: PanelRig, tab: SwingTab
) -> None:
    tab.show(FACTS, waits=False)
    rig.press("Mode [Hz]", "18")
    tab.show(FACTS.with_changes({"speed_scale": 0.5}), waits=False)
    assert fields(tab)[1] == (18.0, 5.0)
    tab.show(FACTS.with_changes({"mode_frequencies": (20.0,)}), waits=False)
    assert fields(tab)[1] == (20.0, 5.0)
    # An ik_node that was started anew has what it has.
    rig.press("Mode [Hz]", "18")
    tab.show(None, waits=False)
    assert words(tab) == ""
    tab.show(FACTS.with_changes({"mode_frequencies": (20.0,)}), waits=False)
    assert fields(tab)[1] == (20.0, 5.0)


def test_a_page_without_the_controls_changes_no_field(rig: PanelRig, tab: SwingTab) -> None:
    tab.show(FACTS, waits=False)
    rig.press("Mode [Hz]", "18", OTHER)
    assert fields(tab)[1] == (15.0, 5.0)
    assert "the controls are with page 1" in rig.requests.refusal


def test_one_damping_is_that_of_all_modes() -> None:
    shaping = Shaping.of(FACTS.with_changes({"mode_frequencies": (10.0, 17.0)}))
    assert shaping.modes == ((10.0, 5.0), (17.0, 5.0))


def test_with_nobody_there_a_shaper_is_refused(rig: PanelRig, tab: SwingTab) -> None:
    tab._set()
    assert rig.requests.refusal.startswith("shaper: nobody answers as /panel_")


def test_no_frequency_means_that_there_is_no_second_mode(rig: PanelRig, tab: SwingTab) -> None:
    tab.show(TWO_MODES, waits=False)
    assert tab.wanted == Shaping.of(TWO_MODES)
    tab._modes[1][0].set(0.0)
    assert tab.wanted.modes == ((12.5, 3.5), (0.0, 0.0))
    rig.press("Mode [Hz]", "")
    with pytest.raises(KinematicsError, match=r"nothing done: Mode \[Hz\]: '' must be a number"):
        _ = tab.wanted
    assert fields(tab)[1] == (12.5, 3.5)


def test_percent_are_sent_as_typed() -> None:
    for percent in (0.0, 0.1, 2.3, 3.0, 5.7, 14.9, 50.0):
        values = Shaping("ei", ((15.0, percent),)).values
        assert values["mode_dampings"] == [float(f"{percent}e-2")]
        assert values["mode_frequencies"] == [15.0]
