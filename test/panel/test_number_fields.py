"""What is driven is what the fields of numbers show, or nothing, and that is told."""

from __future__ import annotations

import asyncio
import math
import time
from fractions import Fraction

import numpy as np
import pytest
from joined_domain import joined_domain
from mechanisms_rig import page_server
from viser import GuiEvent

from testing.client import Probe
from tri_glide_kinematics.panel.inputs import (
    OperatorsInput,
    OperatorsNumber,
    SpeedFields,
    WrongNumberError,
)
from tri_glide_kinematics.panel.link import MachineFacts, MachineLink
from tri_glide_kinematics.panel.operator_requests import RENEWALS, OperatorRequests
from tri_glide_kinematics.panel.tabs import DriveTab, Point, PointsTab

TYPED = (
    "-50",
    "0.4",
    "2,5",
    "1,000",
    "",
    " ",
    "1e3",
    "nan",
    "inf",
    "--1",
    "0x1",
    ".",
    "3.7",
    "0",
    "+.5",
)
SIGNS = "0123456789.,-+eE xn\u0664\u00b2"


@pytest.fixture(scope="module")
def page():
    """A page without a browser, and requests of which page 0 has the controls."""
    with joined_domain() as context, page_server() as server:
        probe = Probe(context, "/fields", "panel")
        requests = OperatorRequests(MachineLink(probe.node, print), lambda: None)
        requests.controls.opened(0)
        yield server.gui, requests
        probe.close()


def type_into(page, label, value):
    """Do what the page does when somebody types into the newest field of this label."""
    gui, requests = page
    fields = gui._gui_input_handle_from_uuid.values()
    handle = [each for each in fields if each._impl.props.label == label][-1]
    return send(requests, handle, value)


def click(page, words):
    """Do what the page does when somebody clicks on the newest button with these words."""
    gui, requests = page
    fields = gui._gui_input_handle_from_uuid.values()
    is_named = lambda props: words in (props.label, *getattr(props, "options", ()))  # noqa: E731
    handle = [each for each in fields if is_named(each._impl.props)][-1]
    value = words if hasattr(handle._impl.props, "options") else True
    return send(requests, handle, value)


def send(requests, handle, value):
    handle._impl.value = value
    for callback in handle._impl.update_cb:
        asyncio.run(callback(GuiEvent(None, 0, handle)))
    requests.fulfil()
    return handle


def meant(text):
    """Return the number that people read in a text; None if it is none, or may be two."""
    text = text.strip(" ")
    before, _, behind = text.partition(",")
    digits = before.lstrip("+-")
    is_thousand = len(behind) == 3 and 0 < len(digits) < 4 and digits[0] != "0"
    if not set(text) <= set("0123456789.,-+") or is_thousand:
        return None
    text = text.replace(",", ".")
    try:
        return Fraction(text.removesuffix(".") if text.count(".") == 1 else text)
    except ValueError:
        return None


@pytest.mark.nodes
def test_what_a_field_shows_is_what_counts_or_it_is_refused(page):
    gui, requests = page
    field = OperatorsNumber(requests, gui, "size", 7.5, least=0.4)
    rng = np.random.default_rng(5)
    drawn = ("".join(rng.choice(list(SIGNS), rng.integers(1, 6))) for _ in range(200))
    last, taken = 7.5, 0
    for text in (*TYPED, *drawn):
        handle = type_into(page, "size", text)
        number = meant(text)
        if number is None or number < Fraction("0.4"):
            with pytest.raises(WrongNumberError, match=r"nothing done: size: .* at least 0\.4"):
                _ = field.value
            # The field shows again what holds, and that counts.
            assert float(handle.value) == last
        else:
            last, taken = float(number), taken + 1
        assert field.value == last
    assert taken > 20


@pytest.mark.nodes
def test_whole_numbers_are_whole(page):
    gui, requests = page
    changes = []
    field = OperatorsNumber(
        *(requests, gui, "line", 1), least=1, is_whole=True, on_change=changes.append
    )
    for text in ("2.5", "0", "-1", "x"):
        type_into(page, "line", text)
        with pytest.raises(WrongNumberError, match="a whole number, at least 1"):
            _ = field.value
    type_into(page, "line", "12")
    assert (field.value, changes) == (12, [12])


@pytest.mark.nodes
def test_no_speed_means_the_fastest_but_the_choice_of_it(page):
    gui, requests = page
    speed = SpeedFields(requests, gui, "at")
    assert speed.value == 0.05
    for text in ("0", "-50", "0.001", ""):
        type_into(page, "at", text)
        with pytest.raises(WrongNumberError):
            _ = speed.value
    type_into(page, "at", "0.4")
    assert speed.value == pytest.approx(0.0004)
    type_into(page, "As fast as it can", True)
    assert speed.value == 0.0


