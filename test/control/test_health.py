"""The level of what is said of the controller: the worst of its state and of the last second."""

import pytest

from tri_glide_kinematics.control import (
    DISABLED,
    FAULT,
    IN_MOTION,
    WAITING,
    Cause,
    ControllerStatus,
    Level,
    LoopStatistics,
    OperatingState,
    Reason,
    delay_counts,
    status_of,
)
from tri_glide_kinematics.reason_log import ReasonLog


def health(state, missed=False):
    status = ControllerStatus(state, Reason(Cause.COMMAND, "because"), "target", missed, False)
    return status_of(status, ReasonLog(lambda text: None, 1))


@pytest.mark.parametrize("state", OperatingState)
def test_a_fault_is_an_error_and_what_refuses_motion_a_warning(state):
    expected = {FAULT: Level.ERROR, WAITING: Level.WARN, DISABLED: Level.WARN}
    assert health(state).level is expected.get(state, Level.OK)
    # Standard tools know a pause as a motion.
    word = "moving" if state is OperatingState.PAUSED else state.value
    assert health(state).message == f"{word}: because"
    assert health(state).values["state"] == (word if state in IN_MOTION else state.name.lower())


@pytest.mark.parametrize("state", OperatingState)
def test_a_missed_target_is_a_warning_at_least(state):
    assert health(state, missed=True).level == max(health(state).level, Level.WARN)


def test_classes_of_delays_have_names():
    loop = LoopStatistics(0.002)
    for now in (0.0, 0.002, 0.0047, 0.0067):
        loop.cycle(now)
    assert delay_counts(loop) == {
        "cycles late by up to 0.1 periods": 2,
        "cycles late by 0.1 to 0.25 periods": 0,
        "cycles late by 0.25 to 0.5 periods": 1,
        "cycles late by 0.5 to 1 periods": 0,
        "cycles late by 1 to 5 periods": 0,
        "cycles late by more than five periods": 0,
    }
