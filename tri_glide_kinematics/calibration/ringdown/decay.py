r"""Damped oscillations on a slow drift, fitted to samples by variable projection.

All axes swing with the same poles $s_k = -\sigma_k + j\omega_k$, each by an amplitude of its own:

$$y_a(t) = \sum_k \operatorname{Re}\big(A_{ka} e^{s_k t}\big) + \sum_{i=0}^{3} d_{ia} P_i(t).$$

Amplitudes and drift are linear, so for each choice of poles they follow from a linear problem, and
only the poles are searched (Golub and Pereyra 1973, with the derivative of Kaufman 1975). At the
end, the Gram matrix of that derivative is the Fisher information of the poles with amplitudes and
drift unknown. Its inverse is the Cramér-Rao bound, which the fit reaches where the noise is white.

The search starts from poles near those of the swing. The two ways to find some without a fit take
samples at equal times, which are interpolated; the fit itself takes those measured.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from tri_glide_kinematics.vectors import FloatArray

ComplexArray = NDArray[np.complex128]

# Of the polynomial that a sensor may drift along during a recording.
DRIFT_DEGREE = 3

# Of a fit; it ends by the bound below before, if it converges.
MOST_STEPS = 60

# A step that would improve the sum of squares, in variances of the noise, by less is the last.
LEAST_GAIN = 1e-6

# Columns whose part that is new is less, as part of their length, are left to a slower method.
LEAST_PIVOT = 1e-5

# No noise is below this part of the swing: rounding errors.
LEAST_NOISE = 1e-12

# A pole may grow by exp(this) over all of the samples, so that a steady tone has room about it.
MOST_GROWTH = 2.0

# Of the critical one, nearly: there the two poles of an oscillation meet.
MOST_DAMPING = 0.97


@dataclass(frozen=True, eq=False)
class Samples:
    """What is fitted.

    Attributes:
        times: ascending, from 0 on. Shape (n,) [s].
        values: of each axis. Shape (n, axes), in any unit.
    """

    times: FloatArray
    values: FloatArray

    @property
    def duration(self) -> float:
        """From the first sample to the last one [s]."""
        return float(self.times[-1])

    @cached_property
    def interval(self) -> float:
        """Time between two samples, the median [s]."""
        return float(np.median(np.diff(self.times)))

    @cached_property
    def drift(self) -> FloatArray:
        """What may drift: polynomials. Shape (n, 4)."""
        return np.asarray(legvander(2.0 * self.times / self.duration - 1.0, DRIFT_DEGREE))


@dataclass(frozen=True, eq=False)
class DecayFit:
    """The best fit for a number of poles, here k.

    Attributes:
        poles: Shape (k,) [1/s].
        amplitudes: complex, at the first sample. Shape (k, axes).
        residuals: Shape (n, axes).
        noise: standard deviation of each axis, of the residuals. Shape (axes,).
        slopes: derivatives of the fit by decay rates, then by angular frequencies, without the part
            that amplitudes and drift can take up; in units of the noise. Shape (n axes, 2 k).
        basis: orthonormal, of all that is linear. Shape (n, 2 k + 4).
    """

    poles: ComplexArray
    amplitudes: ComplexArray
    residuals: FloatArray
    noise: FloatArray
    slopes: FloatArray
    basis: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the decay rates, then the angular frequencies; infinite if unknown.

        Shape (2 k, 2 k) [1/s^2].
        """
        size = self.slopes.shape[1]
        scale = np.linalg.norm(self.slopes, axis=0)
        if not np.all(scale > 0.0):
            return np.full((size, size), np.inf)
        scaled = self.slopes / scale
        information = scaled.T @ scaled
        if np.linalg.cond(information) > 1e12:
            return np.full((size, size), np.inf)
        return np.asarray(np.linalg.inv(information) / np.multiply.outer(scale, scale))

    @property
    def sums_of_squares(self) -> FloatArray:
        """Of the residuals of each axis. Shape (axes,)."""
        return np.asarray(np.square(self.residuals).sum(axis=0))


class _Projection(NamedTuple):
    """The linear part for given poles."""

    oscillations: ComplexArray
    basis: FloatArray
    amplitudes: ComplexArray
    residuals: FloatArray


def fitted(
    samples: Samples, start: ComplexArray, noise: FloatArray, steps: int = MOST_STEPS
) -> DecayFit:
    """Return the fit that is found from a ``start``.

    Args:
        samples: with noise that may differ from axis to axis.
        start: poles. Shape (k,) [1/s].
        noise: of each axis, as far as it is known; only ratios count. Shape (axes,).
        steps: of the search, at most.
    """
    poles, projection = _searched(samples, start, noise, steps)
    found = _noise_of(samples, projection)
    slopes = _slopes(samples, projection, found)
    return DecayFit(
        poles, projection.amplitudes, projection.residuals, found, slopes, projection.basis
    )


def cost(samples: Samples, poles: ComplexArray, noise: FloatArray) -> float:
    """Return the sum of squares that the best amplitudes for given ``poles`` leave."""
    left = _projected(samples, _bounded(samples, poles)).residuals / noise
    return float(np.square(left).sum())


