"""The level of what is said of the controller: the worst of its state and of the last second."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.control.controller_health import status_of
from tri_glide_kinematics.control.health import Level
from tri_glide_kinematics.control.operating_state import (
    DISABLED,
    FAULT,
    WAITING,
    OperatingState,
)
from tri_glide_kinematics.control.reason_log import ReasonLog
from tri_glide_kinematics.control.status import ControllerStatus


def health(state, missed=False):
    status = ControllerStatus(state, "because", "target", missed, False)
    return status_of(status, ReasonLog(lambda text: None, 1))


@pytest.mark.parametrize("state", OperatingState)
def test_a_fault_is_an_error_and_what_refuses_motion_a_warning(state):
    expected = {FAULT: Level.ERROR, WAITING: Level.WARN, DISABLED: Level.WARN}
    assert health(state).level is expected.get(state, Level.OK)
    assert health(state).message == f"{state.value}: because"


@pytest.mark.parametrize("state", OperatingState)
def test_a_missed_target_is_a_warning_at_least(state):
    assert health(state, missed=True).level == max(health(state).level, Level.WARN)
