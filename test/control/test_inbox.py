from __future__ import annotations

from itertools import pairwise

import pytest

from tri_glide_kinematics.control import COMMAND_INTERVAL, Inbox, Kind
from tri_glide_kinematics.motion.engine import DriveLimits, Move, NewLimits
from tri_glide_kinematics.motion.limits import SliderLimits

LIMITS = NewLimits(DriveLimits(SliderLimits.uniform(1.0, 10.0, 200.0), 0.5))


def target(z: float) -> Move:
    return Move((0.0, 0.0, z))


@pytest.mark.parametrize("period", [0.0005, 0.001, 0.002, 0.01])
def test_in_a_flood_the_newest_has_its_turn_once_in_the_interval(period):
    inbox = Inbox(period)
    taken: list[int] = []
    for cycle in range(200):
        targets = [target(cycle + 0.1 * part) for part in range(3)]
        for older, newer in zip([None, *targets], targets):
            replaced = inbox.put(newer)
            assert older is None or replaced is older
        command = inbox.take(cycle, in_each=False)
        assert inbox.take(cycle, in_each=False) is None
        if command is not None:
            taken.append(cycle)
            assert command is targets[-1]
    pauses = {(later - earlier) * period for earlier, later in pairwise(taken)}
    assert len(pauses) == 1
    assert COMMAND_INTERVAL <= pauses.pop() + 1e-12 < COMMAND_INTERVAL + period + 1e-9


def test_at_rest_each_cycle_has_a_turn():
    inbox = Inbox(0.001)
    for cycle in range(5):
        newest = target(cycle)
        inbox.put(newest)
        assert inbox.take(cycle, in_each=True) is newest
        assert inbox.take(cycle, in_each=True) is None


def test_no_kind_keeps_another_from_its_turn():
    inbox = Inbox(0.001)
    kinds = []
    for cycle in range(60):
        inbox.put(target(cycle))
        inbox.put(LIMITS)
        command = inbox.take(cycle, in_each=True)
        kinds.append(type(command))
    assert abs(kinds.count(NewLimits) - kinds.count(Move)) <= 1


def test_what_is_dropped_is_told_and_gone():
    inbox = Inbox(0.001)
    waiting = target(1.0)
    inbox.put(waiting)
    inbox.put(LIMITS)
    assert inbox.drop(Kind.TARGET) is waiting
    assert inbox.drop(Kind.TARGET) is None
    assert inbox.take(0, in_each=True) is LIMITS
    assert inbox.take(1, in_each=True) is None
