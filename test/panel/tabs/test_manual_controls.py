"""What is done by hand beside jogs: typed lines, own buttons, work zero, and outputs."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from panel_rig import OTHER, PanelRig, ProgramRig, tell

from tri_glide_interfaces.msg import MachineState
from tri_glide_interfaces.msg import Output as OutputMessage
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.tabs import ManualControls
from tri_glide_kinematics.panel.tabs.manual_controls import MOST_VALUES, SHOWS
from tri_glide_kinematics.programs import RunState, load_buttons, load_zeros

pytestmark = pytest.mark.nodes

LINE = "G1 X10 F600"


class Rig(ProgramRig):
    """The folders, and what they show and send."""

    def __init__(self, rig: PanelRig, machine: ShownMachine, folder: Path) -> None:
        super().__init__(rig, machine, folder)
        self.controls = ManualControls(rig.requests, machine, self.runs, self.chosen)
        self.switched: list[Any] = []
        self.runs.link.put_out = self.switched.append  # type: ignore[method-assign]

    def type(self, line: str) -> None:
        self.rig.send(self.controls._typed._typed, line)

    @property
    def words(self) -> str:
        self.controls.step()
        self.controls.show()
        return self.controls._driver.words


@pytest.fixture
def hand(rig: PanelRig, machine: ShownMachine, tmp_path: Path) -> Rig:
    return Rig(rig, machine, tmp_path)


def test_a_typed_line_is_proved_and_runs(hand: Rig) -> None:
    hand.type(LINE)
    assert hand.words == f"{LINE}: is proved"
    assert hand.runs.is_taken and not hand.runs.is_running
    hand.type("G1 X20 F600")
    assert hand.refusal == "nothing driven: another line is not done yet"
    hand.wait_for(lambda: hand.words and hand.runs.is_running)
    assert not hand.runs.is_reserved
    assert list(hand.controls._typed.lines) == ["G1 X20 F600", LINE]
    hand.type(LINE)
    assert hand.refusal == "nothing driven: another line is not done yet"
    # What the proof refuses is not driven.
    hand.runs._run = None
    hand.type("G1 X900 F600")
    hand.wait_for(lambda: hand.words == "" and "line 1" in hand.refusal)
    assert not hand.runs.is_taken


def test_a_line_is_not_driven_from_another_place_or_state_or_after_stop(hand: Rig) -> None:
    tell(hand.machine, state=MachineState.DISABLED)
    hand.type(LINE)
    assert hand.refusal == "nothing driven: the machine is disabled, and has to be idle"
    tell(hand.machine)
    hand.type(LINE)
    hand.controls._driver._from = (0.0, 0.0, 0.26)
    hand.wait_for(lambda: not hand.words and "was moved meanwhile" in hand.refusal)

    def stop() -> None:
        for end in hand.rig.requests.on_stop:
            end()

    # Nor when the node ends.
    for ending in (stop, hand.runs.may_end):
        hand.type(LINE)
        assert hand.runs.is_taken
        ending()
        assert not hand.runs.is_taken
        assert hand.words == ""


def test_the_end_of_a_run_that_raises_then_is_not_missed(hand: Rig) -> None:
    ended: list[bool] = []
    run: Any = SimpleNamespace(state=RunState.RUNNING)

    def look(_: float) -> None:
        run.state = RunState.ENDED
        raise KinematicsError("no end")

    run.look = look
    hand.runs.begin(run, lambda: ended.append(True))
    hand.runs.step()
    assert hand.refusal == "program: no end"
    assert ended == [True] and not hand.runs.is_taken


def test_a_run_goes_on_by_resume_and_ends_with_stop(hand: Rig) -> None:
    asked: list[str] = []
    run: Any = SimpleNamespace(state=RunState.WAITING, is_delivered=lambda _: True)
    run.go_on = lambda: asked.append("go on") or len(asked) == 1
    run.look, run.stop = lambda _: asked.append("look"), lambda: asked.append("stop")
    assert hand.runs.may_end()
    hand.runs.begin(run, lambda: asked.append("end"), [("spindle", 0)])
    link = hand.rig.requests.link
    link.trigger("resume")
    assert asked == ["go on"] and not hand.refusal
    # Where nothing waits any more, it is for the machine.
    link.trigger("resume")
    assert hand.refusal.startswith("resume: nobody answers as ")
    assert hand.runs.owns(("spindle", 0)) and not hand.runs.owns(("flood", 0))
    hand.runs.step()

    def fail(_: float) -> None:
        raise KinematicsError("no disk")

    run.look = fail
    hand.runs.step()
    assert hand.refusal == "program: no disk"
    run.look = lambda _: setattr(run, "state", RunState.ENDED)
    hand.runs.step()
    assert asked[2:] == ["look", "end"]
    assert not hand.runs.owns(("spindle", 0))
    assert hand.runs.may_end() and asked[-1] == "stop"


def test_own_buttons_are_made_pressed_and_removed(hand: Rig) -> None:
    hand.press("Button", "there")
    hand.press("newest line")
    assert hand.refusal == "nothing made: type a line first"
    hand.controls._typed.lines.append(LINE)
    hand.press("newest line")
    file = hand.controls._own._file
    assert load_buttons(file) == {"there": LINE}
    assert hand.words == ""
    hand.press("there")
    assert hand.words == "there: is proved"
    hand.press("newest line")
    assert hand.refusal == "nothing made: there is a button there already; remove one first"
    for name in ("", "x" * 25):
        hand.press("Button", name)
        hand.press("newest line")
        assert "a name has 1 to 24 characters that can be printed, not " in hand.refusal
    hand.press("Button", "there")
    hand.press("remove")
    assert load_buttons(file) == {}
    hand.press("remove")
    assert hand.refusal == "nothing removed: no button has the name 'there'"
    hand.press("Button", "file")
    hand.press("chosen file")
    assert hand.refusal == "choose a program first"


def test_a_mistake_in_the_file_of_own_buttons_is_told_once(hand: Rig) -> None:
    hand.controls._own._file.write_text("there: [1]\n")
    for _ in range(3):
        assert hand.words == ""
    assert "must have a text for each name" in hand.refusal
    told = [each.count for each in hand.rig.requests.history if "must have" in each.text]
    assert told == [1]


def test_the_present_place_gets_a_number_from_the_work_zero(hand: Rig) -> None:
    hand.press("This place is [mm]", "50")
    hand.press("z")
    assert load_zeros(hand.zeros)["G54"] == pytest.approx((0.0, 0.0, 0.2))
    _ = hand.words
    assert hand.controls.work_zero.text == "\nG54: X 0.00  Y 0.00  Z 50.00  mm"
    tell(hand.machine, speed=0.1)
    hand.press("x")
    assert hand.refusal == "nothing set: the platform moves, or its place is not known"
    hand.press("clear")
    assert load_zeros(hand.zeros) == {}
    _ = hand.words
    assert hand.controls.work_zero.text == ""


def test_an_output_is_switched_off_at_any_time_and_on_if_the_machine_may_move(hand: Rig) -> None:
    hand.press("M3, or M4 if < 0 [1/min]", "-800")
    hand.press("spindle", True)
    assert [(each.name, each.value) for each in hand.switched] == [("spindle", -800.0)]
    # It shows what was asked for until that is told, or is not told for a while; and may be
    # switched off meanwhile.
    _ = hand.words
    assert hand.rig.handle("spindle").value is True
    hand.press("spindle", False)
    hand.press("spindle", True)
    assert [each.value for each in hand.switched] == [-800.0, 0.0, -800.0]
    for _ in range(SHOWS + 1):
        hand.controls.show()
    assert hand.rig.handle("spindle").value is False
    del hand.switched[1:]
    hand.machine.feeds._on_output(
        OutputMessage(name="fan", number=2, value=255.0), {"source_timestamp": 1}
    )
    _ = hand.words
    assert hand.rig.handle("fan 2").value is True
    # No more of them are shown, however many are told.
    for number in range(2 * MOST_VALUES):
        hand.machine.feeds._on_output(OutputMessage(name=f"n{number}"), {"source_timestamp": 1})
    _ = hand.words
    assert hand.controls._outputs._values.content.count("<tr>") == MOST_VALUES
    tell(hand.machine, state=MachineState.FAULT)
    hand.press("flood", True)
    assert hand.refusal == "flood not switched on: the machine is fault"
    _ = hand.words
    assert hand.rig.handle("flood").value is False
    hand.press("fan 2", False)
    assert [(each.name, each.value) for each in hand.switched[1:]] == [("fan", 0.0)]
    hand.press("flood", False, OTHER)
    assert "nothing done, as the controls" in hand.refusal
    run: Any = SimpleNamespace(state=RunState.RUNNING)
    hand.runs.begin(run, lambda: None, [("fan", 2)])
    hand.press("fan 2", False)
    assert hand.refusal == "fan 2 not switched: the program that runs does so"
