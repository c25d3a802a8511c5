"""Phases of constant jerk and the knots in them."""

from __future__ import annotations

import numpy as np
from strategies import nudged

from tri_glide_kinematics.motion.phases import knots


def test_each_phase_gets_as_many_pieces_whatever_the_last_bits_are():
    rng = np.random.default_rng(1)
    # Half of the 13 pieces end in the middle of the motion.
    durations = [0.1, 0.2, 0.2, 0.1]
    counts = set()
    for _ in range(100):
        nudged_durations = nudged(rng, durations).tolist()
        times = np.array(knots([(time, 1.0) for time in nudged_durations], 13, 1e-6))
        assert len(times) == 14
        ends = np.cumsum([0.0, *durations])
        counts.add(tuple(np.histogram(times + 1e-9, ends)[0].tolist()))
    assert len(counts) == 1
