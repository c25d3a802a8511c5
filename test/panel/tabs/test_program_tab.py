"""The tab of programs on a page without a browser: files, checks, the listing, and runs."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from panel_rig import FACTS, OPERATOR, OTHER, PanelRig, ProgramRig
from viser import _messages as messages

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.panel.programs import (
    FROM_SETTINGS,
    NO_FILE,
    PIECE,
    Uploads,
)
from tri_glide_kinematics.panel.tabs import ProgramTab
from tri_glide_kinematics.programs import RunState

pytestmark = pytest.mark.nodes

SQUARE = "G21 G90 G17 (mm)\nG0 X0 Y0 Z260\nG1 X-20 F6000\nG1 X60 F1200\nM0\nG1 X0\nM2\n"


class Rig(ProgramRig):
    """The tab, and what its page shows."""

    def __init__(self, rig: PanelRig, folder: Path) -> None:
        super().__init__(rig, rig.machine, folder)
        rig.machine.feeds = SimpleNamespace(status=SimpleNamespace(message=MachineState()))
        self.uploads = Uploads(self.folder, rig.requests, lambda *_: None)
        what = self.runs, self.uploads, self.chosen, folder / "progress.yaml"
        self.tab = ProgramTab(rig.requests, rig.machine, *what)

    def choose(self, name: str, text: str) -> None:
        """Put a file into the folder, and choose it."""
        (self.folder.folder / name).write_text(text)
        self.tab.files._show_list()
        self.press("File", name)

    def send(self, name: str, size: int, content: bytes) -> None:
        """Send the first piece of a file."""
        parts = (
            messages.FileTransferStartUpload("", name, name, "", 1, size),
            messages.FileTransferPart("", name, 0, content),
        )
        for part in parts:
            self.uploads.take(OPERATOR, part)
        self.requests.fulfil()

    @property
    def words(self) -> str:
        """All that the tab tells."""
        self.tab.step()
        self.tab.files._pace.hurry()
        self.tab._pace.hurry()
        self.tab.show()
        return self.tab._words.content + self.tab._progress.content + self.requests.refusal

    def read_until(self, words: str) -> None:
        self.wait_for(lambda: words in self.words)


@pytest.fixture
def tab(rig: PanelRig, tmp_path: Path) -> Rig:
    return Rig(rig, tmp_path)


def test_a_file_is_seen_and_checked_and_another_limit_takes_the_check_away(tab: Rig) -> None:
    scene = tab.rig.server.scene
    tab.choose("square.ngc", SQUARE)
    tab.read_until("-20 to 60 mm")
    assert scene.get_handle_by_name("/program") is not None
    tab.press("check")
    tab.read_until("duration</td><td>0:0")
    # It holds for the limits of that time.
    tab.rig.machine.facts = FACTS.with_changes({"speed_scale": 0.5})
    tab.read_until("have changed since the check")
    assert "not known before the check" in tab.words
    tab.press("check")
    # F is scaled, too.
    tab.read_until("duration</td><td>0:1")
    assert "changed since the check" not in tab.words
    # A file that is gone from the folder is gone from the page.
    tab.folder.remove("square.ngc")
    tab.read_until("square.ngc is no longer in the folder")
    assert scene.get_handle_by_name("/program") is None
    assert tab.rig.handle("File").value == NO_FILE


def test_a_program_that_is_wrong_tells_its_line_and_does_not_run(tab: Rig) -> None:
    tab.choose("wrong.ngc", "G21\nG1 X0 Y0 Z260 F500\nG1 Xten\nM2\n")
    tab.read_until("wrong.ngc: line 3")
    assert tab.rig.handle("From line").value == "3"
    tab.choose("far.ngc", "G21\nG1 X0 Y0 Z260 F500\nG1 X900\nM2\n")
    tab.read_until("line 3 leads outside the workspace")
    # The proof does not hide it, neither while it goes on nor afterwards.
    tab.press("check")
    tab.press("run")
    assert tab.requests.refusal == "nothing begun: far.ngc is being proved"
    tab.wait_for(lambda: tab.words and not tab.chosen.is_in_work)
    tab.press("run")
    assert tab.requests.refusal == "nothing begun: line 3 leads outside the workspace"
    assert not tab.runs.is_running


def test_what_is_sent_read_or_proved_is_cancelled(tab: Rig) -> None:
    def cancel(work: str) -> None:
        assert f"is being {work}" in tab.words
        tab.press("cancel")
        assert f"is being {work} (" not in tab.words
        assert f"is being {work}" in next(iter(tab.requests.history)).text

    tab.send("large.ngc", 3 * PIECE, b"(" + bytes(PIECE - 1))
    assert "33 %" in tab.words
    cancel("sent")
    assert tab.folder.names() == []
    tab.choose("square.ngc", SQUARE)
    cancel("read")
    assert tab.rig.handle("File").value == NO_FILE
    tab.press("File", "square.ngc")
    tab.read_until("-20 to 60 mm")
    tab.press("check")
    cancel("proved")
    assert "not known before the check" in tab.words
    tab.press("cancel")
    assert tab.requests.refusal.startswith("nothing cancelled: ")


def test_a_program_whose_reading_gives_way_to_another_that_is_sent_is_told(tab: Rig) -> None:
    for name in ("first.ngc", "second.ngc"):
        tab.send(name, len(SQUARE), SQUARE.encode())
        assert f"{name} is being read" in tab.words
    told = [each.text for each in tab.requests.history]
    assert told == ["first.ngc is being read no more: second.ngc was sent"]
    assert set(tab.folder.names()) == {"first.ngc", "second.ngc"}
    tab.read_until("-20 to 60 mm")
    tab.send("third.ngc", len(SQUARE), SQUARE.encode())
    assert "third.ngc is being read" in tab.words
    assert len(list(tab.requests.history)) == 1


def test_lines_are_chosen_in_the_listing_and_files_renamed_sent_and_deleted(
    tab: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[Any] = []
    page = SimpleNamespace(send_file_download=lambda *what, **_: sent.append(what[:2]))
    monkeypatch.setattr(tab.rig.server, "get_clients", lambda: {OPERATOR: page})
    tab.press("rename")
    assert tab.requests.refusal == "choose a program first"
    tab.choose("square.ngc", SQUARE)
    tab.read_until("-20 to 60 mm")
    assert "3  G1 X-20 F6000" in tab.tab._actions._listing._html.content
    tab.rig.send(tab.tab._actions._listing._rows[2], True)
    assert tab.rig.handle("From line").value == "3"
    # What is being typed stays until it is needed.
    tab.press("From line", "")
    assert "3  G1 X-20 F6000" in tab.words + tab.tab._actions._listing._html.content
    assert tab.rig.handle("From line").value == ""
    tab.press("download")
    assert sent == [("square.ngc", SQUARE.encode())]
    tab.press("Name", "renamed.ngc")
    tab.press("rename")
    assert tab.folder.names() == ["renamed.ngc"]
    assert tab.rig.handle("File").value == "renamed.ngc"
    tab.press("delete")
    assert "delete renamed.ngc? Press delete once more" in tab.requests.refusal
    assert tab.folder.names() == ["renamed.ngc"]
    tab.press("delete")
    assert tab.folder.names() == []
    assert tab.rig.handle("File").value == NO_FILE


def test_what_runs_is_not_changed_and_read_again_when_it_has_ended(tab: Rig) -> None:
    tab.choose("part.ngc", SQUARE)
    tab.read_until("-20 to 60 mm")
    run: Any = SimpleNamespace(
        state=RunState.RUNNING, line=4, reports=(), is_whole=False, was_stopped=True
    )
    ends: list[RunState] = []
    run.stop = lambda: ends.append(RunState.ENDED)
    run.look = lambda _: setattr(run, "state", (*ends, RunState.RUNNING)[0])
    tab.chosen.begin_run(run)
    tab.runs.begin(run, tab.tab._end_run)
    for what, told in (("run", "runs already"), ("delete", "nothing done: part.ngc runs")):
        tab.press(what)
        assert told in tab.requests.refusal
    tab.press("Dialect", "marlin")
    assert tab.requests.refusal == "dialect not changed: part.ngc runs"
    assert tab.rig.handle("Dialect").value == FROM_SETTINGS
    content = SQUARE.replace("X60", "X70").encode()
    tab.send("part.ngc", len(content), content)
    assert "part.ngc runs as it was" in tab.requests.refusal
    assert "what runs is what was read before" in tab.words
    # Any page may stop it, and do nothing else.
    tab.press("go on", page=OTHER)
    assert "nothing done, as the controls are with page 1" in tab.requests.refusal
    tab.press("stop", page=OTHER)
    tab.runs.step()
    assert next(iter(tab.requests.history)).text == "part.ngc: stopped at line 4"
    tab.read_until("-20 to 70 mm")
    # And when somebody else writes it.
    (tab.folder.folder / "part.ngc").write_text(SQUARE.replace("X60", "X75"))
    tab.read_until("-20 to 75 mm")
    assert "it is read again" in tab.requests.refusal


def test_a_choice_that_is_none_is_not_taken(tab: Rig) -> None:
    tab.choose("square.ngc", SQUARE)
    tab.press("Dialect", "x" * 1000)
    assert tab.requests.refusal == f"nothing done: there is no choice '{'x' * 20}'"
    assert tab.rig.handle("Dialect").value == FROM_SETTINGS
    tab.press("File", "../settings.yaml")
    assert tab.requests.refusal == "nothing done: there is no choice '../settings.yaml'"
    assert tab.chosen.name == "square.ngc"
