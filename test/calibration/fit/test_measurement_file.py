"""Files of measurements: there and back, and what is wrong with others."""

import math

import numpy as np
import pytest
import yaml
from soak import some

from testing.wrong_machines import NOMINAL, WRONG_BY, drawn
from tri_glide_kinematics.calibration import (
    MachineParameters,
    MeasurementFile,
    MeasurementFileError,
    Plate,
    Priors,
    Touch,
    load_measurements,
    save_measurements,
)
from tri_glide_kinematics.calibration.fit import FIRST_LINE
from tri_glide_kinematics.workspace import Cylinder, WorkspaceLimits

HEIGHTS = [346.4, 346.4, 346.4]
NOMINAL_KEYS = {
    "anchors": [[0, 200], [-173.2, -100], [173.2, -100]],
    "arm_lengths": [400, 400, 400],
}
TOUCH = {"heights": HEIGHTS, "standard_deviation": 0.01}
TRAVEL = ((0.3, 0.31, 0.32), (0.9, 0.8, 0.7), 0.005, 6.0)
SPACE = {
    "lower_heights": [300, 300, 300],
    "upper_heights": [900, 900, 900],
    "reach_margin": 5,
    "max_condition_number": 6,
}


@pytest.mark.slow
def test_a_file_that_is_cut_off_is_refused(tmp_path):
    file = tmp_path / "measurements.yaml"
    machine, rng = drawn(1)
    touches = tuple(machine.touches(rng))[:1]
    content = MeasurementFile(NOMINAL, WRONG_BY, touches, (), tuple(machine.one_distance(rng)))
    save_measurements(file, content)
    whole = file.read_bytes().rstrip()
    lengths = range(len(FIRST_LINE) + 1, len(whole))
    for length in some([*lengths[::11], *lengths], len(lengths[::11])):
        file.write_bytes(whole[:length])
        with pytest.raises(MeasurementFileError, match=r"is not YAML|must be keys with values"):
            load_measurements(file)


@pytest.fixture
def load(tmp_path):
    """Return a function that writes a file of these keys and reads it."""

    def loaded(**keys):
        file = tmp_path / "measurements.yaml"
        file.write_text(yaml.safe_dump({"unit": "mm", "nominal": NOMINAL_KEYS, **keys}))
        return load_measurements(file)

    return loaded


def numbers(content):
    """Return all numbers of a content, in their order."""
    found = [*content.nominal.vector]
    for touch in content.touches:
        found += [*touch.heights, touch.standard_deviation]
    for one in content.positions:
        found += [*one.heights, *one.position, one.standard_deviation]
    for one in content.distances:
        found += [*one.heights_from, *one.heights_to, one.distance, one.standard_deviation]
    for value in vars(content.workspace).values() if content.workspace else ():
        some = [*vars(value).values()] if isinstance(value, Cylinder) else value
        found += [math.inf] if some is None else np.ravel(some).tolist()
    return np.array(found)


@pytest.mark.parametrize("unit", ["m", "mm"])
@pytest.mark.parametrize(
    ("priors", "limits"),
    [
        (WRONG_BY, None),
        (Priors(common_radius=0.0, common_arm_length=3e-3), None),
        (None, WorkspaceLimits(*TRAVEL)),
        (None, WorkspaceLimits(*TRAVEL, (-0.1, -0.2, 0.0), (0.1, 0.2, 0.5))),
        (None, WorkspaceLimits(*TRAVEL, box_upper=(0.1, 0.2, 0.5))),
        (WRONG_BY, WorkspaceLimits(*TRAVEL, cylinder=Cylinder(0.01, 0.02, 0.12, 0.0, 0.5))),
    ],
)
def test_what_is_written_is_read_as_the_same(tmp_path, unit, priors, limits):
    machine, rng = drawn(1)
    plate = Plate("table", None, (0.001, 0.002))
    touches = (*machine.touches(rng)[:3], machine.touch(0.0, 0.05, rng, plate))
    content = MeasurementFile(
        MachineParameters(NOMINAL.geometry, (0.001, 0.002, 0.003)),
        priors,
        touches,
        (machine.position((0.0, 0.0, 0.1), rng, "camera"),),
        tuple(machine.one_distance(rng)),
        limits,
    )
    file = tmp_path / "measurements.yaml"
    save_measurements(file, content, unit)
    again = load_measurements(file)
    np.testing.assert_allclose(numbers(again), numbers(content), rtol=1e-11, atol=1e-14)
    assert [one.plate for one in again.touches] == [one.plate for one in content.touches]
    assert again.positions[0].frame == "camera"
    assert (again.priors is None) == (priors is None)
    if priors is not None:
        expected = priors.covariance(NOMINAL.vector)
        np.testing.assert_allclose(again.priors.covariance(NOMINAL.vector), expected)


