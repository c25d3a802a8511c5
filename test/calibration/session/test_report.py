"""What a calibration says in words, and the parameter file that it writes."""

import math
from dataclasses import replace

import numpy as np
import pytest
import yaml
from calibration_samples import calibration, measured

from tri_glide_kinematics.calibration.fit import PARAMETER_NAMES, MachineParameters, Plate
from tri_glide_kinematics.calibration.session import (
    SavingError,
    UncertaintyMap,
    contradiction,
    length_text,
    parameter_text,
    report,
    save_parameters,
    solved,
)
from tri_glide_kinematics.settings import IK_NODE, ParameterError, machine_of, sections_of
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY


@pytest.fixture(scope="module")
def text():
    whole = calibration()
    return report(whole, whole.next_points(2))


def test_all_is_told(text):
    assert text.startswith("Measured: 13 touches, 1 distance\n")
    assert "Assumed before: anchors within 0.5 mm" in text
    for name in (*PARAMETER_NAMES, "touch 13", "distance 1", "turning about z"):
        assert name in text
    assert text.count("the uncertain volume shrinks to") == 2
    assert not [number for number in text.split() if number in ("nan", "inf", "-0.0000")]


def test_numbers_are_those_of_the_calibration(text):
    result = calibration()
    rows = {line[:18].strip(): line[18:].split() for line in text.splitlines()}
    for name, value, deviation in zip(
        PARAMETER_NAMES, result.machine.vector, result.standard_deviations
    ):
        assert float(rows[name][1]) == pytest.approx(1e3 * value, abs=1e-4)
        assert float(rows[name][3]) == pytest.approx(1e3 * deviation, abs=1e-4)


def test_without_priors_what_is_not_known_is_named():
    text = report(calibration(has_priors=False))
    assert "Assumed before: nothing" in text
    assert "left as it was assumed to be:" in text
    assert "not known" in next(line for line in text.splitlines() if line.startswith("anchor 1 x"))
    assert "not known" in next(line for line in text.splitlines() if line.startswith("x  "))


def test_an_outlier_is_named():
    text = report(calibration(outlier=0.002))
    assert "left out: contradicts the others" in text
    assert "touch 3" in text[text.index("Warnings:") :]


def test_what_is_far_from_the_priors_is_named_above_all_numbers():
    content = measured()
    plate = Plate("bed", 5e-3)
    touches = tuple(replace(one, plate=plate) for one in content.touches)
    result = solved(replace(content, touches=touches))
    reason = contradiction(result)
    assert reason.startswith("measurements and assumptions contradict each other: shifting along z")
    assert reason.endswith("standard deviations from what was assumed")
    assert "chi-squared" not in reason
    text = report(result)
    assert f"NOT VALID: {reason}" in text[: text.index("parameter [mm]")]
    assert "- shifting along z (all height offsets together) is" in text
    assert contradiction(calibration()) == ""


@pytest.mark.parametrize(
    ("length", "text"),
    [(1.23e-5, "12.3 µm"), (-4e-3, "-4 mm"), (math.inf, "not known"), (math.nan, "not known")],
)
def test_lengths_have_the_unit_that_suits_them(length, text):
    assert length_text(length) == text


def test_the_map_is_that_of_the_calibration():
    result = calibration()
    found = UncertaintyMap.of(result)
    index = 5
    place = found.region.places[index]
    assert found.after[index] == pytest.approx(result.position_uncertainty(place))
    assert found.aligned[index] == pytest.approx(result.position_uncertainty(place, aligned=True))
    assert (found.aligned <= found.before).all()


def test_nodes_read_what_is_written(tmp_path):
    machine = calibration().machine
    file = tmp_path / "calibrated.yaml"
    save_parameters(file, machine)
    written = yaml.safe_load(file.read_text(encoding="utf-8"))["/**"]["ros__parameters"]
    table = {entry.name: entry for entry in IK_NODE}
    values = {entry.name: entry.default for entry in IK_NODE}
    values |= {name: table[name].checked(value) for name, value in written.items()}
    read = MachineParameters(machine_of(values).geometry, values["height_offsets"])
    assert np.abs(read.vector - machine.vector).max() < 1e-9


def test_a_parameter_file_that_is_cut_off_is_refused(tmp_path):
    file = tmp_path / "calibrated.yaml"
    save_parameters(file, calibration().machine)
    assert sections_of(str(file)) == ("/**",)
    whole = file.read_bytes().rstrip()
    for length in range(len(whole)):
        file.write_bytes(whole[:length])
        sections_of.cache_clear()
        with pytest.raises(ParameterError):
            sections_of(str(file))


def test_a_zero_has_no_sign_and_a_folder_that_is_not_there_is_told(tmp_path):
    assert "-0.000000000" not in parameter_text(MachineParameters(DEFAULT_GEOMETRY), "file")
    with pytest.raises(SavingError, match="cannot be written"):
        save_parameters(tmp_path / "nowhere" / "file.yaml", MachineParameters(DEFAULT_GEOMETRY))
