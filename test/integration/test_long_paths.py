"""A path of thousands of segments is begun long before it is planned, and holds no cycle."""

import pytest

from benchmarks.bench_goals import RATE, begin, circle
from testing.goals import GoalClient
from testing.machine import Machine

# Beside other tests, planning gets a part of a processor, and a cycle waits for its turn.
pytestmark = [pytest.mark.nodes, pytest.mark.alone]

SEGMENTS = 10_000
# A busy computer gets so many rounds; the fault is there in each.
ROUNDS = 8

# As many times as late as a line may ten thousand segments begin: `python -m benchmarks goals` has
# the times.
LATER = 10.0
# A cycle that is held by planning is held each time.
LONGEST = 5.0 / RATE  # s


def test_a_path_of_many_segments_begins_soon_and_holds_no_cycle(client, nodes):
    machine = Machine(client, nodes).start({"rate": RATE})
    goals = GoalClient(client)
    begins = {1: [], SEGMENTS: []}
    for _ in range(ROUNDS):
        for count, found in begins.items():
            found.append(begin(machine, goals, circle(count)))
        delays = {count: min(each.delay for each in found) for count, found in begins.items()}
        gaps = {count: min(each.longest for each in found) for count, found in begins.items()}
        is_soon = delays[SEGMENTS] < LATER * delays[1]
        if is_soon and gaps[SEGMENTS] < max(LONGEST, 2.0 * gaps[1]):
            break
    else:
        raise AssertionError(f"{delays}, {gaps}")
    goals.close()
