"""The command ringdown, and its picture."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from tri_glide_kinematics.calibration.ringdown import (
    Recording,
    find_modes,
    load_recording,
    save_recording,
)
from tri_glide_kinematics.commands.ringdown import SHAPERS, main
from tri_glide_kinematics.figures import ringdown_figure
from tri_glide_kinematics.motion.shaping import ShaperKind

EXAMPLE = str(Path(__file__).parents[2] / "config" / "ringdown_example.csv")


@pytest.fixture
def quick_pictures(monkeypatch):
    """Let pictures be empty files."""
    name = "tri_glide_kinematics.picture_commands.save_figure"
    monkeypatch.setattr(name, lambda figure, file, _: file.touch())


def test_a_file_becomes_numbers_a_picture_and_parameters(tmp_path, capsys):
    picture, modes = tmp_path / "new" / "swing.png", tmp_path / "modes.yaml"
    arguments = [EXAMPLE, "--picture", str(picture), "--write", str(modes), "--shaper", "zvd"]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert said.startswith("Measured: "), "a single swing needs no title"
    assert "Mode 2: frequency 23.9" in said
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert yaml.safe_load(modes.read_text())["ik_node"]["ros__parameters"]["shaper"] == "zvd"


@pytest.mark.usefixtures("quick_pictures")
def test_one_option_asks_for_all_that_is_written(tmp_path, capsys):
    output = tmp_path / "new folder"
    assert main([EXAMPLE, "--output", str(output)]) == 0
    assert {each.name for each in output.iterdir()} == {"ringdown.png", "modes.yaml"}
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("next: ros2 run tri_glide_kinematics ik_node --ros-args")
    assert last.endswith(f"--params-file '{output}/modes.yaml'")
    # The older names say where else.
    modes = tmp_path / "new" / "swing.yaml"
    assert main([EXAMPLE, "--output", str(output / "2"), "--write", str(modes)]) == 0
    assert [each.name for each in (output / "2").iterdir()] == ["ringdown.png"]
    assert modes.exists()


def test_where_nothing_was_written_the_next_line_would(tmp_path, capsys):
    assert main([EXAMPLE]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"next: ros2 run tri_glide_kinematics ringdown {EXAMPLE} --output out"


@pytest.mark.usefixtures("quick_pictures")
def test_several_swings_are_combined(tmp_path, capsys):
    recording = load_recording(EXAMPLE)
    files = [tmp_path / f"swing_{number}.csv" for number in (1, 2)]
    for number, file in enumerate(files):
        save_recording(file, recording.between(12.4 + 0.1 * number, 14.0), "of an example")
    picture, modes = tmp_path / "swing.png", tmp_path / "modes.yaml"
    arguments = [*map(str, files), "--picture", str(picture), "--write", str(modes)]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert f"{files[0]}\nMeasured: " in said
    assert "All swings together\nMode 1: " in said
    assert "seen in 2 of 2 swings" in said
    assert sorted(tmp_path.glob("*.png")) == [tmp_path / f"swing_{place}.png" for place in (1, 2)]
    values = yaml.safe_load(modes.read_text())["ik_node"]["ros__parameters"]
    assert len(values["mode_frequencies"]) == 2


@pytest.mark.usefixtures("quick_pictures")
def test_where_nothing_is_known_there_is_a_picture_and_no_parameter_file(tmp_path, capsys):
    picture, modes = tmp_path / "swing.png", tmp_path / "modes.yaml"
    arguments = [EXAMPLE, "--to", "12.5", "--picture", str(picture), "--write", str(modes)]
    assert main(arguments) == 1
    said = capsys.readouterr()
    assert "NOT KNOWN" in said.out
    assert said.err.startswith(
        "ringdown: error: the modes are not known: the recording is too short"
    )
    assert picture.exists()
    assert not modes.exists()
    assert main(arguments[:3]) == 1
    assert capsys.readouterr().err == said.err


def test_the_command_knows_all_kinds_of_shapers():
    assert tuple(kind.value for kind in ShaperKind) == SHAPERS


def test_the_picture_shows_each_axis_the_residuals_and_the_modes():
    times = np.arange(500) / 500.0
    values = np.exp(-5.0 * times) * np.cos(100.0 * times)
    noise = 1e-3 * np.random.default_rng(1).standard_normal((500, 2))
    figure = ringdown_figure(find_modes(Recording(times, values[:, None] + noise)))
    *axes, residuals, spectra = figure.axes
    assert [each.get_ylabel() for each in axes] == [f"{name} without drift [mm]" for name in "xy"]
    measured, fitted = axes[0].get_lines()[:2]
    assert fitted.get_ydata() == pytest.approx(measured.get_ydata(), abs=5.0)
    assert len(residuals.get_lines()) == 3
    assert "15.9" in spectra.texts[0].get_text()
