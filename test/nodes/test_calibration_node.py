"""Numbers of requests have the bounds of the parameters that they take the place of."""

from __future__ import annotations

import math

import pytest

from tri_glide_interfaces.srv import ProbePlate
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.nodes.calibration_node import probe_settings_of
from tri_glide_kinematics.ros.parameters import CALIBRATION_NODE

VALUES = {entry.name: entry.default for entry in CALIBRATION_NODE}


def test_zero_stands_for_the_parameter():
    settings = probe_settings_of(VALUES, ProbePlate.Request())
    assert (settings.speed, settings.depth) == (0.002, 0.01)
    settings = probe_settings_of(VALUES, ProbePlate.Request(depth=1.0, speed=0.1))
    assert (settings.speed, settings.depth) == (0.1, 1.0)


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ({"speed": 2.0}, "speed = 2 m/s must be at most 0.1"),
        ({"speed": -1.0}, "speed = -1 m/s must be at least 0.0002"),
        ({"speed": math.nan}, "speed"),
        ({"depth": 10.0}, "depth = 10 m must be at most 1"),
        ({"depth": math.inf}, "depth"),
    ],
)
def test_a_request_outside_the_bounds_is_refused(request_, words):
    with pytest.raises(KinematicsError, match=words):
        probe_settings_of(VALUES, ProbePlate.Request(**request_))
