"""The workspace in a file of measurements: there and back, and what is wrong with others."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from tri_glide_kinematics.calibration.fit import (
    MeasurementFile,
    MeasurementFileError,
    load_measurements,
    save_measurements,
)
from tri_glide_kinematics.workspace import Cylinder, WorkspaceLimits

TRAVEL = ((0.3, 0.31, 0.32), (0.9, 0.8, 0.7), 0.005, 6.0)
KEYS = {
    "lower_heights": [300, 300, 300],
    "upper_heights": [900, 900, 900],
    "reach_margin": 5,
    "max_condition_number": 6,
}
NOMINAL = {"anchors": [[0, 200], [-173.2, -100], [173.2, -100]], "arm_lengths": [400, 400, 400]}


def numbers(limits):
    """Return all numbers of limits with the names of what is there."""
    found = {}
    for name, value in vars(limits).items() if limits else ():
        if name == "cylinder" and value:
            found |= vars(value)
        elif value is not None:
            found[name] = value
    return {
        f"{name} {i}": each for name, some in found.items() for i, each in enumerate(np.ravel(some))
    }


@pytest.mark.parametrize("unit", ["m", "mm"])
@pytest.mark.parametrize(
    "limits",
    [
        WorkspaceLimits(*TRAVEL),
        WorkspaceLimits(*TRAVEL, box_lower=(-0.1, -0.2, 0.0), box_upper=(0.1, 0.2, 0.5)),
        WorkspaceLimits(*TRAVEL, box_upper=(0.1, 0.2, 0.5)),
        WorkspaceLimits(*TRAVEL, cylinder=Cylinder(0.01, 0.02, 0.12, 0.0, 0.5)),
        None,
    ],
)
def test_what_is_written_is_read_as_the_same(tmp_path, unit, limits):
    file = tmp_path / "measurements.yaml"
    save_measurements(file, MeasurementFile(workspace=limits), unit)
    read = load_measurements(file).workspace
    assert numbers(read) == pytest.approx(numbers(limits), rel=1e-11)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"lower_heights": [300, 300]}, "workspace, lower_heights: is .* 3 numbers"),
        ({"upper_heights": [900, 900, 100]}, r"upper_heights\[2\] = 0.1 m must be greater than"),
        ({"reach_margin": None}, "workspace, reach_margin: is missing"),
        ({"cylinder_center": [0, 0]}, "workspace, cylinder_z: is missing"),
        ({"cylinder_radius": 100}, "workspace, cylinder_radius: is not known here"),
        ({"space": "box"}, "workspace, space: is not known here"),
    ],
)
def test_what_has_no_meaning_is_said_with_its_place(tmp_path, change, text):
    file = tmp_path / "measurements.yaml"
    content = {"unit": "mm", "nominal": NOMINAL, "workspace": {**KEYS, **change}}
    file.write_text(yaml.safe_dump(content))
    with pytest.raises(MeasurementFileError, match=text):
        load_measurements(file)
