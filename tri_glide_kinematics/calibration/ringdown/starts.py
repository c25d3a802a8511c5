"""Poles near those of a swing, from which a fit can start.

Both ways take samples at equal times, which are interpolated; the fit itself takes those measured.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tri_glide_kinematics.calibration.ringdown.decay import ComplexArray, Samples
from tri_glide_kinematics.vectors import FloatArray

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
