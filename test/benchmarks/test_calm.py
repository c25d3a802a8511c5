"""Shaped moves are there for good much sooner, and leave little of a swing."""

from __future__ import annotations

import pytest

from benchmarks.bench_calm import measured
from tri_glide_kinematics.motion import MotionKind


@pytest.mark.parametrize("kind", MotionKind)
def test_shaped_moves_are_there_sooner_and_leave_little(kind):
    calm = measured(kind, 20)
    assert calm.sooner <= 0.4
    assert calm.sooner_beside <= 0.7
    assert calm.over_best_jerk <= 1.0
    assert calm.left <= 0.05
