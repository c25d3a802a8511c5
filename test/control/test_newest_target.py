"""What is said of a target from the last setpoint on, until there is another one."""

import pytest
from controller_rig import IN_POSITION

from tri_glide_kinematics.control import CAUSE_OF, Arrival, Cause, NewestTarget, Reason
from tri_glide_kinematics.motion.engine import Follow, GoalCode, Move

BECAUSE = Reason(Cause.COMMAND, "because")
NEAR, OFF, FAR = 0.0001, 0.002, 0.02  # m, from the target


@pytest.fixture
def target():
    target = NewestTarget(IN_POSITION)
    target.take(Move((0.0, 0.0, 0.3)), BECAUSE)
    target.judge_from(0.0)
    return target


def arrival_after(target, distance, time):
    """Measure a ``distance`` until ``time`` and return the arrival then."""
    for step in range(11):
        target.measured(distance, time - 0.1 + 0.01 * step)
    return target.arrival(time)


@pytest.mark.parametrize(
    ("distance", "expected", "words"),
    [
        (NEAR, Arrival.REACHED, "(0, 0, 0.3) m is reached, measured 0.0001 m away"),
        (OFF, Arrival.NOT_REACHED, "is NOT reached, measured 0.002 m away, more than 0.0005 m"),
        (FAR, Arrival.TOO_FAR, "is not reached, measured 0.02 m away, more than 0.005 m"),
    ],
)
def test_what_is_said_and_whether_it_is_missed(target, distance, expected, words):
    arrival, reason = arrival_after(target, distance, 0.6)
    assert arrival is target.decided is expected
    assert reason.cause is CAUSE_OF[expected]
    assert words in reason.text
    assert target.distance == distance
    assert target.is_missed == (expected is not Arrival.REACHED) != target.is_reached


def test_a_target_that_was_missed_may_still_be_reached(target):
    arrival_after(target, OFF, 0.6)
    assert arrival_after(target, NEAR, 0.8)[0] is Arrival.REACHED
    assert target.is_reached and not target.is_missed
    assert target.distance == NEAR
    assert not target.is_judged


def test_the_next_target_is_not_missed_and_not_judged_yet(target):
    arrival_after(target, OFF, 0.6)
    target.take(Move((0.0, 0.0, 0.2)), BECAUSE)
    assert not target.is_missed and target.distance is None
    assert target.arrival(9.0) == (Arrival.SETTLING, None)
    assert "0.2" in target.text
    assert target.position == (0.0, 0.0, 0.2)


def test_of_a_path_that_was_extended_all_is_driven(target):
    def path(extends):
        return Follow.made(lambda end: iter(()), "path", extends)

    first, behind, other = path(False), path(True), path(False)
    for command in (first, behind):
        target.take(command, BECAUSE)
    assert target.driven == (first, behind)
    target.take(other, BECAUSE)
    assert target.driven == (other,)
    superseded = (GoalCode.SUPERSEDED, "superseded by path")
    assert first.outcome == behind.outcome == superseded and other.outcome is None


def test_who_cancels_is_told_at_rest_or_when_another_target_is_taken(target):
    first, second = target.command, Move((0.0, 0.0, 0.2))
    target.cancel(first)
    target.end_driven(GoalCode.SUCCEEDED, "there")
    assert first.outcome is None
    target.take(second, BECAUSE)
    assert first.outcome == (GoalCode.CANCELED, f"cancelled: {first}; then came {second}")
    target.cancel(second)
    target.come_to_rest(1.0)
    target.rest_measured(NEAR, 1.0)
    target.come_to_rest(1.0 + 0.5 * IN_POSITION.settling_time)
    assert second.outcome is None and target.cancelled == [second]
    target.come_to_rest(1.0 + IN_POSITION.settling_time)
    assert second.outcome == (GoalCode.CANCELED, f"cancelled: {second}") and not target.cancelled
