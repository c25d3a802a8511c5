"""The machine of the page: what is told of it, and where it is sent."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import Point
from panel_rig import PanelRig, tell
from rcl_interfaces.msg import ParameterEvent

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import Cause, OperatingState
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.panel.link import SILENCE, STATE_SILENCE
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.status_strip import strip_of

pytestmark = pytest.mark.nodes

UP = (0.0, 0.0, 0.01)


@pytest.fixture
def places(machine: ShownMachine, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Return the places that it is sent to [m]."""
    found: list[Any] = []

    def move_to(place: Any, speed: float) -> Any:
        del speed
        found.append(place)
        # It is on its way as long as nobody has told the end of it.
        return SimpleNamespace(result=None, cancel=lambda: None)

    monkeypatch.setattr(machine.link.programs, "move_to", move_to)
    return found


def step(machine: ShownMachine, places: list[Any]) -> float:
    """Make a step, and return the height that it leads to [m]."""
    machine.move_by(UP, 0.02)
    return float(places[-1][2])


def test_steps_add_up_while_the_machine_moves_and_soon_after_they_were_sent(
    machine: ShownMachine, places: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert step(machine, places) == pytest.approx(0.26)
    # It is not seen yet.
    assert step(machine, places) == pytest.approx(0.27)
    tell(machine, state=MachineState.MOVING)
    assert step(machine, places) == pytest.approx(0.28)
    later = time.monotonic() + 0.8 * SILENCE
    monkeypatch.setattr("tri_glide_kinematics.panel.machine.time.monotonic", lambda: later)
    monkeypatch.setattr("tri_glide_kinematics.panel.machine.STEP_PATIENCE", 0.5 * SILENCE)
    assert step(machine, places) == pytest.approx(0.29)
    tell(machine)
    later += 0.6 * SILENCE
    assert step(machine, places) == pytest.approx(0.26)


@pytest.mark.parametrize("state", [None, *OperatingState])
def test_a_state_in_between_drops_a_step_but_for_its_own_motion_and_its_end(
    machine: ShownMachine, places: list[Any], state: OperatingState | None
) -> None:
    step(machine, places)
    tell(machine, state=0 if state is None else getattr(MachineState, state.name))
    is_own = state in (OperatingState.IDLE, OperatingState.MOVING)
    assert step(machine, places) == pytest.approx(0.27 if is_own else 0.26)


def test_another_goal_and_a_stop_drop_a_step(machine: ShownMachine, places: list[Any]) -> None:
    ends = (
        # A goal of another client has taken the place of it.
        lambda: setattr(machine._goal, "result", SimpleNamespace(code=GoalCode.SUPERSEDED)),
        lambda: machine.move_to((0.0, 0.0, 0.3), 0.02),
        machine.stop,
    )
    for end in ends:
        step(machine, places)
        end()
        assert step(machine, places) == pytest.approx(0.26)
        machine.stop()


def test_a_machine_that_is_not_known_is_sent_nowhere(
    machine: ShownMachine, places: list[Any]
) -> None:
    machine.feeds.motion.forget()
    with pytest.raises(KinematicsError, match="no step: the position of the platform is not known"):
        machine.move_by(UP, 0.02)
    machine._forget()
    for drive in (machine.move_to, machine.move_by):
        with pytest.raises(KinematicsError, match="has not told its target yet"):
            drive(UP, 0.02)
    assert not places
    assert machine.place is machine.commanded_position is None


@pytest.mark.parametrize("cause", [Cause.TWISTS_SILENT, Cause.RELEASED])
def test_a_jog_that_somebody_has_ended_goes_on_no_more_and_one_that_was_late_does(
    rig: PanelRig, machine: ShownMachine, cause: Cause, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends: list[str] = []
    monkeypatch.setattr(rig.requests, "end_hold", lambda: ends.append("end"))
    stop_asked = int(Cause.STOP_ASKED)
    # It has not begun.
    tell(machine, cause=stop_asked)
    tell(machine, state=MachineState.JOGGING)
    # After a release, another button may be held by now.
    for state in (MachineState.STOPPING, MachineState.IDLE):
        tell(machine, state=state, cause=int(cause))
    assert not ends
    # That is told once.
    for state in (MachineState.STOPPING, MachineState.IDLE):
        tell(machine, state=state, cause=stop_asked)
    assert ends == ["end"]


def test_a_refusal_is_told_with_the_bound_that_the_place_breaks(
    rig: PanelRig, machine: ShownMachine, places: list[Any]
) -> None:
    outside = {"refused": 1, "refusal": MachineState.REFUSAL_OUTSIDE_WORKSPACE}
    machine.move_to((0.9, 0.0, 0.25), 0.02)
    tell(machine, **outside)
    assert rig.requests.refusal.startswith("(900, 0, 250) mm is outside the workspace: ")
    # Of another client nobody knows the place here.
    tell(machine, **{**outside, "refused": 2})
    assert rig.requests.refusal.startswith("refused: ")


def test_a_platform_that_is_measured_elsewhere_than_it_was_sent_is_told_once(
    rig: PanelRig, machine: ShownMachine, places: list[Any]
) -> None:
    for _ in range(2):
        machine.move_to(UP, 0.02)
    machine._goal.result = SimpleNamespace(code=GoalCode.NOT_REACHED, position=Point(z=0.0123))
    for _ in range(2):
        machine.step()
    told = [each.text for each in rig.requests.history if each.color == "refusal"]
    assert told == ["not reached: the platform is measured at (0, 0, 12.3) mm"]


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
