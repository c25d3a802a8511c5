"""The compiled batch functions give what the others give; without numba, the others do it."""

import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry, batch

ONE_MODE = TriGlideGeometry.symmetric(0.25, 0.05, 0.4)
TWO_MODES = TriGlideGeometry(((0.3, 0.0), (-0.1, 0.25), (-0.2, -0.3)), (0.8, 0.9, 1.1))
GEOMETRIES = pytest.mark.parametrize("geometry", [ONE_MODE, TWO_MODES], ids=["one", "two modes"])


def rows(seed, count):
    """Numbers of which some have a solution, and some are not numbers at all."""
    numbers = np.random.default_rng(seed).uniform(-1.2, 1.2, (count, 3))
    numbers[[3, 7, 11], [0, 1, 2]] = math.nan, math.inf, -math.inf
    return numbers


def assert_same(geometry, count):
    """Check that both functions give the same to the last bit, in rows without a solution, too."""
    plain, compiled = TriGlide(geometry), TriGlide(geometry, compiled=True)
    for seed, name in enumerate(("inverse_batch", "forward_batch")):
        given = rows(seed, count)
        expected = getattr(plain, name)(given)
        assert 0 < np.isnan(expected[:, 0]).sum() < len(given)
        for ordered in (given, np.asfortranarray(given)):
            np.testing.assert_array_equal(getattr(compiled, name)(ordered), expected)


@GEOMETRIES
def test_same_results_to_the_last_bit(geometry):
    assert_same(geometry, 30_000)


@GEOMETRIES
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_the_loops_themselves(geometry, monkeypatch):
    """What numba compiles, run as plain Python: so this holds where there is no numba."""
    monkeypatch.setattr(batch, "numba_is_installed", lambda: True)
    monkeypatch.setattr(batch, "compiled_loop", batch.compiled_loop.__wrapped__)
    numba = SimpleNamespace(njit=lambda error_model: lambda function: function)
    monkeypatch.setitem(sys.modules, "numba", numba)
    assert_same(geometry, 1000)


def test_without_numba_the_loops_are_not_used(monkeypatch):
    monkeypatch.setattr(batch, "numba_is_installed", lambda: False)
    monkeypatch.setattr(batch, "compiled_loop", None)
    machine = TriGlide(ONE_MODE, compiled=True)
    np.testing.assert_array_equal(
        machine.inverse_batch(rows(0, 100)), TriGlide(ONE_MODE).inverse_batch(rows(0, 100))
    )
    assert machine.forward_batch([(0.6, 0.6, 0.6)]).shape == (1, 3)


def test_nothing_is_compiled_unless_asked_for(monkeypatch):
    monkeypatch.setattr(batch, "numba_is_installed", lambda: True)
    monkeypatch.setattr(batch, "compiled_loop", None)
    assert TriGlide(ONE_MODE).inverse_batch([(0.0, 0.0, 0.2)]).shape == (1, 3)
