"""Quintics between knots, against numpy's polynomials."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from tri_glide_kinematics.motion.trajectory import quintics

RNG = np.random.default_rng(7)
KNOTS = np.array([0.0, 0.5, 0.8, 2.0])
GIVEN = RNG.normal(size=(3, len(KNOTS)))
SPANS = np.diff(KNOTS)


def pieces() -> list[Polynomial]:
    return [Polynomial(row) for row in quintics.coefficients(SPANS, *GIVEN).T]


def test_evaluation_is_that_of_the_polynomials():
    x = RNG.random(len(SPANS))
    evaluated = quintics.evaluate(quintics.coefficients(SPANS, *GIVEN), x)
    for order, values in enumerate(evaluated):
        expected = [
            (polynomial.deriv(order) if order else polynomial)(place)
            for polynomial, place in zip(pieces(), x)
        ]
        assert np.allclose(values, expected)


def test_control_points_are_the_ends_of_each_derivative_and_hold_it_between_them():
    points = quintics.derivative_control_points(SPANS, *GIVEN)
    x = np.linspace(0.0, 1.0, 501)
    first = 0
    for order in range(1, 6):
        of_order = points[first : first + 6 - order]
        first += 6 - order
        for polynomial, column in zip(pieces(), of_order.T):
            values = polynomial.deriv(order)(x)
            assert (column[0], column[-1]) == pytest.approx((values[0], values[-1]))
            slack = 1e-9 * np.abs(column).max()
            assert column.min() - slack <= values.min() <= values.max() <= column.max() + slack
    assert first == len(points)
