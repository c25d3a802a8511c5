"""Real roots of a trigonometric polynomial: those of the same polynomial in powers of z."""

import cmath
import math

import numpy as np
import pytest

from tri_glide_kinematics.mechanisms.f_mechanism.closure import (
    Cubic,
    derivatives,
    real_roots,
    row_roots,
)


def random_cubic(rng):
    """Coefficients of which none is far above the others."""
    real, imaginary = rng.normal(size=(2, 3)).tolist()
    return Cubic(float(rng.normal()), *(complex(x, y) for x, y in zip(real, imaginary)))


def roots_of_powers(polynomial):
    """Angles of the roots on the unit circle, by the companion matrix of z^3 times F."""
    half = [0.5 * coefficient for coefficient in polynomial[1:]]
    powers = [*reversed(half), polynomial.constant, *(number.conjugate() for number in half)]
    roots = np.roots(powers)
    return sorted(np.angle(roots[abs(abs(roots) - 1.0) < 1e-7]).tolist())


def test_every_root_is_found_once():
    rng = np.random.default_rng(1)
    for _ in range(200):
        polynomial = random_cubic(rng)
        assert real_roots(polynomial, 1e-14) == pytest.approx(roots_of_powers(polynomial), abs=1e-9)


def test_many_polynomials_have_the_roots_of_each():
    rng = np.random.default_rng(2)
    polynomials = [random_cubic(rng) for _ in range(300)]
    row, angle = row_roots(Cubic(*(np.array(part) for part in zip(*polynomials))))
    for index, polynomial in enumerate(polynomials):
        single = real_roots(polynomial, 1e-14)
        assert angle[row == index] == pytest.approx(single, abs=1e-9)


def test_polynomials_that_vanish_or_nearly_so_have_no_simple_roots():
    # Each halving of the intervals would leave twice as many.
    zero, rest = np.zeros(3), np.array([0.0, 1e-300, 0.0]) + 0j
    row, angle = row_roots(Cubic(zero, rest, 0.0 * rest, 0.0 * rest))
    assert row.tolist() == [1, 1]
    assert angle == pytest.approx([-0.5 * math.pi, 0.5 * math.pi])


@pytest.mark.parametrize("place", [-3.0, -math.pi / 2.0, 0.0, 1.0, math.pi])
def test_a_polynomial_that_touches_zero_is_left_to_whole_numbers(place):
    # 1 - cos(phi - place), which is zero at its minimum only.
    polynomial = Cubic(1.0, -complex(math.cos(place), -math.sin(place)), 0j, 0j)
    assert real_roots(polynomial, 1e-15) is None


def test_roots_that_nearly_coincide_are_left_to_whole_numbers():
    # (1 - cos(phi - place))^3, of whose six roots rounding leaves none near the unit circle.
    for place in np.linspace(-math.pi, math.pi, 50).tolist():
        z = complex(math.cos(place), -math.sin(place))
        polynomial = Cubic(2.5, -3.75 * z, 1.5 * z**2, -0.25 * z**3)
        assert real_roots(polynomial, 1e-14) is None


def test_roots_beside_half_a_turn_are_within_it():
    # sin(phi - place) (2 + cos(phi - other)), the place at half a turn but for rounding.
    for place in math.pi + np.linspace(-1e-15, 1e-15, 5):
        for other in np.linspace(-3.0, 3.0, 50):
            first, second = -2j * np.exp(-1j * place), -0.5j * np.exp(-1j * (place + other))
            constant = 0.5 * math.sin(other - place)
            polynomial = Cubic(constant, complex(first), complex(second), 0j)
            roots = real_roots(polynomial, 1e-15)
            assert len(roots) == 2
            assert all(abs(root) <= math.pi for root in roots)


def test_values_and_derivatives_are_differences_of_each_other():
    rng = np.random.default_rng(3)
    step = 1e-5
    for _ in range(20):
        polynomial, angle = random_cubic(rng), float(rng.uniform(-3.0, 3.0))
        angles = (angle + offset for offset in (-step, 0.0, step))
        before, at, after = (derivatives(polynomial, cmath.rect(1.0, place)) for place in angles)
        assert (after[0] - before[0]) / (2.0 * step) == pytest.approx(at[1], abs=1e-7)
        assert (after[1] - before[1]) / (2.0 * step) == pytest.approx(at[2], abs=1e-7)
