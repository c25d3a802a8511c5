"""By how much heights pass the limits is what the workspace says of each of them."""

from dataclasses import replace

import numpy as np
import pytest
from strategies import accepts

from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import (
    Cylinder,
    Workspace,
    WorkspaceLimits,
    overruns,
    places_inside,
)

MACHINE = TriGlide(DEFAULT_GEOMETRY)
PLAIN = WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)
BOX = replace(PLAIN, box_lower=(-0.1, -0.05, 0.1), box_upper=(0.12, 0.08, 0.4))
CENTRE = np.array((0.0, 0.0, 0.3))
ROUND = replace(PLAIN, cylinder=Cylinder(0.01, 0.0, 0.1, 0.15, 0.4))


@pytest.mark.parametrize("limits", [PLAIN, BOX, ROUND])
def test_the_workspace_agrees(limits):
    workspace = Workspace(MACHINE, limits)
    rng = np.random.default_rng(3)
    heights = np.clip(rng.uniform(0.28, 0.92, (400, 1)) + rng.uniform(-0.25, 0.25, (400, 3)), 0, 1)
    found = overruns(MACHINE, limits, heights)
    outside = [not accepts(workspace.check_heights, row) for row in heights.tolist()]
    assert 40 < sum(outside) < 395
    # None of these is within the tolerance of an edge.
    np.testing.assert_array_equal(found.are_outside, outside)


@pytest.mark.parametrize(
    ("limits", "lowest", "highest"),
    [
        (PLAIN, (-0.2, -0.17, -0.046), (0.2, 0.24, 0.55)),
        (BOX, BOX.box_lower, BOX.box_upper),
        (ROUND, (-0.09, -0.095, 0.15), (0.11, 0.095, 0.4)),
    ],
)
def test_places_are_spread_over_all_of_a_workspace(limits, lowest, highest):
    places = places_inside(MACHINE, limits)
    workspace = Workspace(MACHINE, limits)
    for place in places.tolist():
        # A place on an edge may be outside by rounding.
        workspace.check_position(CENTRE + 0.999999 * (place - CENTRE))
    assert (places.min(axis=0) <= np.array(lowest) + 1e-9).all()
    assert (places.max(axis=0) >= np.array(highest) - 1e-9).all()


def test_each_limit_is_passed_by_its_own_amount():
    heights = np.array(MACHINE.inverse((0.13, 0.0, 0.25)))[np.newaxis]
    found = overruns(MACHINE, BOX, heights)
    assert found.place[0] == pytest.approx(0.01)
    assert found.travel[0] < 0.0
    assert overruns(MACHINE, ROUND, heights).place[0] == pytest.approx(0.02)
    assert overruns(MACHINE, PLAIN, heights).place[0] == -np.inf
    lower = replace(PLAIN, lower_heights=tuple(heights[0] + 1e-3))
    assert overruns(MACHINE, lower, heights).travel[0] == pytest.approx(1e-3)
    condition = MACHINE.condition_number((0.13, 0.0, 0.25))
    tight = replace(PLAIN, max_condition_number=0.9 * condition)
    assert overruns(MACHINE, tight, heights).condition[0] == pytest.approx(1.0 / 0.9 - 1, rel=1e-2)


@pytest.mark.parametrize("heights", [(0.3, 1.5, 0.3), (np.nan, 0.5, 0.5)])
def test_what_has_no_pose_is_outside(heights):
    assert overruns(MACHINE, PLAIN, [heights]).are_outside.all()
