"""What the page says of the machine."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.control.operating_state import OperatingState
from tri_glide_kinematics.panel.status_words import COLORS, FAULT, READY, WARNING, MachineStatus


def test_each_state_of_the_controller_has_a_colour() -> None:
    assert set(COLORS) == {state.name.lower() for state in OperatingState}


@pytest.mark.parametrize(
    ("state", "color"), [("idle", READY), ("fault", FAULT), ("disabled", WARNING), ("?", WARNING)]
)
def test_colours(state: str, color: str) -> None:
    assert MachineStatus.of({"state": state}).color == color


def test_a_remark_stands_behind_the_reason() -> None:
    values = {"state": "idle", "reason": "at rest", "remark": "two of them"}
    status = MachineStatus.of({**values, "refused commands": "3", "last refusal": "no"})
    assert status == MachineStatus("idle", "at rest; two of them", 3, "no")


def test_a_message_without_values_means_nothing() -> None:
    assert MachineStatus.of({"refused commands": "x"}) == MachineStatus()
