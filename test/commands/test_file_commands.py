"""The commands draw_motion and judge: what they write, say and return, without ROS."""

import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tri_glide_kinematics.commands import draw_motion, drive, judge
from tri_glide_kinematics.recordings import load_recording

CONFIG = Path(__file__).parents[2] / "config"
MACHINE = ["--parameters", str(CONFIG / "tri_glide.yaml")]
FILES = [*MACHINE, "--settings", str(CONFIG / "program_settings.yaml")]
JOINTS = ("slider_1", "slider_2", "slider_3")
POINTS = "x [mm],y,z\n0,0,250\n20,0,250\n20,20,250\n"


def draw(file, folder, *options):
    return draw_motion.main([str(file), "--output", str(folder), *FILES, *options])


@pytest.fixture
def points(tmp_path, monkeypatch):
    """Return a file whose picture is not looked at."""
    monkeypatch.setattr(draw_motion, "save_figure", lambda *_: None)
    file = tmp_path / "points.csv"
    file.write_text(POINTS)
    return file


def test_a_file_is_drawn_and_its_setpoints_are_judged(tmp_path, capsys):
    table, recording = tmp_path / "out" / "a.csv", tmp_path / "b" / "a.mcap"
    options = ("--csv", str(table), "--mcap", str(recording))
    assert draw(CONFIG / "drive_example.yaml", tmp_path / "out", *options) == 0
    with Image.open(tmp_path / "out" / "drive_example_motion.png") as picture:
        assert picture.size == (1430, 880)
    for file in (table, recording):
        assert judge.main([str(file), *MACHINE]) == 0
    assert capsys.readouterr().out.count("all limits are kept") == 2


def test_the_next_line_that_is_printed_proves_the_file(points, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["tri-glide draw_motion"])
    assert draw(points, tmp_path / "out") == 0
    last = capsys.readouterr().out.splitlines()[-1]
    words = shlex.split(last)
    assert words[:3] == ["next:", "tri-glide", "drive"]
    assert words[4:6] == ["--check", "--parameters"]
    monkeypatch.setattr(sys, "argv", words[2:])
    assert drive.main() == 0


def test_setpoints_have_the_rate_that_is_wanted(points, tmp_path, capsys):
    table = tmp_path / "a.csv"
    assert draw(points, tmp_path, "--csv", str(table), "--rate", "1000") == 0
    assert np.median(np.diff(load_recording(table, JOINTS).stamps)) == pytest.approx(1e-3)
    assert judge.main([str(table), *MACHINE]) == 2
    assert "the rate is 500 Hz: name the right one" in capsys.readouterr().err
    assert judge.main([str(table), *MACHINE, "--rate", "1000"]) == 0


def test_setpoints_in_files_are_those_that_the_drives_are_told(points, tmp_path):
    parameters = tmp_path / "shifted.yaml"
    parameters.write_text(
        "/cell/ik_node:\n  ros__parameters:\n    height_offsets: [0.1, 0.0, -0.1]\n"
        "    joint_names: [a, b, c]\n"
    )
    own = ["--parameters", str(parameters), "--node", "/cell/ik_node"]
    tables = [tmp_path / f"{name}.csv" for name in "ab"]
    recording = tmp_path / "b.mcap"
    assert draw(points, tmp_path, "--csv", str(tables[0])) == 0
    options = (*own, "--csv", str(tables[1]), "--mcap", str(recording))
    assert draw(points, tmp_path, *options) == 0
    plain, shifted = (load_recording(table, JOINTS).heights for table in tables)
    np.testing.assert_allclose(plain - shifted, np.tile((0.1, 0.0, -0.1), (len(plain), 1)))
    told = load_recording(recording, "abc")
    np.testing.assert_array_equal(told.heights, shifted)
    assert judge.main([str(recording), *own]) == 0


def test_a_recording_that_ends_in_motion_is_told_and_no_violation(points, tmp_path, capsys):
    table = tmp_path / "a.csv"
    assert draw(points, tmp_path, "--csv", str(table)) == 0
    rows = [line.split(",") for line in table.read_text().splitlines()[:60]]
    table.write_text("".join(f"{','.join(row[:4])}\n" for row in rows))
    capsys.readouterr()
    assert judge.main([str(table), *MACHINE]) == 0
    told = capsys.readouterr().out
    heights = load_recording(table, JOINTS).heights
    speed = np.abs(heights[-1] - heights[-2]).max() / 2e-3
    assert speed > 0.01
    assert f"it ends in motion: a slider moves at {speed:.6g} m/s there" in told
    assert "it has no velocities" in told
    assert "all limits are kept" in told
    table.write_text(table.read_text()[:-5])
    assert judge.main([str(table), *MACHINE]) == 2
    assert "line 60: this last line has no end" in capsys.readouterr().err


def test_a_platform_that_is_faster_than_its_limit_is_told(points, tmp_path, capsys):
    table, slow = tmp_path / "a.csv", tmp_path / "slow.yaml"
    assert draw(points, tmp_path, "--csv", str(table)) == 0
    slow.write_text("/ik_node:\n  ros__parameters:\n    platform_speed_limit: 0.05\n")
    capsys.readouterr()
    assert judge.main([str(table), "--parameters", str(slow)]) == 1
    told = capsys.readouterr().out
    assert "  largest platform speed " in told
    assert "platform speed: at 0." in told
    assert "of its limit, 0.05 m/s" in told
    # Motion that is planned with it keeps it.
    options = ("--parameters", str(slow), "--csv", str(table))
    assert draw(points, tmp_path, *options) == 0
    assert judge.main([str(table), "--parameters", str(slow)]) == 0


def test_a_violation_is_told_with_time_number_and_bound(points, tmp_path, capsys):
    table = tmp_path / "a.csv"
    assert draw(points, tmp_path, "--csv", str(table)) == 0
    lines = table.read_text().splitlines()
    cells = lines[60].split(",")
    cells[2] = repr(float(cells[2]) + 1e-4)
    lines[60] = ",".join(cells)
    del lines[80:90]
    table.write_text("\n".join([*lines, ""]))
    capsys.readouterr()
    assert judge.main([str(table), *MACHINE]) == 1
    told = capsys.readouterr().out
    assert "some limits are not kept" in told
    assert "gap: at 0.178000 s: " in told
    assert "jerk: at 0.1" in told
    assert "of its limit, 200 m/s^3 (" in told
    assert "velocity: " in told


def test_both_run_where_there_is_no_ros(tmp_path):
    """Importing a package of ROS is an error there; the file is a program."""
    script = (
        "import sys\n"
        "for name in ('rclpy', 'sensor_msgs', 'tri_glide_interfaces', 'geometry_msgs'):\n"
        "    sys.modules[name] = None\n"
        "from tri_glide_kinematics.commands import draw_motion, judge\n"
        "file, folder, *machine = sys.argv[1:]\n"
        "recording = folder + '/a.mcap'\n"
        "files = ['--output', folder, '--mcap', recording]\n"
        "sys.exit(draw_motion.main([file, *files, *machine]) or judge.main([recording, *machine]))"
    )
    file = tmp_path / "a.gcode"
    file.write_text("G1 X10 F6000\nX20\nM2\n")
    command = [sys.executable, "-c", script, str(file), str(tmp_path), *MACHINE]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, cwd=CONFIG
    )
    assert done.returncode == 0, done.stderr
    assert "all limits are kept" in done.stdout
    with Image.open(tmp_path / "a_motion.png") as picture:
        assert picture.size == (1430, 880)
