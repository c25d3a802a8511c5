import numpy as np
import pytest

from tri_glide_kinematics.motion.path_timing.grid import RestMap

MAPS = [
    RestMap(0.0, 0.1, 0.02, 0.03),
    RestMap(0.2, 0.3, 0.0, 0.04),
    RestMap(0.0, 0.06, 0.05, 0.05),
    RestMap(1.0, 1.5, 0.0, 0.0),
]


@pytest.mark.parametrize("chosen", MAPS)
def test_derivatives_are_those_of_the_way(chosen):
    step = 1e-5 * chosen.span
    u = np.linspace(3.0 * step, chosen.span - 3.0 * step, 501)
    before, here, after = (chosen.derivatives(u + shift) for shift in (-step, 0.0, step))
    for order in range(3):
        slopes = (after[order] - before[order]) / (2.0 * step)
        size = np.abs(here[order + 1]).max() + 1.0
        assert np.abs(slopes - here[order + 1]).max() < 1e-3 * size


@pytest.mark.parametrize("chosen", MAPS)
def test_parameters_invert_the_way(chosen):
    u = np.linspace(0.0, chosen.span, 1001)
    ways = chosen.derivatives(u)[0]
    assert ways[[0, -1]] == pytest.approx((chosen.begin, chosen.end), abs=1e-15)
    assert (np.diff(ways) > 0.0).all()
    again = chosen.derivatives(chosen.parameters(ways))[0]
    assert np.abs(again - ways).max() < 1e-12


def test_rest_is_regular():
    """The way begins with the third power of the parameter."""
    _, first, second, third = MAPS[0].derivatives(np.array((0.0, MAPS[0].span)))
    assert np.abs(first).max() == 0.0 and np.abs(second).max() == 0.0
    assert third.min() > 0.0
