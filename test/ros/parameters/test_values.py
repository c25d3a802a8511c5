"""Values of parameters become geometry, limits and bounds, or are refused as a set."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.parameters import (
    IK_NODE,
    check_joint_names,
    check_travel,
    in_position_bounds_of,
    limits_of,
    machine_of,
    supervision_bounds_of,
    true_travel_of,
    workspace_limits_of,
)
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide

POSITION = (0.03, -0.02, 0.25)


def values(**changes):
    return {**{entry.name: entry.default for entry in IK_NODE}, **changes}


@pytest.mark.parametrize("geometry", ["symmetric", "calibrated"])
def test_the_defaults_are_the_default_machine_either_way(geometry):
    machine = machine_of(values(geometry=geometry))
    expected = TriGlide(DEFAULT_GEOMETRY).inverse(POSITION)
    assert machine.inverse(POSITION) == pytest.approx(expected, abs=1e-8)


def test_limits_are_those_of_the_parameters():
    limits = limits_of(values(velocity_limits=(1.0, 2.0, 3.0)))
    assert limits.velocity == (1.0, 2.0, 3.0)
    assert supervision_bounds_of(values(velocity_limits=(1.0, 2.0, 3.0))).velocity == (1, 2, 3)


def test_travel_is_given_as_reported_and_used_as_it_truly_is():
    changed = values(height_offsets=(0.001, -0.002, 0.0))
    lower, upper = true_travel_of(changed)
    assert lower == pytest.approx((0.301, 0.298, 0.3))
    assert upper == pytest.approx((0.901, 0.898, 0.9))
    limits = workspace_limits_of(changed)
    assert (limits.lower_heights, limits.upper_heights) == (lower, upper)


@pytest.mark.parametrize("space", ["unlimited", "box", "cylinder"])
def test_only_the_chosen_shape_limits_the_space(space):
    limits = workspace_limits_of(values(space=space))
    assert (limits.box_lower is not None) == (limits.box_upper is not None) == (space == "box")
    assert (limits.cylinder is not None) == (space == "cylinder")


@pytest.mark.parametrize(
    ("check", "changes", "words"),
    [
        (machine_of, {"arm_length": 0.001}, "arm"),
        (limits_of, {"jerk_limits": (1.0, 0.0, 1.0)}, r"jerk\[1\] = 0 m/s\^3"),
        (
            in_position_bounds_of,
            {"position_tolerance": 0.01},
            "position_tolerance = 0.01 m must be at most position_error_limit = 0.005 m",
        ),
        (
            in_position_bounds_of,
            {"settling_time": 2.0},
            "settling_time = 2 s must be at most settling_timeout = 1 s",
        ),
        (workspace_limits_of, {"space": "box", "box_lower": (0.2, 0.0, 0.0)}, "0.2"),
        (
            check_travel,
            {"lower_heights": (0.3, 0.9, 0.3)},
            r"lower_heights\[1\] = 0.9 m must be less than upper_heights\[1\] = 0.9 m",
        ),
        (check_joint_names, {"joint_names": ("a", "b", "a")}, "three different names"),
        (check_joint_names, {"joint_names": ("a", "", "c")}, "three different names"),
    ],
)
def test_values_that_do_not_fit_together_are_refused_by_name_and_number(check, changes, words):
    check(values())
    with pytest.raises(KinematicsError, match=words):
        check(values(**changes))
