"""The commands size and draw_machine: what they write, say and return, without ROS."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from PIL import Image

from tri_glide_kinematics.nodes import draw_machine, size
from tri_glide_kinematics.ros.parameters import SIMULATOR_NODE, file_values

CONFIG = Path(__file__).parents[2] / "config"
WISH = ["--cylinder", "0.1", "0.12", "--speed", "1", "--acceleration", "10", "--payload", "0.2"]


def test_a_wish_leads_to_a_parameter_file_that_is_drawn(tmp_path, capsys):
    file = tmp_path / "new" / "machine.yaml"
    assert size.main([*WISH, "--least-arm-angle", "25", "--write", str(file)]) == 0
    told = capsys.readouterr().out
    assert "least size   least power" in told
    assert "least size: used up to a hundredth: clearance, least_arm_angle" in told
    (content,) = yaml.safe_load(file.read_text()).values()
    radius = content["ros__parameters"]["base_radius"]
    (line,) = (line for line in told.splitlines() if line.startswith("base radius [mm]"))
    assert float(line.split()[3]) == pytest.approx(1000.0 * radius)
    assert file_values(str(file), "/simulator_node", SIMULATOR_NODE)["base_radius"] == radius
    surfaces = [tmp_path / "surfaces" / f"a.{ending}" for ending in ("stl", "glb")]
    options = ["--output", str(tmp_path), "--stl", str(surfaces[0]), "--glb", str(surfaces[1])]
    assert draw_machine.main([str(file), *options]) == 0
    told = capsys.readouterr().out
    # The volume that was wished for, and no more.
    assert "the platform may be in 3.7" in told
    assert "radius 100.000 mm" in told
    assert surfaces[1].read_bytes()[:4] == b"glTF"
    assert surfaces[0].stat().st_size > 84
    with Image.open(tmp_path / "machine_machine.png") as picture:
        assert picture.size == (1700, 850)


def test_an_impossible_wish_is_answered_with_the_nearest_possible_one(tmp_path, capsys):
    file = tmp_path / "machine.yaml"
    impossible = [*WISH, "--largest-force", "9", "--write", str(file)]
    assert size.main(impossible) == 1
    captured = capsys.readouterr()
    assert "it is too much for largest_force = 9 N (" in captured.err
    assert "the nearest possible wish" in captured.out
    assert not file.exists()
    assert size.main([*impossible, "--nearest"]) == 1
    assert file.exists()


def test_a_drive_file_is_a_duty_cycle(capsys):
    wish = ["--box", "0.12", "0.12", "0.2", "--bottom", "0.15", "--speed", "1", "--acceleration"]
    drive = ["--drive", str(CONFIG / "program_example.gcode")]
    settings = ["--settings", str(CONFIG / "program_settings.yaml")]
    assert size.main([*wish, "10", *drive, *settings]) == 0
    assert "largest power [W]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--cylinder", "0.1", "-0.1", "--speed", "1", "--acceleration", "9"], "cylinder z_max"),
        (["--box", "0.1", "0.1", "0.1", "--speed", "0", "--acceleration", "9"], "speed = 0"),
        ([*WISH, "--drive", "/nowhere.yaml"], "nowhere.yaml"),
    ],
)
def test_mistakes_in_a_wish_are_told(arguments, reason, capsys):
    assert size.main(arguments) == 1
    assert reason in capsys.readouterr().err


def test_mistakes_in_a_drawing_are_told(tmp_path, capsys):
    assert draw_machine.main([str(tmp_path / "none.yaml"), "--output", str(tmp_path)]) == 1
    assert "none.yaml" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        draw_machine.main(["tri_glide.yaml", "--resolution", "0"])
    nowhere = tmp_path / "nowhere.yaml"
    nowhere.write_text("/**:\n  ros__parameters:\n    max_condition_number: 1.5\n")
    assert draw_machine.main([str(nowhere), "--output", str(tmp_path)]) == 1
    assert "the platform may be nowhere" in capsys.readouterr().err


def test_what_a_calibration_leaves_is_drawn(tmp_path):
    file, measurements = CONFIG / "tri_glide.yaml", CONFIG / "measurements_example.yaml"
    options = ["--output", str(tmp_path), "--measurements", str(measurements)]
    assert draw_machine.main([str(file), *options]) == 0
    assert (tmp_path / "tri_glide_machine.png").stat().st_size > 50_000
