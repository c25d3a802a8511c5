"""The commands size, draw_machine and describe_machine: what they write, say and return."""

from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from tri_glide_kinematics import sizing
from tri_glide_kinematics.commands import describe_machine, draw_machine, size
from tri_glide_kinematics.figures import machine
from tri_glide_kinematics.settings import SIMULATOR_NODE, file_values
from tri_glide_kinematics.sizing import search

CONFIG = Path(__file__).parents[2] / "config"
WISH = ["--cylinder", "0.1", "0.12", "--speed", "1", "--acceleration", "10", "--payload", "0.2"]


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(machine, "PLACES", 21)
    monkeypatch.setattr(search, "ROUNDS", 6)
    monkeypatch.setattr(search, "STARTS", 1)
    monkeypatch.setattr(search, "FIRST_GRID", 21)


@pytest.fixture
def drawn(monkeypatch):
    """Return the figures that are drawn, instead of their files."""
    figures = []
    monkeypatch.setattr(draw_machine, "save_figure", lambda figure, *_: figures.append(figure))
    return figures


def test_a_wish_leads_to_a_parameter_file_that_is_drawn(tmp_path, capsys, drawn):
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
    assert len(drawn) == 1


def test_an_impossible_wish_is_answered_with_the_nearest_possible_one(
    tmp_path, capsys, monkeypatch
):
    # Each machine is looked for once, and none that is far larger or smaller than the volume.
    monkeypatch.setattr(sizing, "size", cache(sizing.size))
    monkeypatch.setattr(search, "DIFFERENCES", search.DIFFERENCES[:1])
    file = tmp_path / "machine.yaml"
    impossible = [*WISH, "--largest-force", "9", "--write", str(file)]
    assert size.main(impossible) == 1
    captured = capsys.readouterr()
    assert "it is too much for largest_force = 9 N (" in captured.err
    assert "the nearest possible wish" in captured.out
    assert not file.exists()
    assert size.main([*impossible, "--nearest"]) == 1
    assert file.exists()


def test_a_drive_file_is_a_duty_cycle(tmp_path, capsys):
    file = tmp_path / "a.nc"
    file.write_text("G1 X10 F6000\nX-10 Y10\nM2\n")
    wish = ["--box", "0.12", "0.12", "0.2", "--bottom", "0.15", "--speed", "1", "--acceleration"]
    drive = ["--drive", str(file)]
    settings = ["--settings", str(CONFIG / "program_settings.yaml")]
    assert size.main([*wish, "10", *drive, *settings]) == 0
    assert "largest power [W]" in capsys.readouterr().out


def test_what_a_calibration_leaves_is_drawn(tmp_path):
    file, measurements = tmp_path / "a.yaml", CONFIG / "measurements_example.yaml"
    # How wide a disc is inside is soon known there.
    file.write_text("/**:\n  ros__parameters:\n    space: cylinder\n    cylinder_radius: 0.1\n")
    options = ["--output", str(tmp_path), "--measurements", str(measurements)]
    assert draw_machine.main([str(file), *options]) == 0
    assert (tmp_path / "a_machine.png").stat().st_size > 50_000


def slider_of(urdf: str) -> ElementTree.Element:
    """The joint of the first slider."""
    joints = ElementTree.fromstring(urdf).findall("joint")
    return next(joint for joint in joints if joint.attrib["name"] == "slider_1")


def test_the_urdf_of_two_files_is_that_of_the_later_one(tmp_path, capsys):
    """As the launch file asks for it."""
    calibrated = tmp_path / "a calibrated one.yaml"
    anchors = [0.0, 0.21, -0.17, -0.1, 0.19, -0.09]
    calibrated.write_text(
        "/**:\n  ros__parameters:\n    geometry: calibrated\n"
        f"    anchors: {anchors}\n    height_offsets: [0.01, 0.0, -0.01]\n"
    )
    for node in ("//ik_node", "/cell_1/ik_node"):
        files = [str(CONFIG / "tri_glide.yaml"), str(calibrated)]
        assert describe_machine.main([*files, "--node", node]) == 0
        told = capsys.readouterr()
        assert told.err == ""
        origin = slider_of(told.out).find("origin").attrib["xyz"].split()
        # The platform radius is that of the first file.
        assert list(map(float, origin)) == pytest.approx((0.0, 0.26, 0.01))


def test_urdf_and_mjcf_are_written_to_files(tmp_path, capsys):
    urdf, mjcf = tmp_path / "new" / "a.urdf", tmp_path / "other" / "a.xml"
    options = ["--urdf", str(urdf), "--mjcf", str(mjcf), "--rod-distance", "0.04"]
    assert describe_machine.main([str(CONFIG / "tri_glide.yaml"), *options]) == 0
    told = capsys.readouterr().out
    assert f"URDF: {urdf}" in told
    assert "assumed" in told
    assert slider_of(urdf.read_text()).find("limit").attrib["upper"] == "0.9"
    bodies = {each.attrib.get("name"): each for each in ElementTree.parse(mjcf).iter("body")}
    assert bodies["rod_1_right"].attrib["pos"] == "0.02 0 0"
    heavy = tmp_path / "heavy.yaml"
    heavy.write_text(
        "/**:\n  ros__parameters:\n    carriage_masses: [2.0, 2.0, 2.0]\n    platform_mass: 0.7\n"
    )
    assert describe_machine.main([str(heavy), "--mjcf", str(mjcf)]) == 0
    assert "assumed" not in capsys.readouterr().out
    platform = next(
        each for each in ElementTree.parse(mjcf).iter("body") if each.find("freejoint") is not None
    )
    assert platform.find("inertial").attrib["mass"] == "0.7"
