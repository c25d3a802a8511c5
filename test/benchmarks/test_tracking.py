"""The engine as ``ik_node`` steps it keeps up with twists that turn and targets that move."""

import pytest
from soak import some

from benchmarks import bench_tracking


@pytest.mark.slow
def test_lag_and_errors_are_as_small_as_they_were_measured(monkeypatch):
    monkeypatch.setattr(bench_tracking, "TURNS", some(bench_tracking.TURNS[::-1], 1))
    rows = list(bench_tracking.rows())
    assert len(rows) == len(bench_tracking.TURNS) + 4
    assert [row for row in rows if not row.is_reached] == []
