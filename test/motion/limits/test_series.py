"""Taylor series against finite differences, and their bounds against many instants."""

import math

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE
from timed_paths import random_path

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import MotionKind, plan_move, time_path
from tri_glide_kinematics.motion.limits.series import (
    EDGES_AT_ONCE,
    divided,
    dividing,
    heights_of,
    moved,
    polynomial,
    position_of,
    product,
)
from tri_glide_kinematics.motion.trajectory import Trajectory

START, END = (-0.06, 0.02, 0.22), (0.08, 0.05, 0.34)


def motions() -> dict[str, Trajectory]:
    """Return a motion of each kind."""
    line = plan_move(WORKSPACE, LIMITS, START, END, kind=MotionKind.LINEAR)
    return {
        "slider move": plan_move(WORKSPACE, LIMITS, START, END),
        "line": line,
        "path": time_path(random_path(5, most=4), WORKSPACE, LIMITS),
    }


@pytest.fixture(scope="module", params=["slider move", "line", "path"])
def motion(request) -> Trajectory:
    return motions()[request.param]


def cells(motion: Trajectory, count: int = 60, longest: float = 0.004):
    """Return middles and halves of cells, each of which lies between two knots."""
    rng = np.random.default_rng(3)
    knots = motion.knots()
    gaps = np.diff(knots)
    chosen = rng.choice(np.flatnonzero(gaps > 1e-4), count)
    half = 0.5 * np.minimum(gaps[chosen], longest)
    middles = knots[chosen] + half + rng.uniform(size=count) * (gaps[chosen] - 2.0 * half)
    return middles, half


def value(coefficients, offset):
    """Return the value of a Taylor polynomial."""
    return sum(c * offset**n for n, c in enumerate(coefficients))


def test_moved_is_the_same_polynomial():
    coefficients = np.random.default_rng(1).normal(size=(6, 2, 5))
    times = np.linspace(-1.0, 1.0, 5)
    other = moved(coefficients, times)
    np.testing.assert_allclose(value(other, 0.3), value(coefficients, times + 0.3), rtol=1e-12)


def test_products_are_those_of_polynomials():
    a, b = np.zeros((2, 6, 1, 1))
    a[:3, 0, 0], b[:4, 0, 0] = (1.0, 2.0, 3.0), (4.0, -1.0, 0.5, 2.0)
    expected = np.polynomial.polynomial.polymul(a[:3, 0, 0], b[:4, 0, 0])
    np.testing.assert_allclose(product(a, b)[:, 0, 0], expected, rtol=0.0, atol=1e-15)


def test_bounds_of_a_polynomial_hold_everywhere_in_the_cell():
    coefficients = np.random.default_rng(2).normal(size=(6, 1, 1))
    series = polynomial(coefficients, np.array([0.5]))
    for offset in np.linspace(-0.5, 0.5, 101):
        other = np.abs(moved(coefficients, np.array([offset])))
        assert (other <= series.bounds * (1.0 + 1e-12)).all()
    # By the binomial theorem, about the end of the cell.
    sizes = np.abs(coefficients[:, 0, 0])
    for order, bound in enumerate(series.bounds[:, 0, 0]):
        terms = [math.comb(n, order) * 0.5 ** (n - order) * sizes[n] for n in range(order, 6)]
        assert bound == pytest.approx(sum(terms), rel=1e-14)


def test_they_are_the_series_of_the_setpoints(motion):
    middles, half = cells(motion)
    series = motion.platform_series(MACHINE, middles, half)
    for offset in np.linspace(-1.0, 1.0, 5):
        sampled = motion.sample(middles + offset * half)
        places = MACHINE.forward_batch(sampled.heights).T
        # What is left out is the sixth order.
        np.testing.assert_allclose(value(series.values, offset * half), places, atol=1e-9)


def test_heights_and_their_rates_come_back(motion):
    middles, half = cells(motion)
    heights = heights_of(MACHINE.geometry, motion.platform_series(MACHINE, middles, half), half)
    sampled = motion.sample(middles)
    for order, expected in enumerate(sampled[1:]):
        found = math.factorial(order) * heights.values[order].T
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_bounds_hold_at_other_instants_of_the_cell(motion):
    middles, half = cells(motion)
    series = motion.platform_series(MACHINE, middles, half)
    heights = heights_of(MACHINE.geometry, series, half)
    for offset in (-0.999, -0.5, 0.0, 0.7, 0.999):
        nothing = np.zeros_like(half)
        there = motion.platform_series(MACHINE, middles + offset * half, nothing)
        seen = heights_of(MACHINE.geometry, there, nothing)
        for wide, narrow in ((series, there), (heights, seen)):
            least = np.abs(narrow.values) * (1.0 - 1e-9) - 1e-12
            # The highest orders are small differences of large numbers.
            assert (least[:4] <= wide.bounds[:4]).all()
            assert (least[4:] - 1e-6 <= wide.bounds[4:]).all()


def test_bounds_are_near_the_values_where_cells_are_short(motion):
    middles, _ = cells(motion)
    half = np.full_like(middles, 1e-6)
    series = motion.platform_series(MACHINE, middles, half)
    heights = heights_of(MACHINE.geometry, series, half)
    fastest = np.abs(heights.values[1]).max()
    assert (
        np.median(heights.bounds[1].max(axis=0) / (np.abs(heights.values[1]).max(axis=0) + 1e-3))
        < 6.0
    )
    assert np.isfinite(heights.bounds).all()
    assert fastest > 0.1


def test_positions_and_heights_are_opposites():
    rng = np.random.default_rng(4)
    half = np.full(20, 1e-3)
    coefficients = rng.normal(size=(6, 3, 20))
    coefficients[0] = rng.uniform((-0.1, -0.1, 0.2), (0.1, 0.1, 0.35), (20, 3)).T
    position = polynomial(coefficients, half)
    there = position_of(MACHINE, heights_of(MACHINE.geometry, position, half), half)
    np.testing.assert_allclose(there.values, position.values, rtol=1e-9, atol=1e-9)
    assert (there.bounds >= np.abs(there.values)).all()


def test_where_no_pose_is_there_is_no_bound():
    half = np.array([0.2])
    coefficients = np.zeros((2, 3, 1))
    coefficients[0, :, 0] = START
    coefficients[1, 0, 0] = 10.0
    heights = heights_of(MACHINE.geometry, polynomial(coefficients, half), half)
    assert np.isnan(heights.bounds[1:]).any()


def test_many_edges_are_divided_in_pieces():
    edges = np.cumsum(10.0 ** np.random.default_rng(2).uniform(-4.0, 0.0, 3 * EDGES_AT_ONCE))
    assert sum(1 for _ in dividing(edges)) == 2
    for found, expected in zip(at_once(dividing(edges)), divided(edges)):
        np.testing.assert_array_equal(found, expected)
    assert not any(map(len, at_once(dividing(edges[:1]))))
