"""From a file's content to a calibration, and to places that the machine can reach."""

from dataclasses import replace

import pytest
from calibration_samples import calibration, measured

from tri_glide_kinematics.calibration.fit import Touch
from tri_glide_kinematics.calibration.session import NO_PLACE, NOT_SAID, proposed, workspace_of
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.workspace import Cylinder, OutsideWorkspaceError, WorkspaceLimits

LIMITS = WorkspaceLimits((0.29,) * 3, (0.9,) * 3, 0.005, 6.0)


def test_no_place_outside_the_workspace_is_proposed():
    content, result = replace(measured(), workspace=LIMITS), calibration()
    proposals, remark = proposed(content, result, 12)
    assert len(proposals) == 12 and remark == ""
    assert {one.kind for one in proposals} == {"touch", "distance"}
    workspace = workspace_of(result.machine, LIMITS)
    for one in proposals:
        for place in one.places:
            workspace.check_position(place)
        # The travel is that of the drives: what they report stays inside.
        if isinstance(one.measurement, Touch):
            assert min(one.measurement.heights) >= 0.29 - 1e-9
    # It is the workspace that keeps them inside.
    with pytest.raises(OutsideWorkspaceError):
        for one in proposed(measured(), result, 12)[0]:
            for place in one.places:
                workspace.check_position(place)


def test_what_is_to_be_said_of_proposals_is_said():
    content, result = measured(), calibration()
    assert proposed(content, result, 0) == ((), "")
    assert proposed(content, result, 1)[1] == NOT_SAID
    above = replace(LIMITS, cylinder=Cylinder(0.0, 0.0, 0.1, 0.2, 0.5))
    assert proposed(replace(content, workspace=above), result, 3) == ((), NO_PLACE)


def test_the_travel_moves_with_the_height_offsets():
    machine = calibration().machine
    low = (0.0, 0.0, 0.0)
    heights = workspace_of(machine, LIMITS).machine.inverse(low)
    offsets = machine.height_offsets
    reported = min(height - offset for height, offset in zip(heights, offsets))
    for change, is_inside in ((-1e-6, True), (1e-6, False)):
        limits = replace(LIMITS, lower_heights=(reported + change,) * 3)
        try:
            workspace_of(machine, limits).check_position(low)
        except KinematicsError:
            assert not is_inside
        else:
            assert is_inside