class Tabs:
    """The tabs with fields of numbers by which something is driven, and what they have driven.

    Attributes:
        driven: names of fields with what was driven by them; empty for nothing.
    """

    def __init__(self, page, folder):
        gui, requests = page
        self.driven = {}
        self.points = PointsTab(
            *(gui, requests, folder / "points.yaml", lambda: None, self.follow, self.go)
        )
        self.points._put([Point((0.0, 0.0, 0.25))])
        self.drive = DriveTab(gui, requests, self.go, self.step)

    def go(self, place, speed):
        self.driven = dict(zip("xyz", (1000.0 * part for part in place)))
        self.driven["at"] = 1000.0 * speed

    def step(self, way, speed):
        self.driven = {"step": 1000.0 * max(map(abs, way)), "jog": 1000.0 * speed}

    def follow(self, places, tolerance, speed):
        self.driven = {"corners": 1000.0 * tolerance, "speed": 1000.0 * speed}


# The field, what is clicked on, what is driven by it, and its bounds.
FIELDS = [
    *((f"{axis} [mm]", "Go", axis, -math.inf, math.inf) for axis in "xyz"),
    ("at [mm/s]", "Go", "at", 0.01, math.inf),
    ("Own step [mm]", "jog", "step", 0.001, 100),
    ("Jog [mm/s]", "jog", "jog", 0.01, 200),
    ("Corners [mm]", "Drive through them", "corners", 0, math.inf),
    ("Speed [mm/s]", "Drive through them", "speed", 0.01, math.inf),
]


@pytest.mark.nodes
def test_what_is_driven_is_what_the_field_shows_or_nothing_and_that_is_told(page, tmp_path):
    tabs, rng = Tabs(page, tmp_path), np.random.default_rng(51)
    requests = page[1]
    click(page, "own")
    for label, button, name, least, most in FIELDS:
        for number in range(200):
            text = "".join(rng.choice(list(SIGNS), rng.integers(0, 7)))
            # Pasted, or typed key by key.
            for end in [len(text)] if number % 2 else range(len(text) + 1):
                handle = type_into(page, label, text[:end])
            tabs.driven, requests.refusal = {}, ""
            click(page, button)
            wanted = meant(text)
            if wanted is not None and least <= wanted <= most:
                assert tabs.driven[name] == pytest.approx(float(wanted), rel=1e-12), text
                assert not requests.refusal
            else:
                assert not tabs.driven, text
                assert f"nothing done: {label}: " in requests.refusal
                # It shows again what holds, and that is driven then.
                click(page, button)
                assert tabs.driven[name] == pytest.approx(float(handle.value))


@pytest.mark.nodes
def test_a_speed_that_is_none_jogs_nothing_before_the_button_is_released(page, tmp_path):
    requests = page[1]
    tab = Tabs(page, tmp_path).drive
    type_into(page, "Jog [mm/s]", "")
    button = tab._buttons[0]
    (hold,) = button._impl.hold_cbs_from_freq[RENEWALS]
    asyncio.run(hold(GuiEvent(None, 0, button)))
    assert "nothing done: Jog [mm/s]: '' must be" in requests.refusal
    # The field shows the last number again, but nobody has pressed for that.
    requests.refusal = ""
    for _ in range(3):
        time.sleep(1.0 / RENEWALS)
        asyncio.run(hold(GuiEvent(None, 0, button)))
    assert not requests._hold._has_moved
    asyncio.run(requests.release(GuiEvent(None, 0, button)))
    for _ in range(20):
        time.sleep(1.0 / RENEWALS)
        asyncio.run(hold(GuiEvent(None, 0, button)))
    assert requests._hold._has_moved and not requests.refusal
    asyncio.run(requests.release(GuiEvent(None, 0, button)))


@pytest.mark.nodes
def test_a_slider_shows_again_what_holds_and_the_number_and_the_bound_are_told(page):
    gui, requests = page
    changes = []
    slider = gui.add_slider("Override [%]", min=1, max=200, step=1, initial_value=100)
    OperatorsInput(requests, slider, changes.append)
    for value, is_taken in ((500, False), (0, False), (200, True), (-1, False)):
        requests.refusal = ""
        send(requests, slider, value)
        assert slider.value == (value if is_taken else 200 if changes else 100)
        told = f"nothing done: Override [%]: {value} must be from 1 to 200"
        assert requests.refusal == ("" if is_taken else told)
    assert changes == [200]


@pytest.mark.nodes
def test_a_speed_that_the_machine_does_not_take_is_shown_no_more(page, tmp_path):
    tab = Tabs(page, tmp_path).drive
    facts = MachineFacts({"speed_scale": 0.4})
    tab.show(facts, None, None)
    handle = type_into(page, "Speed [%]", 70)
    # Nobody answers as ik_node here.
    tab.show(facts, None, None)
    assert handle.value == 40
