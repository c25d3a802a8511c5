"""What a field of a number takes for one: what it shows, or nothing."""

from __future__ import annotations

import asyncio
from fractions import Fraction

import numpy as np
import pytest
from joined_domain import joined_domain
from mechanisms_rig import page_server
from viser import GuiEvent

from testing.client import Probe
from tri_glide_kinematics.panel.machine import (
    MachineLink,
    OperatorRequests,
    OperatorsNumber,
    SpeedFields,
)
from tri_glide_kinematics.panel.machine.operator_requests import WrongNumberError

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
