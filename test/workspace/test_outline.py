"""The outline of a workspace: its lines lie on the edge, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest
from soak import many
from strategies import DEFAULT_LIMITS, is_inside, random_geometry

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import TOLERANCE, Cylinder, Workspace, outline

MACHINE = TriGlide(DEFAULT_GEOMETRY)
LOWER, UPPER = (-0.05, -0.03, 0.2), (0.07, 0.06, 0.35)
LIMITS = {
    "unlimited": DEFAULT_LIMITS,
    "conditioning": replace(DEFAULT_LIMITS, max_condition_number=3.0),
    "box": replace(DEFAULT_LIMITS, box_lower=LOWER, box_upper=UPPER),
    "flat box": replace(
        DEFAULT_LIMITS, box_lower=(*LOWER[:2], 0.25), box_upper=(*UPPER[:2], 0.251)
    ),
    "box that is open below": replace(DEFAULT_LIMITS, box_upper=UPPER),
    "cylinder": replace(DEFAULT_LIMITS, cylinder=Cylinder(0.03, -0.02, 0.05, 0.22, 0.4)),
}


def lies_on_the_edge(workspace, point):
    """Tell whether a place is inside, and one near it is not."""
    near = point + 3.0 * TOLERANCE * np.vstack((np.eye(3), -np.eye(3)))
    return is_inside(workspace, point) and not all(is_inside(workspace, place) for place in near)


def assert_lines_on_the_edge(workspace):
    lines = at_once(outline(workspace)).reshape(-1, 2, 3)
    assert len(lines) > 100
    for point in np.unique(lines[:, 0], axis=0)[::19]:
        assert lies_on_the_edge(workspace, point), point
    # Each ring is closed: each line begins where another one ends.
    rings = lines[np.abs(lines[:, 0, 2] - lines[:, 1, 2]) < 1e-12]
    assert {tuple(point) for point in rings[:, 0]} == {tuple(point) for point in rings[:, 1]}


@pytest.mark.parametrize("name", LIMITS)
def test_all_lines_begin_and_end_on_the_edge(name):
    assert_lines_on_the_edge(Workspace(MACHINE, LIMITS[name]))


@pytest.mark.parametrize("seed", range(many(2)))
def test_the_same_for_unequal_machines(seed):
    machine = TriGlide(random_geometry(np.random.default_rng(seed), symmetric=False))
    limits = replace(DEFAULT_LIMITS, lower_heights=(0.0,) * 3, upper_heights=(1.5,) * 3)
    assert_lines_on_the_edge(Workspace(machine, limits))


def test_the_corners_of_a_box_are_there():
    lines = at_once(outline(Workspace(MACHINE, LIMITS["box"])))
    corners = np.array(np.meshgrid(*zip(LOWER, UPPER))).reshape(3, -1).T
    for corner in corners:
        assert np.linalg.norm(lines - corner, axis=1).min() < 5.0 * TOLERANCE


def test_a_cylinder_is_as_wide_and_as_tall_as_it_is():
    cylinder = LIMITS["cylinder"].cylinder
    lines = at_once(outline(Workspace(MACHINE, LIMITS["cylinder"])))
    distances = np.hypot(lines[:, 0] - cylinder.center_x, lines[:, 1] - cylinder.center_y)
    assert distances == pytest.approx(cylinder.radius, abs=2.0 * TOLERANCE)
    ends = lines[:, 2].min(), lines[:, 2].max()
    assert ends == pytest.approx((cylinder.z_min, cylinder.z_max), abs=2.0 * TOLERANCE)


def test_where_there_is_no_place_inside_there_are_no_lines():
    limits = replace(DEFAULT_LIMITS, box_lower=(1.0, 1.0, 0.2), box_upper=(1.1, 1.1, 0.3))
    assert at_once(outline(Workspace(MACHINE, limits))).shape == (0, 3)
