"""The fit of damped oscillations: its derivatives, what it finds, and how certain it says it is."""

import math

import numpy as np
import pytest

from tri_glide_kinematics.calibration.ringdown.decay import (
    Samples,
    fitted,
    pencils,
    splits,
    strongest,
)

POLES = np.array([-4.0 + 90.0j, -9.0 + 140.0j])
AMPLITUDES = np.array([[1.0, 0.3j], [0.2 - 0.4j, 0.8]])
NOISE = np.array([1e-3, 4e-3])


def samples(rng: np.random.Generator, noise: np.ndarray = NOISE) -> Samples:
    """Two axes at uneven times, with a drift."""
    times = np.sort(np.concatenate(([0.0], rng.uniform(0.0, 1.0, 499))))
    values = (np.exp(np.multiply.outer(times, POLES)) @ AMPLITUDES).real
    drift = np.multiply.outer(times**2 - 0.4, (2.0, -1.0))
    return Samples(times, values + drift + noise * rng.standard_normal(values.shape))


def test_without_noise_the_poles_are_exact():
    rng = np.random.default_rng(1)
    fit = fitted(samples(rng, np.zeros(2)), POLES * 1.05, np.ones(2))
    assert fit.poles == pytest.approx(POLES, rel=1e-9)
    assert fit.amplitudes == pytest.approx(AMPLITUDES, abs=1e-9)


def test_the_slopes_are_those_of_the_residuals():
    rng = np.random.default_rng(2)
    given = samples(rng, np.zeros(2))
    fit = fitted(given, POLES, np.ones(2), steps=0)
    step = 1e-4
    for place in range(2):
        for column, change in ((place, -step), (2 + place, 1j * step)):
            moved = POLES + change * np.eye(2)[place]
            then = fitted(given, moved, np.ones(2), steps=0)
            # Without noise the residuals are zero, so the derivative of Kaufman is exact.
            slope = -((then.residuals - fit.residuals) / step / fit.noise).ravel()
            assert slope == pytest.approx(
                fit.slopes[:, column], abs=2e-3 * np.abs(fit.slopes[:, column]).max()
            )


def test_errors_are_as_large_as_the_covariance_says():
    """Of 100 fits, the squared error in units of the covariance is as chi-squared with 4."""
    rng = np.random.default_rng(3)
    sizes = []
    for _ in range(100):
        given = samples(rng)
        fit = fitted(given, POLES, NOISE)
        error = np.concatenate((POLES.real - fit.poles.real, fit.poles.imag - POLES.imag))
        sizes.append(float(error @ np.linalg.solve(fit.covariance, error)))
    assert np.mean(sizes) == pytest.approx(4.0, abs=4.0 * math.sqrt(8.0 / 100.0))


def test_the_noise_of_each_axis_is_found():
    rng = np.random.default_rng(4)
    assert fitted(samples(rng), POLES, np.ones(2)).noise == pytest.approx(NOISE, rel=0.15)


def test_starts_lie_near_the_poles():
    rng = np.random.default_rng(5)
    given = samples(rng)
    flat = Samples(given.times, (np.exp(np.multiply.outer(given.times, POLES)) @ AMPLITUDES).real)
    [first] = strongest(flat)
    assert min(abs(first.imag - POLES.imag)) < 5.0
    best = min(
        pencils(flat, 2), key=lambda poles: np.abs(np.sort_complex(poles.imag) - POLES.imag).max()
    )
    assert np.sort(best.imag) == pytest.approx(POLES.imag, rel=0.05)


def test_splits_have_one_pole_more():
    starts = list(splits(POLES))
    assert starts
    assert {len(start) for start in starts} == {3}