def _searched(
    samples: Samples, start: ComplexArray, noise: FloatArray, steps: int
) -> tuple[ComplexArray, _Projection]:
    """Return the poles with the least sum of squares near a start (Levenberg and Marquardt)."""
    poles = _bounded(samples, start)
    now = _projected(samples, poles)
    if not len(poles):
        return poles, now
    squares = float(np.square(now.residuals / noise).sum())
    least = (LEAST_NOISE**2) * float(np.square(samples.values / noise).sum())
    damping = 1e-3
    slopes, errors = _slopes(samples, now, noise), (now.residuals / noise).ravel()
    for _ in range(steps):
        gradient, information = slopes.T @ errors, slopes.T @ slopes
        scale = np.diag(information)
        if squares <= least or not np.all(scale > 0.0):
            break
        step = np.linalg.solve(information + damping * np.diag(scale), gradient)
        tried = _bounded(samples, poles + (-step[: len(poles)] + 1j * step[len(poles) :]))
        then = _projected(samples, tried)
        squares_then = float(np.square(then.residuals / noise).sum())
        gain = squares - squares_then
        expected = float(step @ gradient)
        if gain > 0.0:
            poles, now, squares = tried, then, squares_then
            damping = max(damping / 5.0, 1e-9)
            slopes, errors = _slopes(samples, now, noise), (now.residuals / noise).ravel()
        else:
            damping *= 6.0
        if expected < LEAST_GAIN * squares / errors.size or damping > 1e9:
            break
    return poles, now


def _projected(samples: Samples, poles: ComplexArray) -> _Projection:
    count = len(poles)
    oscillations = np.exp(np.multiply.outer(samples.times, poles))
    columns = np.hstack((oscillations.real, -oscillations.imag, samples.drift))
    basis, triangle = _orthonormal(columns)
    parts = basis.T @ samples.values
    linear = _solved(triangle, parts)
    amplitudes = linear[:count] + 1j * linear[count : 2 * count]
    return _Projection(oscillations, basis, amplitudes, samples.values - basis @ parts)


