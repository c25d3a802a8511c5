"""What the page says of the machine."""

from __future__ import annotations

import pytest

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import PAUSED, Cause, OperatingState
from tri_glide_kinematics.panel.feeds import COLORS, FAULT, READY, WARNING, MachineStatus


def test_each_state_of_the_controller_has_a_colour() -> None:
    assert set(COLORS) == set(OperatingState)


@pytest.mark.parametrize(
    ("state", "color"),
    [
        (MachineState.IDLE, READY),
        (MachineState.FAULT, FAULT),
        (MachineState.DISABLED, WARNING),
        (0, WARNING),
        (200, WARNING),
    ],
)
def test_colours(state: int, color: str) -> None:
    assert MachineStatus.of(MachineState(state=state)).color == color


def test_a_remark_stands_behind_the_reason() -> None:
    message = MachineState(
        state=MachineState.PAUSED,
        cause=MachineState.CAUSE_PAUSE_ASKED,
        reason="rests",
        remark="two of them",
        refused=3,
        refusal_text="no",
        shaper_waits=True,
    )
    status = MachineStatus.of(message)
    reason = "rests; two of them"
    assert status == MachineStatus(PAUSED, Cause.PAUSE_ASKED, reason, 3, "no", shaper_waits=True)
    assert status.word == "paused"


def test_a_message_without_values_means_nothing() -> None:
    assert MachineStatus.of(MachineState()) == MachineStatus()
    assert MachineStatus.of(MachineState(state=200, cause=200)) == MachineStatus()
