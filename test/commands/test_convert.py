"""The command convert: what it writes, tells and returns."""

import sys

from firmware_files import SAMPLES

from tri_glide_kinematics.commands import convert, drive
from tri_glide_kinematics.settings import IK_NODE, file_values


def run(*arguments):
    return convert.main([str(each) for each in arguments])


def test_there_and_back_by_files(tmp_path, capsys):
    file = SAMPLES["overridden"].write(tmp_path)
    made = tmp_path / "out" / "duet.yaml"
    assert run(file, "--output", made) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0] == f"parameter file: {made}"
    programs = made.with_name("duet_programs.yaml")
    assert told[1] == f"settings of programs: {programs}"
    assert told[2].endswith(f"drive PROGRAM --check --parameters {made} --settings {programs}")
    assert file_values(str(made), "/ik_node", IK_NODE)["platform_speed_limit"] == 0.3
    assert run(made, "--to", "reprap") == 0
    lines = capsys.readouterr().out
    assert "M666 A0.00 B0.00 X0.121 Y-0.062 Z-0.059\n" in lines
    back = tmp_path / "lines.g"
    assert run(made, "--to", "reprap", "--output", back) == 0
    assert back.read_text() == lines
    assert run(back) == 0
    assert capsys.readouterr().out.splitlines()[-5:] == made.read_text().splitlines()[-5:]


def test_the_written_file_serves_as_parameters_of_a_machine(tmp_path, capsys, monkeypatch):
    made = tmp_path / "kossel.yaml"
    assert run(SAMPLES["kossel"].write(tmp_path), "--output", made) == 0
    program = tmp_path / "square.gcode"
    program.write_text("G21\nG1 X50 Y50 Z20 F3000\nG1 X-50 Y50\nG1 X-50 Y-50 Z100\nM2\n")
    settings = tmp_path / "kossel_programs.yaml"
    assert f"--settings {settings}" in capsys.readouterr().out
    options = ["--check", "--parameters", str(made), "--settings", str(settings)]
    monkeypatch.setattr(sys, "argv", ["drive", str(program), *options])
    assert drive.main() == 0
    assert "inside the workspace" in capsys.readouterr().out


def test_notes_are_told_beside_what_is_printed(tmp_path, capsys):
    assert run(SAMPLES["kossel"].write(tmp_path)) == 0
    told = capsys.readouterr()
    assert told.out.startswith("# Parameters of a machine")
    assert "convert: note: " in told.err
    assert "printer.max_z_velocity" in told.err


def test_where_another_file_is_in_the_way_nothing_is_written(tmp_path, capsys):
    programs = tmp_path / "duet_programs.yaml"
    programs.write_text("of somebody\n")
    assert run(SAMPLES["duet"].write(tmp_path), "--output", tmp_path / "duet.yaml") == 1
    told = capsys.readouterr()
    assert f"convert: error: {programs}: cannot be written: it is there, and its" in told.err
    assert told.out == ""
    assert not (tmp_path / "duet.yaml").exists()


def test_another_file_is_not_overwritten(tmp_path, capsys):
    file = SAMPLES["duet"].write(tmp_path)
    before = file.read_text()
    assert run(file, "--output", file) == 1
    assert "its first line is not" in capsys.readouterr().err
    assert file.read_text() == before
