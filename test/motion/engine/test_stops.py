"""A shorter form of the soak of stops: none breaks the law of stops."""

from __future__ import annotations

import pytest

from benchmarks.soak_stops import soak


@pytest.mark.slow
def test_no_stop_takes_longer_than_the_law_allows():
    found = soak(seed=8, count=20, compared=10)
    assert found.violations == []
    assert len({stop.kind for stop in found.stops}) >= 4
    assert any(stop.optimum > 0.0 for stop in found.stops)
