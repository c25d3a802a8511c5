"""The machine of the page: what is told of it, and where it is sent."""

from __future__ import annotations

from typing import Any

import pytest
from panel_rig import PanelRig, tell
from rcl_interfaces.msg import ParameterEvent

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.panel.link import STATE_SILENCE
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.status_strip import strip_of

pytestmark = pytest.mark.nodes

UP = (0.0, 0.0, 0.01)


def sent(machine: ShownMachine, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Return a list of the places that it is sent to from now on [m]."""
    places: list[Any] = []
    link = machine.link

    def move_to(place: Any, speed: float) -> None:
        del speed
        places.append(place)
        # It is on its way as long as nobody has told the end of it.
        link._goal = link._goal or type("Goal", (), {"result": None, "cancel": lambda _: None})()

    monkeypatch.setattr(link, "move_to", move_to)
    return places


def test_a_step_goes_on_from_the_last_one_until_something_else_came_between(
    machine: ShownMachine, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = sent(machine, monkeypatch)
    for _ in range(2):
        machine.move_by(UP, 0.02)
    assert [z for *_, z in places] == pytest.approx([0.26, 0.27])
    # A goal of another client has taken the place of it.
    machine.link.forget()
    machine.move_by(UP, 0.02)
    assert places[-1][2] == pytest.approx(0.26)
    for end in (lambda: tell(machine, state=MachineState.JOGGING), machine.stop):
        machine.move_by(UP, 0.02)
        end()
        machine.move_by(UP, 0.02)
        assert places[-1][2] == pytest.approx(0.26)


def test_a_machine_that_is_not_known_is_sent_nowhere(
    rig: PanelRig, machine: ShownMachine, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = sent(machine, monkeypatch)
    machine._forget()
    for drive in (machine.move_to, machine.move_by):
        rig.requests.refusal = ""
        drive(UP, 0.02)
        assert "has not told its target yet" in rig.requests.refusal
    assert not places
    assert machine.place is machine.commanded_position is None


def test_a_refusal_is_told_with_the_bound_that_the_place_breaks(
    rig: PanelRig, machine: ShownMachine
) -> None:
    outside = {"refused": 1, "refusal": MachineState.REFUSAL_OUTSIDE_WORKSPACE}
    machine.link.asked = (0.9, 0.0, 0.25)
    tell(machine, **outside)
    assert rig.requests.refusal.startswith("(900, 0, 250) mm is outside the workspace: ")
    # Of another client nobody knows the place here.
    tell(machine, **{**outside, "refused": 2})
    assert rig.requests.refusal.startswith("refused: ")


def test_states_and_the_teach_mode_are_kept_in_the_history(
    rig: PanelRig, machine: ShownMachine
) -> None:
    # A parameter changes at about the same time.
    machine.feeds._on_state(MachineState(state=MachineState.IDLE, teach_mode=True))
    machine._on_parameters(ParameterEvent(node=machine.link.server))
    tell(machine, teach_mode=True)
    assert machine.facts is not None and machine.facts.is_teaching
    tell(machine, state=MachineState.FAULT, cause=MachineState.CAUSE_STARTED_DISABLED)
    told = [(each.color, each.text) for each in rig.requests.history]
    assert told[0] == ("ready", "the teach mode is off")
    assert told[1] == ("fault", "fault: it was started disabled")
    assert told[2] == ("warning", "the teach mode is on")
    assert told[3] == ("ready", "idle: somebody has enabled it")


def test_the_strip_tells_what_is_known_and_no_more(
    rig: PanelRig, machine: ShownMachine, monkeypatch: pytest.MonkeyPatch
) -> None:
    def strip(page: int = 0, **more: str) -> Any:
        return strip_of(page, rig.requests, machine, **more)

    known = strip(left="0:10 left of part.ngc", work="\nG54: X 1")
    assert (known.color, known.state, known.stop) == ("ready", "idle", "ramps to rest (Esc)")
    assert known.left == "0:10 left of part.ngc"
    assert known.position.endswith("mm\nG54: X 1")
    assert known.controls and not strip(1).controls
    warned = strip(notice="fk_node has ended")
    assert (warned.color, warned.reason) == ("warning", "fk_node has ended; " + known.reason)
    # It moved, and is silent since.
    tell(machine, state=MachineState.MOVING, speed=0.1)
    later = machine.feeds._status_at + 1.1 * STATE_SILENCE
    monkeypatch.setattr("tri_glide_kinematics.panel.link.time.monotonic", lambda: later)
    silent = strip()
    assert (silent.state, silent.stop) == ("not heard", "not heard")
    assert "was moving and tells no more" in silent.reason
    assert silent.position.endswith("mm when last measured")
    machine.facts = None
    assert (strip().state, strip().position) == ("no machine", "")
