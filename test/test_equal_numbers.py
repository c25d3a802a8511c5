"""Choices between equal numbers are the same whatever the last bits are."""

import math

import numpy as np
import pytest
from strategies import nudged

from tri_glide_kinematics.equal_numbers import (
    directions,
    first_largest,
    first_smallest,
    within_turn,
    wrapped,
)


def test_of_equal_numbers_the_first_is_chosen():
    rng = np.random.default_rng(1)
    for values, largest, smallest in (
        ((1.0, 3.0, 3.0, 2.0), 1, 0),
        ((-1.0, -3.0, -3.0, -1.0), 0, 1),
        ((1.0, 0.0, 0.0, -0.5), 0, 3),
        ((1.0, 0.0, 0.0, 0.5), 0, 1),
    ):
        for _ in range(100):
            array = nudged(rng, values)
            assert (first_largest(array), first_smallest(array)) == (largest, smallest)


def test_numbers_that_differ_are_told_apart():
    assert first_largest([[1.0, 1.0 + 1e-6], [1.0 + 2e-6, 0.0]]) == 2
    assert first_smallest([1.0, -math.inf, 2.0]) == 1
    assert first_largest([1.0, math.inf, math.inf]) == 1


@pytest.mark.parametrize("angle", [math.pi, -math.pi, 3.0 * math.pi, -5.0 * math.pi])
def test_half_a_turn_is_positive(angle):
    rng = np.random.default_rng(2)
    for value in nudged(rng, [angle] * 100).tolist():
        assert wrapped(value) == pytest.approx(math.pi, abs=1e-14)
        assert directions(np.exp(1j * np.array([value])))[0] == pytest.approx(math.pi, abs=1e-14)


def test_a_full_turn_is_zero():
    rng = np.random.default_rng(3)
    for turns in (-2.0, 0.0, 1.0, 3.0):
        angles = math.tau * turns + nudged(rng, [math.tau] * 100) - math.tau
        assert np.abs(within_turn(angles)).max() < 1e-14


def test_other_angles_keep_their_direction():
    angles = np.random.default_rng(4).uniform(-20.0, 20.0, 1000)
    for found in (
        np.array([wrapped(angle) for angle in angles.tolist()]),
        directions(np.exp(1j * angles)),
        within_turn(angles),
    ):
        np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * angles), atol=1e-14)
    assert within_turn(angles).min() >= 0.0
    assert math.isnan(wrapped(math.nan))
