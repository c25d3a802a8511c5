"""Taught points and their file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from full_disk import full_disk
from panel_rig import PanelRig
from soak import some

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


@pytest.fixture
def tab(rig: PanelRig, tmp_path: Path) -> PointsTab:
    return PointsTab(rig.requests, rig.machine, tmp_path / "taught.yaml")


def names(tab: PointsTab) -> list[str]:
    return [point.name for point in tab.points]


def taught(rig: PanelRig, count: int) -> None:
    for number in range(count):
        rig.machine.measured_position = (0.01 * number, 0.0, 0.25)
        rig.press("Teach this position")
        rig.press("Name", f"point {number}")
        rig.press("This one", "change")


@pytest.mark.nodes
def test_points_are_named_changed_and_gone_to(rig: PanelRig, tab: PointsTab) -> None:
    taught(rig, 3)
    assert names(tab) == ["point 0", "point 1", "point 2"]
    rig.press("Number", 2)
    assert tab._name.value == "point 1"
    for axis, number in zip("xyz", (1.0, 2.0, 300.0)):
        rig.press(f"{axis} [mm]", number)
    rig.press("This one", "change")
    rig.press("This one", "go to")
    # Slowly, unless somebody asks for more.
    assert rig.machine.asked == (pytest.approx((0.001, 0.002, 0.3)), pytest.approx(0.05))
    rig.machine.asked = None
    rig.press("Name", "point 0")
    rig.press("This one", "change")
    assert rig.requests.refusal == "another point has the name 'point 0'"
    rig.press("Number", 4)
    rig.press("This one", "go to")
    assert rig.requests.refusal == "there is no point 4, of 3"
    assert rig.machine.asked is None


@pytest.mark.nodes
def test_undo_brings_back_what_was_changed_removed_and_cleared(
    rig: PanelRig, tab: PointsTab
) -> None:
    taught(rig, 2)
    whole = tab.points
    rig.press("Number", 1)
    rig.press("This one", "remove")
    assert names(tab) == ["point 1"]
    rig.press("Points", "undo")
    assert tab.points == whole
    # All are removed only by a second button.
    rig.press("Points", "clear")
    assert tab.points == whole
    rig.press("Keep them")
    rig.press("Points", "clear")
    rig.press("Clear all 2 points")
    assert not tab.points
    rig.press("Points", "undo")
    assert tab.points == whole
    # Each point was taught, and named.
    for _ in range(4):
        rig.press("Points", "undo")
    assert not tab.points
    rig.press("Points", "undo")
    assert rig.requests.refusal == "nothing to undo"


@pytest.mark.nodes
def test_there_are_several_files_in_one_folder(
    rig: PanelRig, tab: PointsTab, tmp_path: Path
) -> None:
    (tmp_path / "other.yaml").write_text("a: 1\n")
    taught(rig, 1)
    for name in ("first", "second one"):
        rig.press("File name", name)
        rig.press("File", "save")
        taught(rig, 1)
        assert (tmp_path / f"{name}.yaml").exists()
    assert list(tab._saved.options[1:]) == ["first", "second one"]
    rig.press("Files", "first")
    rig.press("File", "load")
    assert names(tab) == ["point 0"]
    rig.press("Points", "undo")
    assert len(names(tab)) == 3
    for name in ("../outside", "/etc/passwd", "", "a/b", ".hidden", "x" * 61):
        rig.press("File name", name)
        rig.press("File", "save")
        assert rig.requests.refusal.startswith("no file: its name has to have")
        rig.requests.refusal = ""
    assert not list(tmp_path.parent.glob("outside*"))
