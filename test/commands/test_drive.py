"""The command that drives a file: what it decides before anything moves."""

import re
import sys
from pathlib import Path

import pytest

from tri_glide_kinematics.commands.drive import check_on_machine, main
from tri_glide_kinematics.control import TEACH_SPEED
from tri_glide_kinematics.programs import (
    default_zeros_file,
    is_program,
    load_program,
    load_settings,
    write_zeros,
)
from tri_glide_kinematics.settings import IK_NODE, file_values

CONFIG = Path(__file__).parents[2] / "config"
SETTINGS = CONFIG / "program_settings.yaml"
SUMMARY = re.compile(r"(\d+) lines, inside the workspace: ([\d.]+) s, ([\d.]+) mm")


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    """Return a function that checks a program with the command; it returns code and output."""

    def run(text, *options, parameters=CONFIG / "tri_glide.yaml"):
        file = tmp_path / "part.gcode"
        file.write_text(text)
        files = ["--settings", str(SETTINGS), "--parameters", str(parameters)]
        monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
        monkeypatch.setattr(sys, "argv", ["drive", str(file), "--check", *files, *options])
        code = main()
        return code, capsys.readouterr()

    return run


@pytest.mark.parametrize("name", ["a.gcode", "a.nc", "a.ngc", "a.tap", "A.GCODE", "a.b.Nc"])
def test_a_program_is_known_by_the_end_of_its_name(name):
    assert is_program(Path("folder.yaml", name))


@pytest.mark.parametrize("name", ["a.yaml", "gcode", "a.gcode.yaml", "nc", "a"])
def test_all_other_files_are_files_of_steps(name):
    assert not is_program(Path("folder.gcode", name))


def test_check_tells_lines_duration_length_and_what_is_not_done(command):
    text = "G21 G90\nG0 X0 Y0 Z50\nG1 X30 F600 E1\nG4 P2000\nX0\nM2\n"
    code, written = command(text)
    assert code == 0, written.err
    lines, duration, length = map(float, SUMMARY.search(written.out).groups())
    assert lines == 6
    # There and back again 30 mm at 10 mm/s, and the dwell.
    assert 8.0 < duration < 8.5
    assert length == pytest.approx(60.0, abs=0.1)
    assert "part.gcode: line 3: E is not done: extrusion" in written.out


def test_the_first_line_tells_the_work_zero_that_holds(command, tmp_path):
    text = "G21 G90\nG0 X0 Y0 Z0\nX10\nM2\n"
    cell = ("--ros-args", "-r", "__ns:=/cell_1")
    _, written = command(text, *cell)
    first = f"drive: {tmp_path}/part.gcode with the settings of {SETTINGS}"
    assert written.out.splitlines()[0] == first
    zeros = default_zeros_file("/cell_1")
    write_zeros(zeros, {"G54": (0.3, 0.0, 0.25)})
    code, written = command(text, *cell)
    assert written.out.splitlines()[0] == (
        f"{first}, but G54 at (300, 0, 250) mm, the work zero of {zeros}"
    )
    # There the program leads out of the workspace; with that of another machine it does not.
    assert code == 1
    assert "outside the workspace" in written.err
    assert command(text)[0] == 0
    assert command(text, "--work-zero", str(zeros))[0] == 1


def test_check_takes_the_machine_of_the_parameters(command, tmp_path):
    text = "G0 Z20\nX50\nM2\n"
    slow = tmp_path / "slow.yaml"
    slow.write_text("/**:\n  ros__parameters:\n    velocity_limits: [0.01, 0.01, 0.01]\n")
    fast_code, fast = command(text)
    slow_code, slowly = command(text, parameters=slow)
    assert fast_code == slow_code == 0
    durations = [float(SUMMARY.search(each.out)[2]) for each in (fast, slowly)]
    assert durations[1] > 5.0 * durations[0]
    slow.write_text("/**:\n  ros__parameters:\n    upper_heights: [0.61, 0.61, 0.61]\n")
    code, written = command(text, parameters=slow)
    assert code == 1
    assert "part.gcode: line " in written.err


LIMITED = """/**:
  ros__parameters:
    velocity_limits: [3.0, 3.0, 3.0]
    acceleration_limits: [60.0, 60.0, 60.0]
    jerk_limits: [5000.0, 5000.0, 5000.0]
    carriage_masses: [1.0, 1.0, 1.0]
    platform_mass: 1.0
"""


def test_check_keeps_platform_speed_and_forces_of_the_parameters(command, tmp_path):
    text = "G0 Z40\nX90\nY90\nX-60 Y-60\nM2\n"
    file = tmp_path / "limited.yaml"

    def told(added):
        file.write_text(LIMITED + added)
        code, written = command(text, parameters=file)
        assert code == 0, written.err
        _, duration, length = map(float, SUMMARY.search(written.out).groups())
        return duration, length, written.out

    free, length, out = told("")
    assert "at most" not in out and "forces" not in out
    slow, _, out = told("    platform_speed_limit: 0.1\n")
    assert "the platform moves at 100 mm/s at most, by platform_speed_limit" in out
    assert 0.001 * length / 0.1 < slow < 1.2 * 0.001 * length / 0.1
    weak, _, out = told("    force_limit_up: [20.0, 20.0, 20.0]\n")
    assert "the forces keep force_limit_up" in out
    assert 1.1 * free < weak < slow
    file.write_text(LIMITED + "    force_limit_up: [1.0, 1.0, 1.0]\n")
    code, written = command(text, parameters=file)
    assert code == 1
    assert "cannot hold the weight" in written.err


def test_the_teach_mode_bounds_a_check_on_a_machine(tmp_path):
    file = tmp_path / "part.gcode"
    file.write_text("G0 Z40\nX90\nY90\nX-60 Y-60\nM2\n")
    program = load_program(file, load_settings(SETTINGS))
    values = file_values(str(CONFIG / "tri_glide.yaml"), "/ik_node", IK_NODE)
    free = check_on_machine(program, values)
    taught = check_on_machine(program, values, is_teaching=True)
    assert taught.length == free.length
    assert free.duration < taught.length / TEACH_SPEED < taught.duration


def test_check_takes_the_shaper_of_the_parameters(command, tmp_path):
    shaped = tmp_path / "shaped.yaml"
    shaped.write_text(
        "/**:\n  ros__parameters:\n    shaper: zv\n    mode_frequencies: [20.0]\n"
        "    mode_dampings: [0.05]\n"
    )
    code, written = command("G0 X20\nY20\nM2\n", parameters=shaped)
    assert code == 0, written.err
    assert "without the time that the shaper takes in bends" in written.out
    # It cuts bends, so one without a tolerance is refused, as by ik_node.
    arc = "G61\nG0 X20\nG3 X-20 I-20 F6000\nM2\n"
    assert command(arc)[0] == 0
    code, written = command(arc, parameters=shaped)
    assert code == 1
    assert "part.gcode: line 3: segment 2 of the path bends" in written.err


def test_check_takes_the_rest_from_a_line(command):
    text = "G0 X0 Z50\nG1 X60 F600\nX0\nM2\n"
    code, written = command(text, "--from", "3")
    assert code == 0, written.err
    assert "4 lines, from line 3 on, inside the workspace: 6." in written.out
    code, written = command(text, "--from", "9")
    assert code == 1
    assert "line 9: nothing is done from here on: line 4 is the last" in written.err
