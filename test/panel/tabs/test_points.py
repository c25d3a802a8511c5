"""Taught points and their file."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from full_disk import full_disk
from joined_domain import joined_domain
from mechanisms_rig import page_server
from soak import some
from viser import GuiEvent

from testing.client import Probe
from tri_glide_kinematics.panel.link import MachineLink
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.tabs import PointsTab
from tri_glide_kinematics.panel.tabs.points_tab import (
    Point,
    PointsFileError,
    load_points,
    save_points,
)
from tri_glide_kinematics.programs import DriveFileError, PathStep, load_drive

PLACES = [(0.01, -0.0, 0.25), (-0.0312345678, 0.02, 0.3), (1e-9, 0.0, 0.2999)]
POINTS = [Point(place, name) for place, name in zip(PLACES, ("", 'over: the "tray" # 1', "äß"))]


def test_what_is_saved_is_what_drive_reads(tmp_path: Path) -> None:
    file = tmp_path / "points.yaml"
    save_points(file, POINTS, 0.002, 0.05)
    (step,) = load_drive(file).steps
    assert isinstance(step, PathStep)
    assert step.segments.tolerances == pytest.approx(0.002)
    assert step.segments.speeds == pytest.approx(0.05)
    loaded = load_points(file)
    # To a ten-thousandth of a millimetre.
    places = np.array([point.position for point in loaded])
    assert places == pytest.approx(np.array(PLACES), abs=1e-7)
    assert [point.name for point in loaded] == [point.name for point in POINTS]


def test_a_full_disk_loses_no_point(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    save_points(file, POINTS, 0.0, 0.0)
    before = file.read_text()
    with full_disk(200), pytest.raises(PointsFileError, match="cannot be written: File too large"):
        save_points(file, POINTS * 100, 0.0, 0.0)
    assert file.read_text() == before
    save_points(file, POINTS * 2, 0.0, 0.0)
    assert file.with_name("p.yaml.bak").read_text() == before
    file.write_text("steps: []\n")
    with pytest.raises(PointsFileError, match="its first line is not '# Points taught"):
        save_points(file, POINTS, 0.0, 0.0)


def test_a_file_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    save_points(file, POINTS, 0.002, 0.05)
    whole = file.read_bytes().rstrip()
    lengths = range(len(whole))
    for length in some([*lengths[::4], *lengths], len(lengths[::4])):
        file.write_bytes(whole[:length])
        with pytest.raises((DriveFileError, PointsFileError)):
            load_points(file)


def test_no_point_and_no_place_are_told(tmp_path: Path) -> None:
    with pytest.raises(PointsFileError, match="at least 1"):
        save_points(tmp_path / "p.yaml", [], 0.0, 0.0)
    with pytest.raises(PointsFileError, match="cannot be written"):
        save_points(tmp_path / "missing" / "p.yaml", POINTS, 0.0, 0.0)


@pytest.mark.parametrize(
    "step",
    ["move: {to: [0, 0, 0.3]}", "path: {segments: [{arc: {via: [0, 1, 0], to: [1, 0, 0]}}]}"],
)
def test_other_drives_are_refused(tmp_path: Path, step: str) -> None:
    (tmp_path / "p.yaml").write_text(f"steps:\n  - {step}\n")
    with pytest.raises(PointsFileError, match="more than one path of lines"):
        load_points(tmp_path / "p.yaml")
    with pytest.raises(DriveFileError):
        load_points(tmp_path / "nothing.yaml")


class Rig:
    """The tab on a real page server, as the page with the controls uses it.

    Attributes:
        here: where the platform is [m].
        gone_to: what was asked for: a position and a speed.
    """

    def __init__(self, gui: Any, probe: Probe, file: Path) -> None:
        self.gui = gui
        self.here = (0.0, 0.0, 0.25)
        self.gone_to: list[Any] = []
        self.requests = OperatorRequests(MachineLink(probe.node, print), lambda: None)
        self.requests.controls.opened(0)
        go = self._note
        self.tab = PointsTab(gui, self.requests, file, lambda: self.here, go, go)

    def _note(self, *asked: Any) -> None:
        self.gone_to.append(asked)

    def press(self, label: str, value: Any = None) -> None:
        """Press a button, choose of a group or type into a field, by its label."""
        (handle,) = [
            each
            for each in self.gui._gui_input_handle_from_uuid.values()
            if each._impl.props.label == label and each.visible
        ]
        if value is not None:
            handle._impl.value = value
        for callback in handle._impl.update_cb:
            asyncio.run(callback(GuiEvent(None, 0, handle)))  # type: ignore[arg-type]
        self.requests.fulfil()

    @property
    def names(self) -> list[str]:
        return [point.name for point in self.tab.points]


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    with joined_domain() as context, page_server() as server:
        probe = Probe(context, "/points", "panel")
        yield Rig(server.gui, probe, tmp_path / "taught.yaml")
        probe.close()


def taught(rig: Rig, count: int) -> None:
    for number in range(count):
        rig.here = (0.01 * number, 0.0, 0.25)
        rig.press("Teach this position")
        rig.press("Name", f"point {number}")
        rig.press("This one", "change")


@pytest.mark.nodes
def test_points_are_named_changed_and_gone_to(rig: Rig) -> None:
    taught(rig, 3)
    assert rig.names == ["point 0", "point 1", "point 2"]
    rig.press("Number", 2)
    assert rig.tab._name.value == "point 1"
    for axis, number in zip("xyz", (1.0, 2.0, 300.0)):
        rig.press(f"{axis} [mm]", number)
    rig.press("This one", "change")
    rig.press("This one", "go to")
    # Slowly, unless somebody asks for more.
    assert rig.gone_to == [(pytest.approx((0.001, 0.002, 0.3)), pytest.approx(0.05))]
    rig.press("Name", "point 0")
    rig.press("This one", "change")
    assert rig.requests.refusal == "another point has the name 'point 0'"
    rig.press("Number", 4)
    rig.press("This one", "go to")
    assert rig.requests.refusal == "there is no point 4, of 3"
    assert len(rig.gone_to) == 1


@pytest.mark.nodes
def test_undo_brings_back_what_was_changed_removed_and_cleared(rig: Rig) -> None:
    taught(rig, 2)
    whole = rig.tab.points
    rig.press("Number", 1)
    rig.press("This one", "remove")
    assert rig.names == ["point 1"]
    rig.press("Points", "undo")
    assert rig.tab.points == whole
    # All are removed only by a second button.
    rig.press("Points", "clear")
    assert rig.tab.points == whole
    rig.press("Keep them")
    rig.press("Points", "clear")
    rig.press("Clear all 2 points")
    assert not rig.tab.points
    rig.press("Points", "undo")
    assert rig.tab.points == whole
    # Each point was taught, and named.
    for _ in range(4):
        rig.press("Points", "undo")
    assert not rig.tab.points
    rig.press("Points", "undo")
    assert rig.requests.refusal == "nothing to undo"


@pytest.mark.nodes
def test_there_are_several_files_in_one_folder(rig: Rig, tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text("a: 1\n")
    taught(rig, 1)
    for name in ("first", "second one"):
        rig.press("File name", name)
        rig.press("File", "save")
        taught(rig, 1)
        assert (tmp_path / f"{name}.yaml").exists()
    assert list(rig.tab._saved.options[1:]) == ["first", "second one"]
    rig.press("Files", "first")
    rig.press("File", "load")
    assert rig.names == ["point 0"]
    rig.press("Points", "undo")
    assert len(rig.names) == 3
    for name in ("../outside", "/etc/passwd", "", "a/b", ".hidden", "x" * 61):
        rig.press("File name", name)
        rig.press("File", "save")
        assert rig.requests.refusal.startswith("no file: its name has to have")
        rig.requests.refusal = ""
    assert not list(tmp_path.parent.glob("outside*"))
