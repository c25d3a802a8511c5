"""Setpoints of moves stay as smooth as they were measured; the figures themselves are right."""

import numpy as np
import pytest
from soak import some

from benchmarks import bench_smoothness
from benchmarks.bench_smoothness import PERIOD, smoothness
from benchmarks.judge import LIMITS

JERK = LIMITS.jerk[0]


def driven(jerks):
    """Return heights of a slider with these jerks, beside two that rest. Shape (n, 3) [m]."""
    heights = np.cumsum(np.cumsum(np.cumsum(jerks))) * PERIOD**3
    return np.column_stack((0.6 + heights, *[np.full(len(heights), 0.6)] * 2))


def test_figures_of_a_known_motion():
    phase = np.full(50, JERK)
    jerks = np.concatenate((np.zeros(5), phase, -phase, np.zeros(100), -phase, phase, np.zeros(5)))
    found = smoothness("known", [driven(jerks)])
    # Up, down by twice the limit, up; then the same the other way round.
    assert found.variation == pytest.approx([8.0], rel=1e-6)
    assert found.turns.tolist() == [2]
    assert found.fast < 0.03


def test_a_jerk_that_chatters_is_told():
    phase = np.tile((JERK, -JERK), 50)
    found = smoothness("chatter", [driven(np.concatenate((np.zeros(5), phase, np.zeros(5))))])
    assert found.fast > 0.9
    assert found.turns.tolist() == [99]
    assert found.variation == pytest.approx([200.0], rel=1e-6)


@pytest.mark.slow
def test_setpoints_are_as_smooth_as_they_were_measured(monkeypatch):
    for name, count in (("MOVES", 5), ("JOGS", 1), ("TARGETS", 1), ("PATHS", 1)):
        numbers = some(range(getattr(bench_smoothness, name)), count)
        monkeypatch.setattr(bench_smoothness, name, len(numbers))
    found = {row.kind: row for row in bench_smoothness.rows()}
    assert found.keys() == bench_smoothness.KINDS.keys()
    assert min(row.motions for row in found.values()) >= 1
    # A slider that is at its limit all the time takes 8.
    for kind, turns, variation in (("lines", 20, 14.0), ("slider moves", 5, 8.1)):
        assert found[kind].fast < 0.012
        assert found[kind].turns.max() <= turns
        assert found[kind].variation.max() < variation
    assert found["paths"].fast < 0.02
    assert found["paths"].variation.max() < 60.0
