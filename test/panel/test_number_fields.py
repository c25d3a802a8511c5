"""What is driven is what the fields of numbers show, or nothing, and that is told."""

from __future__ import annotations

import asyncio
import math
import time
from fractions import Fraction

import numpy as np
import pytest

from tri_glide_kinematics.panel.operator_requests import (
    SpeedFields,
    WrongNumberError,
)
from tri_glide_kinematics.panel.operators import RENEWALS
from tri_glide_kinematics.panel.tabs import DriveTab, Point, PointsTab

pytestmark = pytest.mark.nodes

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


def test_whole_numbers_are_whole(rig):
    requests = rig.requests
    changes = []
    field = requests.number("line", 1, least=1, is_whole=True, on_change=changes.append)
    for text in ("2.5", "0", "-1", "x"):
        rig.press("line", text)
        with pytest.raises(WrongNumberError, match="a whole number, at least 1"):
            _ = field.value
    rig.press("line", "12")
    assert (field.value, changes) == (12, [12])


def test_no_speed_means_the_fastest_but_the_choice_of_it(rig):
    requests = rig.requests
    speed = SpeedFields(requests, "at")
    assert speed.value == 0.05
    for text in ("0", "-50", "0.001", ""):
        rig.press("at", text)
        with pytest.raises(WrongNumberError):
            _ = speed.value
    rig.press("at", "0.4")
    assert speed.value == pytest.approx(0.0004)
    rig.press("As fast as it can", True)
    assert speed.value == 0.0


def tabs(rig, folder):
    """Return the tab *Drive*, beside that of points, which has one."""
    points = PointsTab(rig.requests, rig.machine, folder / "points.yaml")
    points._put([Point((0.0, 0.0, 0.25))])
    return DriveTab(rig.requests, rig.machine)


def driven(rig):
    """Return what was driven last, in the units of the page, as a flat list; empty for nothing."""
    asked, rig.machine.asked = rig.machine.asked, None
    return [] if asked is None else [1000.0 * part for part in np.hstack([*map(np.ravel, asked)])]


# The field, what is clicked on, where it stands in what is driven by it, and its bounds.
FIELDS = [
    *((f"{axis} [mm]", "Go", place, -math.inf, math.inf) for place, axis in enumerate("xyz")),
    ("at [mm/s]", "Go", 3, 0.01, math.inf),
    ("Own step [mm]", "jog", 2, 0.001, 100),
    ("Jog [mm/s]", "jog", 3, 0.01, 200),
    ("Corners [mm]", "Drive through them", -2, 0, math.inf),
    ("Speed [mm/s]", "Drive through them", -1, 0.01, math.inf),
]


def test_what_is_driven_is_what_the_field_shows_or_nothing_and_that_is_told(rig, tmp_path):
    requests, rng = rig.requests, np.random.default_rng(51)
    tabs(rig, tmp_path)
    rig.press("own")
    for label, button, place, least, most in FIELDS:
        drawn = ("".join(rng.choice(list(SIGNS), rng.integers(0, 7))) for _ in range(200))
        for number, text in enumerate((*TYPED, *drawn)):
            # Pasted, or typed key by key.
            for end in [len(text)] if number % 2 else range(len(text) + 1):
                field = rig.press(label, text[:end])
            requests.refusal = ""
            rig.press(button)
            found, wanted = driven(rig), meant(text)
            if wanted is not None and least <= wanted <= most:
                assert found[place] == pytest.approx(float(wanted), rel=1e-12), text
                assert not requests.refusal
            else:
                assert not found, text
                assert f"nothing done: {label}: " in requests.refusal
                # It shows again what holds, and that is driven then.
                rig.press(button)
                assert driven(rig)[place] == pytest.approx(float(field.value))


def test_a_speed_that_is_none_jogs_nothing_before_the_button_is_released(rig, tmp_path):
    requests = rig.requests
    tabs(rig, tmp_path)
    rig.press("Jog [mm/s]", "")
    button = rig.handle("jog")
    (hold,) = button._impl.hold_cbs_from_freq[RENEWALS]
    asyncio.run(hold(rig.event(button)))
    assert "nothing done: Jog [mm/s]: '' must be" in requests.refusal
    # The field shows the last number again, but nobody has pressed for that.
    requests.refusal = ""
    for _ in range(3):
        time.sleep(1.0 / RENEWALS)
        asyncio.run(hold(rig.event(button)))
    assert not requests._hold._has_moved
    asyncio.run(requests.release(rig.event(button)))
    for _ in range(20):
        time.sleep(1.0 / RENEWALS)
        asyncio.run(hold(rig.event(button)))
    assert requests._hold._has_moved and not requests.refusal
    asyncio.run(requests.release(rig.event(button)))


def test_a_slider_shows_again_what_holds_and_the_number_and_the_bound_are_told(rig):
    requests, changes = rig.requests, []
    slider = rig.gui.add_slider("Override [%]", min=1, max=200, step=1, initial_value=100)
    requests.field(slider, changes.append)
    for value, is_taken in ((500, False), (0, False), (200, True), (-1, False)):
        requests.refusal = ""
        rig.send(slider, value)
        assert slider.value == (value if is_taken else 200 if changes else 100)
        told = f"nothing done: Override [%]: {value} must be from 1 to 200"
        assert requests.refusal == ("" if is_taken else told)
    assert changes == [200]