def _orthonormal(columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the factors Q and R of tall ``columns``.

    By two Cholesky factorizations where they are far from dependent: many times as fast, as no
    thread is asked.
    """
    triangle, basis = np.eye(columns.shape[1]), columns
    for _ in range(2):
        try:
            factor = np.linalg.cholesky(basis.T @ basis)
        except np.linalg.LinAlgError:
            return _by_reflections(columns)
        pivots = np.diag(factor) / np.linalg.norm(factor, axis=1)
        if not pivots.min() > LEAST_PIVOT:
            return _by_reflections(columns)
        basis = basis @ np.linalg.inv(factor).T
        triangle = factor.T @ triangle
    return basis, triangle


def _by_reflections(columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    basis, triangle = np.linalg.qr(columns)
    return basis, triangle


def _solved(triangle: FloatArray, parts: FloatArray) -> FloatArray:
    try:
        return np.asarray(np.linalg.solve(triangle, parts))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(triangle, parts, rcond=None)[0])


def _slopes(samples: Samples, projection: _Projection, noise: FloatArray) -> FloatArray:
    swings = projection.oscillations[:, :, None] * projection.amplitudes[None, :, :]
    by_frequency = 1j * samples.times[:, None, None] * swings
    # By the decay rate it is -t, which is j times the derivative by the angular frequency.
    parts = np.concatenate(((1j * by_frequency).real, by_frequency.real), axis=1)
    count, unknowns, axes = parts.shape
    flat = parts.reshape(count, unknowns * axes)
    flat = flat - projection.basis @ (projection.basis.T @ flat)
    scaled = flat.reshape(count, unknowns, axes) / noise
    return np.asarray(scaled.transpose(0, 2, 1).reshape(count * axes, unknowns))


def _noise_of(samples: Samples, projection: _Projection) -> FloatArray:
    """Return the standard deviation of the noise of each axis; the poles count as unknowns, too."""
    count, axes = samples.values.shape
    unknowns = projection.basis.shape[1] + 2.0 * projection.amplitudes.shape[0] / axes
    freedom = max(count - unknowns, 1.0)
    size = np.sqrt(np.square(samples.values).mean())
    found = np.sqrt(np.square(projection.residuals).sum(axis=0) / freedom)
    return np.asarray(np.maximum(found, max(LEAST_NOISE * size, np.finfo(float).tiny)))


def _bounded(samples: Samples, poles: ComplexArray) -> ComplexArray:
    """Return poles with half a swing in the samples at least, two samples a swing, and a decay."""
    lowest, highest = np.pi / samples.duration, np.pi / samples.interval
    angular = np.clip(np.abs(poles.imag), lowest, highest)
    most = angular * MOST_DAMPING / np.sqrt(1.0 - MOST_DAMPING**2)
    rates = np.clip(-poles.real, -MOST_GROWTH / samples.duration, most)
    return np.asarray(-rates + 1j * angular)


# Decay rates that the filter tries, from less than one over the duration to a fast one.
RATES = 14
FASTEST_DAMPING = 0.5

# Columns of the Hankel matrix, and their reach as parts of the duration.
COLUMNS = 36
REACHES = (0.4, 0.15, 0.05)

# Poles that noise and drift may take in the matrix pencil besides those that are looked for.
SPARE = (0, 2, 4)

# Parts of its frequency, or of its decay rate, by which a pole is taken apart in two.
SPLITS = (0.02, 0.08, 0.25)


def strongest(samples: Samples) -> ComplexArray:
    """Return the pole of the damped oscillation that explains most of the samples (matched filter).

    Shape (1,) [1/s].
    """
    times, values = _uniform(samples)
    count, interval = len(times), float(times[1])
    size = 2 ** int(np.ceil(np.log2(2 * count)))
    angular = 2.0 * np.pi * np.fft.rfftfreq(size, interval)
    possible = (angular >= np.pi / times[-1]) & (angular <= np.pi / interval)
    highest = np.pi / interval
    best, pole = -1.0, 1j * highest
    for rate in [0.0, *np.geomspace(0.5 / times[-1], FASTEST_DAMPING * highest, RATES)]:
        fade = np.exp(-rate * times)
        spectrum = np.fft.rfft(values * fade[:, None], size, axis=0)
        power = np.square(np.abs(spectrum)).sum(axis=1) / np.square(fade).sum()
        place = int(np.argmax(np.where(possible, power, -1.0)))
        if power[place] > best:
            best, pole = float(power[place]), -rate + 1j * angular[place]
    return np.array([pole])


def pencils(samples: Samples, count: int) -> Iterator[ComplexArray]:
    """Yield starts with ``count`` poles each, by the matrix pencil (Hua and Sarkar 1990).

    The lag between columns is several samples, the pencil's own shift is one of them, so that no
    frequency is ambiguous and the matrix stays small.
    """
    times, values = _uniform(samples)
    interval = float(times[1])
    for reach in REACHES:
        lag = max(int(reach * len(times) / COLUMNS), 1)
        columns = min(COLUMNS, (len(times) - 1) // (2 * lag))
        rows = len(times) - 1 - (columns - 1) * lag
        if columns < 2 * count or rows < columns:
            continue
        inner, shifted = np.zeros((columns, columns)), np.zeros((columns, columns))
        for axis in values.T:
            first, second = (_hankel(axis[by:], rows, columns, lag) for by in (0, 1))
            inner += first.T @ first
            shifted += first.T @ second
        # Squares of the singular values, and the right singular vectors, the largest last.
        sizes, vectors = np.linalg.eigh(inner)
        for spare in SPARE:
            rank = 2 * (count + spare)
            if rank > columns or sizes[-rank] <= 1e-14 * sizes[-1]:
                break
            kept = vectors[:, -rank:]
            factors = np.linalg.eigvals(kept.T @ shifted @ kept / sizes[-rank:, None])
            factors = factors[(factors.imag > 0.0) & (np.abs(factors) > 1e-3)]
            poles = np.asarray(np.log(factors) / interval, dtype=np.complex128)
            if len(poles) >= count:
                yield _most_energetic(times, values, poles, count)


def splits(poles: ComplexArray) -> Iterator[ComplexArray]:
    """Yield starts with one pole more, as each of the ``poles`` might be two near ones."""
    for place, pole in enumerate(poles):
        others = np.delete(poles, place)
        for part in SPLITS:
            apart = part * np.abs(pole.imag)
            yield np.concatenate((others, [pole - 1j * apart, pole + 1j * apart]))
        faster, slower = 3.0 * pole.real, pole.real / 3.0
        yield np.concatenate((others, [faster + 1j * pole.imag, slower + 1j * pole.imag]))


def _uniform(samples: Samples) -> tuple[FloatArray, FloatArray]:
    times = np.linspace(0.0, samples.duration, len(samples.times))
    columns = [np.interp(times, samples.times, axis) for axis in samples.values.T]
    return times, np.column_stack(columns)


def _hankel(values: FloatArray, rows: int, columns: int, lag: int) -> FloatArray:
    return values[np.add.outer(np.arange(rows), lag * np.arange(columns))]


def _most_energetic(
    times: FloatArray, values: FloatArray, poles: ComplexArray, count: int
) -> ComplexArray:
    """Return the poles that have most of the energy of the values."""
    rates = np.maximum(-poles.real, -1.0 / times[-1])
    oscillations = np.exp(np.multiply.outer(times, -rates + 1j * poles.imag))
    columns = np.hstack((oscillations.real, -oscillations.imag))
    linear = np.linalg.lstsq(columns, values, rcond=None)[0]
    amplitudes = linear[: len(poles)] + 1j * linear[len(poles) :]
    energy = np.square(np.abs(amplitudes)).sum(axis=1) * np.square(np.abs(oscillations)).sum(axis=0)
    return np.asarray(poles[np.argsort(-energy)[:count]])
