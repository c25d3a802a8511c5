"""A followed branch: a point of the platform moves as its places say."""

import math

import numpy as np
import pytest
from f_mechanism_samples import example_2

POINT = (-7.0, 28.0)


@pytest.fixture(scope="module")
def branch():
    """A whole turn on the branch that has no turning points, where velocities stay finite."""
    mechanism, start = example_2(), math.radians(146.0)
    return mechanism.trace(start, mechanism.poses(start)[-1], steps=3600)


def test_a_point_of_the_platform_is_where_each_pose_has_it(branch):
    for row in range(0, len(branch.angle), 300):
        pose = branch.pose(row)
        assert branch.point(POINT)[row] == pytest.approx(pose.point(POINT), abs=1e-9)
        assert branch.point_velocity(POINT)[row] == pytest.approx(
            pose.point_velocity(POINT), abs=1e-7
        )


def test_the_velocity_of_a_point_is_the_difference_of_its_places(branch):
    step = branch.crank_angle[1] - branch.crank_angle[0]
    places, velocities = branch.point(POINT), branch.point_velocity(POINT)
    differences = (places[2:] - places[:-2]) / (2.0 * step)
    assert np.max(abs(differences - velocities[1:-1])) < 1e-3 * np.max(abs(velocities))


def test_joints_are_points_of_the_platform(branch):
    for index, joint in enumerate(branch.linkage.joints):
        places = branch.point((joint.real, joint.imag))
        assert places == pytest.approx(branch.platform_joints[:, index], abs=1e-10)
