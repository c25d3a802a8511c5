"""Taught points and their file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from full_disk import full_disk

from tri_glide_kinematics.panel.tabs import PointsFileError, load_points, save_points
from tri_glide_kinematics.programs import DriveFileError, PathStep, load_drive

POINTS = [(0.01, -0.0, 0.25), (-0.0312345678, 0.02, 0.3), (1e-9, 0.0, 0.2999)]


def test_what_is_saved_is_what_drive_reads(tmp_path: Path) -> None:
    file = tmp_path / "points.yaml"
    save_points(file, POINTS, 0.002, 0.05)
    (step,) = load_drive(file).steps
    assert isinstance(step, PathStep)
    assert step.segments.tolerances == pytest.approx(0.002)
    assert step.segments.speeds == pytest.approx(0.05)
    # To a ten-thousandth of a millimetre.
    assert np.array(load_points(file)) == pytest.approx(np.array(POINTS), abs=1e-7)


def test_random_points_come_back(tmp_path: Path) -> None:
    source = np.random.default_rng(13)
    for count in (1, 2, 40):
        points = source.uniform(-1.0, 1.0, (count, 3))
        save_points(tmp_path / "p.yaml", [tuple(point) for point in points], 0.0, 0.0)
        assert np.array(load_points(tmp_path / "p.yaml")) == pytest.approx(points, abs=1e-7)


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
    for length in range(len(whole)):
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
