"""A path of thousands of segments is begun long before it is planned, and holds no cycle."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.bench_goals import RATE, begin, circle
from testing.goals import GoalClient
from testing.machine import Machine

pytestmark = pytest.mark.nodes

SEGMENTS = 10_000
ROUNDS = 3

# As many times as late as a line may ten thousand segments begin: `python -m benchmarks goals` has
# the times.
LATER = 10.0
# A cycle that is held by planning is held each time.
LONGEST = 5.0 / RATE  # s


def test_a_path_of_many_segments_begins_soon_and_holds_no_cycle(client, nodes):
    machine = Machine(client, nodes).start({"rate": RATE})
    goals = GoalClient(client)
    begins = {
        count: [begin(machine, goals, circle(count)) for _ in range(ROUNDS)]
        for count in (1, SEGMENTS)
    }
    goals.close()
    delays = {count: np.median([each.delay for each in found]) for count, found in begins.items()}
    assert delays[SEGMENTS] < LATER * delays[1], delays
    usual = min(each.longest for each in begins[1])
    assert min(each.longest for each in begins[SEGMENTS]) < max(LONGEST, 2.0 * usual)
