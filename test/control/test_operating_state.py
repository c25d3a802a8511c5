from __future__ import annotations

from itertools import product

import pytest

from tri_glide_kinematics.control.operating_state import (
    FAULT,
    FOLLOWERS,
    IDLE,
    MOVING,
    WAITING,
    ForbiddenTransitionError,
    OperatingState,
    StateMachine,
)


def test_each_new_state_or_reason_is_told_and_the_same_again_is_not():
    changes = []
    machine = StateMachine(
        WAITING, "start", lambda: changes.append((machine.state, machine.reason))
    )
    machine.change(IDLE, "measured")
    machine.change(MOVING, "first target")
    machine.change(MOVING, "second target")
    machine.change(MOVING, "second target")
    machine.change(FAULT, "silent")
    assert changes == [
        (IDLE, "measured"),
        (MOVING, "first target"),
        (MOVING, "second target"),
        (FAULT, "silent"),
    ]


@pytest.mark.parametrize(("state", "following"), [*product(OperatingState, repeat=2)])
def test_only_listed_states_follow(state, following):
    machine = StateMachine(state, "", lambda: None)
    if following is state or following in FOLLOWERS[state]:
        machine.change(following, "")
        assert machine.state is following
    else:
        with pytest.raises(ForbiddenTransitionError, match="cannot follow"):
            machine.change(following, "")
        assert machine.state is state


def test_no_motion_follows_a_fault_without_somebody_who_clears_it():
    assert not FOLLOWERS[FAULT] & {MOVING, WAITING}
    assert FOLLOWERS.keys() == set(OperatingState)
