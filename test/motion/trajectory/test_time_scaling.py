"""When a motion is where on its line."""

import numpy as np
import pytest

from tri_glide_kinematics.motion.trajectory import TimeScaling

SCALING = TimeScaling(
    np.array((0.0, 0.1, 0.2)), np.array((0.0, 0.01, 0.02)), np.array((0.0, 0.2, 0.0)), np.zeros(3)
)


def test_a_delay_is_rest_and_then_the_same() -> None:
    delayed = SCALING.delayed(0.05)
    for time in (0.0, 0.02, 0.05):
        assert [values[0] for values in delayed.evaluate(np.array((time,)))] == [0.0, 0.0, 0.0]
    times = np.linspace(0.0, 0.2, 21)
    for late, early in zip(delayed.evaluate(times + 0.05), SCALING.evaluate(times)):
        assert late == pytest.approx(early, abs=1e-12)


def test_no_delay_adds_no_piece_without_length() -> None:
    assert (np.diff(SCALING.delayed(0.0).times) > 0.0).all()
    assert np.isfinite(SCALING.delayed(0.0).coefficients()).all()
