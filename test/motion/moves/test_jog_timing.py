"""Which part of a jog is to become slower."""

import numpy as np
import pytest
from strategies import nudged

from tri_glide_kinematics.motion.moves.line_timing import JOG_MARGIN, JogFactors, TimedJog
from tri_glide_kinematics.motion.trajectory import TimeScaling

KNOTS = np.array([0.0, 0.1, 0.2, 0.7, 1.0])


@pytest.mark.parametrize(
    ("slowdowns", "expected"),
    [
        ((1.0, 2.0, 1.0, 1.0), JogFactors(0.9 / (2.0 * JOG_MARGIN) ** 2)),
        ((1.0, 1.0, 2.0, 1.0), JogFactors(0.9, speed=1.0 / (2.0 * JOG_MARGIN))),
        ((1.0, 1.0, 1.0, 2.0), JogFactors(0.9, 0.8 / (2.0 * JOG_MARGIN) ** 2)),
        ((1.0, 1.0, 1.0, 1.0), JogFactors(0.9)),
    ],
)
def test_only_the_part_that_is_too_fast_becomes_slower(slowdowns, expected):
    rng = np.random.default_rng(1)
    for _ in range(50):
        times = np.append(0.0, nudged(rng, KNOTS[1:]))
        steady_from, steady_until = nudged(rng, (0.2, 0.7)).tolist()
        timed = TimedJog(TimeScaling(times, times, times, times), steady_from, steady_until)
        assert JogFactors(0.9).after(timed, nudged(rng, slowdowns)) == pytest.approx(expected)
