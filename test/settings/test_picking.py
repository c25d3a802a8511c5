"""What is made of the parameters of ``pick_node``."""

import pytest

from tri_glide_kinematics.picking import TaughtCamera
from tri_glide_kinematics.settings.picking import cameras_of
from tri_glide_kinematics.settings.tables import ParameterError

CAMERAS = {
    "cameras": ("before", "behind"),
    "camera_places": (0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
    "camera_turns": (0.0, 0.0, 0.1, 0.2, 0.0, 0.0),
    "camera_scales": (1.0, 1.01),
    "camera_latencies": (0.02, 0.03),
}


def test_each_camera_has_its_own_numbers():
    assert cameras_of(CAMERAS) == {
        "before": TaughtCamera((0.1, 0.2, 0.3), (0.0, 0.0, 0.1), 1.0, 0.02),
        "behind": TaughtCamera((0.4, 0.5, 0.6), (0.2, 0.0, 0.0), 1.01, 0.03),
    }


@pytest.mark.parametrize(
    "name, value, told",
    [
        ("cameras", ("before", "before"), "must have each name once"),
        ("camera_turns", (0.0,) * 3, "camera_turns has 3 elements, expected 6"),
    ],
)
def test_numbers_that_fit_no_cameras_are_refused(name, value, told):
    with pytest.raises(ParameterError, match=told):
        cameras_of(CAMERAS | {name: value})
