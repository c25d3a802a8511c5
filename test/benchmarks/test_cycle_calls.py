"""The control cycle stays short: what each one calls is counted, not timed."""

import pytest

from benchmarks.cycle_calls import CYCLES, GOALS, calls_in


@pytest.mark.parametrize("state", GOALS)
def test_a_cycle_calls_no_more_than_is_wanted(state):
    calls = calls_in(state)
    assert any(code.co_name == "cycle" and count == CYCLES for code, count in calls.items())
    assert sum(calls.values()) <= GOALS[state] * CYCLES
