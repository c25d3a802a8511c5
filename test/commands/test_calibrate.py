"""The command calibrate."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from calibration_samples import measured

from tri_glide_kinematics.calibration.fit import save_measurements
from tri_glide_kinematics.commands.calibrate import PARAMETERS, PICTURE, REPORT, main

EXAMPLE = Path(__file__).parents[2] / "config" / "measurements_example.yaml"


@pytest.fixture(autouse=True)
def quick_pictures(monkeypatch):
    """Let pictures be empty files."""
    name = "tri_glide_kinematics.picture_commands.save_figure"
    monkeypatch.setattr(name, lambda figure, file, _: file.touch())


def test_a_file_becomes_report_picture_and_parameters(tmp_path, capsys):
    file = tmp_path / "measurements.yaml"
    save_measurements(file, measured())
    output = tmp_path / "out"
    assert main([str(file), "--output", str(output), "--next", "1"]) == 0
    said = capsys.readouterr().out
    assert said.startswith((output / REPORT).read_text(encoding="utf-8").rstrip())
    assert said.count("the uncertain volume shrinks to") == 1
    assert (output / PICTURE).exists()
    assert yaml.safe_load((output / PARAMETERS).read_text(encoding="utf-8"))


def test_the_example_can_be_calibrated(tmp_path, capsys):
    assert main([str(EXAMPLE), "--output", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "Warnings" not in said


def test_a_gross_contradiction_makes_no_parameter_file_unless_it_is_forced(tmp_path, capsys):
    """Priors in another unit: the data are as good as before, and the machine may not move."""
    text = EXAMPLE.read_text()
    priors = "anchors: 0.5, arm_lengths: 0.3, height_offsets: 1.0"
    assert priors in text
    file, output = tmp_path / "file.yaml", tmp_path / "out"
    file.write_text(
        text.replace(priors, "anchors: 5.0e-4, arm_lengths: 3.0e-4, height_offsets: 0.001")
    )
    arguments = [str(file), "--output", str(output), "--next", "0"]
    assert main(arguments) == 1
    said = capsys.readouterr()
    assert "NOT VALID: measurements and assumptions contradict each other" in said.out
    assert "no parameter file without --force" in said.err
    assert (output / REPORT).exists()
    assert not (output / PARAMETERS).exists()
    assert main([*arguments, "--force"]) == 0
    assert (output / PARAMETERS).exists()


def test_what_is_proposed_lies_inside_the_workspace_of_the_file(tmp_path, capsys):
    travel = "lower_heights: [200.0, 200.0, 200.0]"
    text = EXAMPLE.read_text()
    assert travel in text
    file = tmp_path / "file.yaml"
    file.write_text(text.replace(travel, "lower_heights: [340.0, 340.0, 340.0]"))
    assert main([str(file), "--output", str(tmp_path / "out"), "--next", "9"]) == 0
    # Only the middle of the disc is high enough.
    assert capsys.readouterr().out.count("the uncertain volume shrinks to") == 1
