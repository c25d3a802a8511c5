"""The bound from above of the parts that are placed is one."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from benchmarks import bench_pick
from benchmarks.bench_pick import DWELL, WINDOW, Stream, bound, half_cycle, placed, stream


def placed_in(order, parts: Stream):
    """Return how many parts are placed in an ``order``; times are looked for in small steps."""
    now, count = -10.0, 0
    for part in order:
        enters, side = parts.times[part], parts.sides[part]
        ways = np.arange(*WINDOW, 0.0005)
        grips = enters + (ways - WINDOW[0]) / parts.speed
        halves = half_cycle(ways, side, parts.speed)
        fits = np.flatnonzero(now + halves <= grips)
        if len(fits):
            now = grips[fits[0]] + halves[fits[0]] + 2.0 * DWELL
            count += 1
    return count


@pytest.mark.parametrize("speed", [0.1, 0.3])
@pytest.mark.parametrize("place", [(0.0, 0.2), (0.15, 0.15)])
@pytest.mark.parametrize("seed", range(3))
def test_no_order_places_more_than_the_bound_and_the_best_is_near_to_it(
    monkeypatch, speed, place, seed
):
    monkeypatch.setattr(bench_pick, "PLACE", place)
    parts = stream("in bursts", 1.3, speed, seed, 6)
    best = max(placed_in(order, parts) for order in permutations(range(6)))
    assert best <= bound(parts, np.zeros(6, dtype=bool)) <= best + 1
    assert placed(parts).sum() >= best - 1
