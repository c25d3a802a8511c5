"""The moves of a search for modes, before anything moves."""

import math

import pytest

from tri_glide_kinematics.calibration.session import SwingSettings, swing_moves
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

WORKSPACE = Workspace(
    TriGlide(DEFAULT_GEOMETRY), WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)
)
PLACE = (0.0, 0.0, 0.3)


def test_each_direction_is_driven_out_and_back():
    moves = swing_moves(WORKSPACE, PLACE, SwingSettings())
    assert [move.target for move in moves[:3]] == [
        pytest.approx((0.02, 0.0, 0.3)),
        pytest.approx((0.008, 0.0, 0.3)),
        pytest.approx(PLACE),
    ]
    assert len(moves) == 9
    assert moves[-1].target == pytest.approx(PLACE)
    assert all(move.is_recorded for move in moves)


def test_a_place_is_gone_to_without_a_recording():
    settings = SwingSettings(((0.0, 0.0, 2.0),), 0.01, 0.3, (0.02, 0.01, 0.28))
    moves = swing_moves(WORKSPACE, PLACE, settings)
    assert moves[0].target == (0.02, 0.01, 0.28)
    assert moves[1].target == pytest.approx((0.02, 0.01, 0.29))
    assert [move.is_recorded for move in moves] == [False, True, True, True]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (SwingSettings(length=0.5), r"outside the workspace at \(0\.\d+, 0, 0\.3\) m: .* breaks"),
        (SwingSettings(place=(0.5, 0.0, 0.3)), r"outside|reach"),
        (SwingSettings(((0.0, 0.0, 1.0),), 0.4), "upper end of slider travel of arm 1, 0.9 m"),
        (SwingSettings(((0.0, 0.0, -1.0),), 0.4), "lower end of slider travel of arm 1, 0.3 m"),
    ],
)
def test_no_way_leaves_the_workspace(settings, words):
    with pytest.raises(KinematicsError, match=words):
        swing_moves(WORKSPACE, PLACE, settings)


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({"directions": ()}, "number of directions = 0 must be 1 to 9"),
        ({"directions": ((0.0, 0.0, 0.0),)}, r"directions\[0\] = 0 must be greater than 0"),
        ({"directions": ((math.nan, 0.0, 0.0),)}, r"directions\[0\]\[0\]"),
        ({"length": 1e-4}, "length = 0.0001 m must be from 0.001 to 0.5"),
        ({"length": math.inf}, "length"),
        ({"duration": 61.0}, "duration = 61 s must be from 0.2 to 60"),
        ({"place": (0.0, math.nan, 0.0)}, r"place\[1\]"),
    ],
)
def test_numbers_have_bounds(numbers, words):
    with pytest.raises(KinematicsError, match=words):
        SwingSettings(**numbers)
