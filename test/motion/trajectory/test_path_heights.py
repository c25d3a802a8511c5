import numpy as np
import pytest
from motion_machine import MACHINE
from timed_paths import random_path, seen


@pytest.mark.parametrize("seed", range(8))
def test_derivatives_are_those_of_the_inverse_kinematics(seed):
    curve = seen(random_path(seed))
    breaks = curve.driven.breaks
    step = 1e-4 * np.diff(breaks).min()
    ways = 0.5 * (breaks[1:] + breaks[:-1])
    before, here, after = (curve.derivatives(ways + shift).heights for shift in (-step, 0, step))
    places = curve.driven.derivatives(ways, 0)[0]
    expected = np.array([MACHINE.inverse(place) for place in places]).T
    assert here[0] == pytest.approx(expected, abs=1e-14)
    for order in range(3):
        slopes = (after[order] - before[order]) / (2.0 * step)
        assert np.abs(slopes - here[order + 1]).max() < 1e-4 * np.abs(here[order + 1]).max() + 1e-6


@pytest.mark.parametrize("seed", range(8))
def test_a_state_in_plain_floats_is_the_same(seed):
    curve = seen(random_path(seed))
    chance = np.random.default_rng(seed)
    for way in chance.uniform(0.0, curve.driven.length, 50).tolist():
        speed, acceleration = chance.uniform(-1.0, 1.0, 2).tolist()
        (h, first, second, _), _ = curve.derivatives(np.array((way,)))
        state = curve.state(way, speed, acceleration)
        assert state.heights == pytest.approx(h[:, 0], abs=1e-14)
        assert state.velocities == pytest.approx(first[:, 0] * speed, abs=1e-12)
        expected = first[:, 0] * acceleration + second[:, 0] * speed**2
        assert state.accelerations == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert all(type(value) is float for values in state for value in values)
