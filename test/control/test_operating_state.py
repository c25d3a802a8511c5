from itertools import product

import pytest
from strategies import accepts

from tri_glide_kinematics.control import (
    DISABLED,
    FAULT,
    FOLLOWERS,
    IDLE,
    MOVING,
    WAITING,
    Cause,
    ForbiddenTransitionError,
    OperatingState,
    Reason,
    StateMachine,
)


def reason(text):
    return Reason(Cause.COMMAND, text)


def test_each_new_state_or_reason_is_told_and_the_same_again_is_not():
    changes = []
    machine = StateMachine(
        WAITING, reason("start"), lambda: changes.append((machine.state, machine.reason))
    )
    machine.change(IDLE, reason("measured"))
    machine.change(MOVING, reason("first target"))
    machine.change(MOVING, reason("second target"))
    machine.change(MOVING, reason("second target"))
    machine.change(FAULT, reason("silent"))
    assert changes == [
        (IDLE, reason("measured")),
        (MOVING, reason("first target")),
        (MOVING, reason("second target")),
        (FAULT, reason("silent")),
    ]


@pytest.mark.parametrize(("state", "following"), [*product(OperatingState, repeat=2)])
def test_only_listed_states_follow(state, following):
    machine = StateMachine(state, reason(""), lambda: None)
    if following is state or following in FOLLOWERS[state]:
        machine.change(following, reason(""))
        assert machine.state is following
    else:
        with pytest.raises(ForbiddenTransitionError, match="cannot follow"):
            machine.change(following, reason(""))
        assert machine.state is state


def test_no_motion_follows_a_fault_without_somebody_who_clears_it():
    assert not FOLLOWERS[FAULT] & {MOVING, WAITING}
    assert FOLLOWERS.keys() == set(OperatingState)


@pytest.mark.parametrize("state", OperatingState)
def test_motion_is_accepted_where_the_machine_is_led_and_no_fault(state):
    machine = StateMachine(state, reason("because"), lambda: None)
    assert accepts(machine.check_accepting) == (state not in (WAITING, FAULT, DISABLED))


@pytest.mark.parametrize("asked_for", [True, False])
@pytest.mark.parametrize("then", [IDLE, DISABLED])
def test_a_stop_that_was_asked_for_is_not_cut_short_and_ends_where_it_should(asked_for, then):
    machine = StateMachine(MOVING, reason("target"), lambda: None)
    machine.stop(reason("because"), asked_for=asked_for, then=then)
    assert accepts(machine.check_accepting) != asked_for
    machine.stopped()
    assert (machine.state, machine.reason) == (then, reason("at rest: because"))