def test_what_a_file_leaves_out_has_a_default(load):
    content = load(touches=[TOUCH])
    assert content.nominal.height_offsets == (0.0, 0.0, 0.0)
    assert content.priors == Priors()
    assert content.touches == (Touch((0.3464,) * 3, Plate(), 1e-5),)
    assert (content.positions, content.distances) == ((), ())


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"unit": "inch"}, "unit: is 'inch', must be one of m, mm"),
        ({"touches": [{**TOUCH, "heights": [1, math.nan, 2]}]}, r"touch 1, heights\[1\]: is nan"),
        ({"touches": [TOUCH, {**TOUCH, "heights": [1, 2]}]}, "touch 2, heights: is .* 3 numbers"),
        ({"touches": [{"heights": HEIGHTS}]}, "touch 1, standard_deviation: is missing"),
        ({"touches": [{**TOUCH, "standard_deviation": 0}]}, "touch 1: standard_deviation = 0 m"),
        ({"touches": [{**TOUCH, "plate": "table"}]}, "touch 1, plate: is 'table', which .*none"),
        ({"touches": [{**TOUCH, "when": 3}]}, "touch 1, when: is not known here"),
        ({"touches": TOUCH}, "touches: is .*, must be a list"),
        ({"distances": [{"from": HEIGHTS, "to": HEIGHTS}]}, "distance 1, distance: is missing"),
        ({"positions": [{"heights": HEIGHTS}]}, "position 1, position: is missing"),
        ({"plates": {"bed": {"height": "high"}}}, "plate 'bed', height: is 'high'"),
        ({"plates": {"bed": {"tilt": 3}}}, "plate 'bed', tilt: is 3, .* 2 numbers, x and y"),
        ({"plates": 3}, "plates: is 3, must be keys with values"),
        ({"priors": {"anchors": -1}}, "priors: standard deviation of anchors = -0.001 m"),
        ({"priors": {"arms": 1}}, "priors, arms: is not known here"),
        ({"nominal": {**NOMINAL_KEYS, "arm_lengths": [1, 1, 1]}}, "nominal: arms of .* never meet"),
        ({"nominal": {"arm_lengths": [1, 1, 1]}}, "nominal, anchors: is missing"),
        ({"measurements": []}, "measurements: is not known here"),
        ({"workspace": SPACE | {"lower_heights": [300, 300]}}, "workspace, lower_heights: .* 3 "),
        (
            {"workspace": SPACE | {"upper_heights": [900, 900, 100]}},
            r"upper_heights\[2\] = 0.1 m must be greater than",
        ),
        ({"workspace": SPACE | {"reach_margin": None}}, "workspace, reach_margin: is missing"),
        ({"workspace": SPACE | {"cylinder_center": [0, 0]}}, "workspace, cylinder_z: is missing"),
        ({"workspace": SPACE | {"cylinder_radius": 9}}, "workspace, cylinder_radius: is not known"),
        ({"workspace": SPACE | {"space": "box"}}, "workspace, space: is not known here"),
    ],
)
def test_what_has_no_meaning_is_said_with_its_place(load, keys, text):
    with pytest.raises(MeasurementFileError, match=text):
        load(**keys)


def test_files_that_cannot_be_read_or_written_are_said(tmp_path):
    with pytest.raises(MeasurementFileError, match="cannot be read"):
        load_measurements(tmp_path / "none.yaml")
    file = tmp_path / "odd.yaml"
    file.write_text("touches: [")
    with pytest.raises(MeasurementFileError, match="is not YAML"):
        load_measurements(file)
    with pytest.raises(MeasurementFileError, match="cannot be written"):
        save_measurements(tmp_path / "no" / "folder.yaml", MeasurementFile())
