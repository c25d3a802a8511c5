"""The command calibrate."""

import math
import re
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
    launch = "ros2 launch tri_glide_kinematics tri_glide.launch.py"
    assert said.splitlines()[-1] == f"next: {launch} calibrated:={output / PARAMETERS}"


SETTINGS = """\
M665 R104.2 L214.0 B90 H297.05 X0 Y0 Z0
M666 X0 Y0 Z0
"""
PLACES = "".join(
    f"G30 P{i} X{80 * math.cos(i):.2f} Y{80 * math.sin(i):.2f} Z-99999\n" for i in range(9)
)
HEIGHTS = "0.31 0.28 0.33 0.29 0.30 0.31 0.32 0.29 0.30"


@pytest.mark.usefixtures("quick_pictures")
def test_a_log_becomes_lines_for_its_firmware(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("config.g").write_text(SETTINGS)
    Path("bed.g").write_text(PLACES)
    Path("g32.txt").write_text(f"G32 bed probe heights: {HEIGHTS}, mean 0.303\n")
    Path("older.g").write_text(SETTINGS.replace("L214.0", "L999"))
    settings = ["--settings", "older.g", "config.g"]
    with pytest.raises(SystemExit):
        main([*settings, "g32.txt"])
    assert "name the file that is to be calibrated first" in capsys.readouterr().err
    arguments = ["g32.txt", *settings, "--places", "bed.g", "--next", "0"]
    assert main(arguments) == 0
    said = capsys.readouterr()
    assert "calibrate: note: assumed (standard deviations): touches within 0.02 mm" in said.err
    lines = said.out.splitlines()
    assert lines[-1] == "next: M500"
    assert re.search(r"^; x and y here are those of the machine plus .* mm.$", said.out, re.M)
    # The bed was met 0.3 mm too early: the nozzle is lower than the firmware believes.
    height = re.search(r"^M665 L\S+ R\S+ H(\S+)", said.out, re.MULTILINE)
    assert float(height[1]) == pytest.approx(297.05 - 0.303, abs=0.1)
    # What was read is kept, to be changed by hand; the lines are printed then, too.
    assert main(["out/measurements.yaml", "--settings", "config.g", "--output", "again"]) == 0
    again = capsys.readouterr().out.splitlines()
    assert [line[:15] for line in again[-4:]] == [line[:15] for line in lines[-4:]]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "g32.txt: is what a firmware measured: name its settings of that moment"),
        (["--settings", "none.g"], "none.g: cannot be read: No such file"),
        (["--settings", "config.g"], "g32.txt: line 1: nobody says where P0 is: name bed.g"),
        (["--settings", "g32.txt"], "g32.txt: whose settings?"),
    ],
)
def test_a_log_that_is_not_understood_gets_one_line(
    tmp_path, capsys, monkeypatch, arguments, words
):
    monkeypatch.chdir(tmp_path)
    Path("config.g").write_text(SETTINGS)
    Path("g32.txt").write_text(f"G32 bed probe heights: {HEIGHTS}, mean 0.303\n")
    assert main(["g32.txt", *arguments]) == 1
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert not Path("out").exists()


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
