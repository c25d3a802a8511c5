"""A ring-down in words, and as a parameter file."""

from pathlib import Path

import pytest
import yaml

from tri_glide_kinematics.calibration.ringdown import (
    ModeFileError,
    NoModeError,
    NotKnown,
    find_modes,
    load_recording,
    mode_text,
    ringdown_report,
    save_modes,
)
from tri_glide_kinematics.motion.shaping import ShaperKind

EXAMPLE = load_recording(Path(__file__).parents[3] / "config" / "ringdown_example.csv")


@pytest.fixture(scope="module")
def found():
    return find_modes(EXAMPLE)


@pytest.fixture(scope="module")
def nothing():
    return find_modes(EXAMPLE.between(12.4, 12.5))


def test_the_file_has_the_parameters_of_ik_node(found):
    text = mode_text(found, ShaperKind.TWO_HUMP_EI, "modes.yaml")
    parameters = yaml.safe_load(text)["ik_node"]["ros__parameters"]
    assert parameters["shaper"] == "two_hump_ei"
    assert parameters["mode_frequencies"] == pytest.approx([14.7, 23.9], abs=0.02)
    assert parameters["mode_dampings"] == pytest.approx([0.032, 0.05], abs=1e-3)
    # A file that is cut off is none.
    with pytest.raises(yaml.YAMLError):
        yaml.safe_load(text[: len(text) // 2 + 20])


def test_an_older_file_is_kept_and_no_other_one_is_overwritten(found, tmp_path):
    file = tmp_path / "modes.yaml"
    save_modes(file, found)
    save_modes(file, found, ShaperKind.ZV)
    assert "shaper: ei" in (tmp_path / "modes.yaml.bak").read_text()
    other = tmp_path / "other.yaml"
    other.write_text("mine: 1\n")
    with pytest.raises(ModeFileError, match="its first line is not"):
        save_modes(other, found)
    assert other.read_text() == "mine: 1\n"


def test_without_a_mode_there_is_no_file(nothing, tmp_path):
    with pytest.raises(NoModeError) as caught:
        save_modes(tmp_path / "modes.yaml", nothing)
    assert caught.value.reason is NotKnown.TOO_SHORT
    assert not list(tmp_path.iterdir())
    assert f"NOT KNOWN: {NotKnown.TOO_SHORT.value}" in ringdown_report(nothing)


def test_the_report_has_all_numbers_with_their_deviations(found):
    said = ringdown_report(found)
    assert "594 samples in 1.198 s, of x, y, z [m/s2]" in said
    first, second = found.modes
    assert f"frequency {first.frequency:.4f} ± {first.frequency_deviation:.4f} Hz" in said
    assert f"damping {second.damping:.5f} ± {second.damping_deviation:.5f}" in said
    assert "it looks like noise" in said
