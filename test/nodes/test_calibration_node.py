"""Numbers of requests have the bounds of the parameters that they take the place of."""

import math

import pytest
from geometry_msgs.msg import Point, Vector3

from tri_glide_interfaces.srv import FindModes, ProbePlate, RecordTouch
from tri_glide_kinematics.calibration.ringdown import NotKnown
from tri_glide_kinematics.calibration.session import SwingSettings
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.shaping import ShaperKind
from tri_glide_kinematics.nodes.calibration_node import (
    drawing_of,
    plate_of,
    probe_settings_of,
    requested,
    shaper_kind_of,
    swing_settings_of,
)
from tri_glide_kinematics.settings import CALIBRATION_NODE

VALUES = {entry.name: entry.default for entry in CALIBRATION_NODE}


def test_zero_stands_for_the_parameter():
    settings = probe_settings_of(VALUES, ProbePlate.Request())
    assert (settings.speed, settings.depth) == (0.002, 0.01)
    settings = probe_settings_of(VALUES, ProbePlate.Request(depth=1.0, speed=0.1))
    assert (settings.speed, settings.depth) == (0.1, 1.0)
    for told, expected in ((0.0, 1e-5), (2e-5, 2e-5)):
        touch = RecordTouch.Request(standard_deviation=told)
        assert requested(VALUES, touch, "standard_deviation", "touch_deviation") == expected


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


def test_a_drawing_that_is_no_machine_is_refused_by_its_name():
    assert drawing_of(VALUES) is None
    with pytest.raises(KinematicsError, match=r"^drawn_machine: arm_lengths\[0\] = -1 m must be"):
        drawing_of({**VALUES, "drawn_machine": (-1.0,) * 12})


def test_a_search_for_modes_without_numbers_is_that_by_default():
    assert swing_settings_of(FindModes.Request()) == SwingSettings()
    asked = FindModes.Request(
        directions=[Vector3(z=2.0)], place=[Point(x=0.1)], length=0.05, duration=1.0
    )
    assert swing_settings_of(asked) == SwingSettings(((0.0, 0.0, 2.0),), 0.05, 1.0, (0.1, 0.0, 0.0))


@pytest.mark.parametrize(
    ("request_", "words"),
    [({"place": [Point(), Point()]}, "2 places"), ({"source": 7}, "source = 7: it must be one of")],
)
def test_a_search_that_cannot_be_is_refused(request_, words):
    with pytest.raises(KinematicsError, match=words):
        swing_settings_of(FindModes.Request(**request_))


def test_a_shaper_is_named():
    assert shaper_kind_of("") is ShaperKind.EI
    assert shaper_kind_of("zv") is ShaperKind.ZV
    with pytest.raises(KinematicsError, match="shaper = 'best': it must be one of zv, mzv"):
        shaper_kind_of("best")


def test_each_reason_why_no_mode_is_known_has_a_number_of_its_own():
    numbers = [getattr(FindModes.Response, reason.name) for reason in NotKnown]
    assert sorted(numbers) == list(range(1, len(NotKnown) + 1))


@pytest.mark.parametrize(
    ("known", "height", "tilt"),
    [
        ("height_and_tilt", 0.02, (0.01, 0.0)),
        ("tilt", None, (0.01, 0.0)),
        ("nothing", None, None),
    ],
)
def test_of_a_plate_so_much_is_known(known, height, tilt):
    values = VALUES | {"plate_known": known, "plate_height": 0.02, "plate_tilt": (0.01, 0.0)}
    plate = plate_of(values)
    assert (plate.height, plate.tilt) == (height, tilt)
