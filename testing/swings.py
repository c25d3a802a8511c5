"""Decaying swings of known modes, as an encoder or an accelerometer would measure them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.calibration.ringdown import Quantity, Recording
from tri_glide_kinematics.motion.shaping import Mode
from tri_glide_kinematics.vectors import FloatArray

RATE = 500.0  # Hz
NOISE = 1e-6  # m
# What moves at the default limits leave behind [m].
SWINGS = (2e-4, 1.5e-3)
FREQUENCIES = (8.0, 60.0)  # Hz
DAMPINGS = (0.005, 0.15)
# Standard deviation of the noise as part of the largest acceleration of the swing: 30 dB.
NOISE_OF_ACCELEROMETER = 10.0**-1.5
# Of samples that are missing.
MISSING = 0.01


def two_modes(rng: np.random.Generator, ratios: tuple[float, float]) -> tuple[Mode, Mode]:
    """Return two modes at random, the ratio of their frequencies within ``ratios``."""
    least, most = FREQUENCIES
    ratio = rng.uniform(*ratios)
    first = rng.uniform(least, most / ratio)
    dampings = rng.uniform(*DAMPINGS, 2)
    return Mode(first, dampings[0]), Mode(ratio * first, dampings[1])


@dataclass(frozen=True)
class Measuring:
    """How a swing is measured.

    Attributes:
        quantity: what is measured.
        axes: 1 to 3.
        duration: of the recording [s].
        rate: of the samples [Hz].
        noise: standard deviation; for accelerations, as part of the largest one [m or 1].
        missing: part of the samples that is missing.
        uneven: standard deviation of the times, as part of the interval; they are known exactly.
        has_drift: whether offset, slope and a slow curve are added.
    """

    quantity: Quantity = Quantity.POSITION
    axes: int = 3
    duration: float = 2.0
    rate: float = RATE
    noise: float = NOISE
    missing: float = MISSING
    uneven: float = 0.0
    has_drift: bool = True

    def of(self, modes: Sequence[Mode], rng: np.random.Generator) -> Recording:
        """Return a recording of ``modes`` that swing along random directions."""
        count = int(self.duration * self.rate)
        times = np.arange(count) + self.uneven * np.clip(rng.standard_normal(count), -4.0, 4.0)
        times = np.sort(times[rng.random(count) >= self.missing]) / self.rate
        values = sum(
            (self._swing(mode, times, rng) for mode in modes), np.zeros((len(times), self.axes))
        )
        size = float(np.abs(values).max(initial=0.0)) or 1.0
        is_position = self.quantity is Quantity.POSITION
        values += (self.noise if is_position else self.noise * size) * rng.standard_normal(
            values.shape
        )
        if self.has_drift:
            slow = np.vander(times / self.duration, 3) @ rng.normal(0.0, size, (3, self.axes))
            values += slow
        return Recording(times, values, self.quantity)

    def _swing(self, mode: Mode, times: FloatArray, rng: np.random.Generator) -> FloatArray:
        direction = rng.standard_normal(self.axes)
        direction /= np.linalg.norm(direction)
        # Accelerations of two modes are as large as each other, whatever their frequencies are.
        amplitude = rng.uniform(*SWINGS)
        phase = rng.uniform(-math.pi, math.pi)
        angle = math.tau * times / mode.period + phase
        return np.multiply.outer(amplitude * np.exp(-mode.decay * times) * np.cos(angle), direction)


def strongest_frequency(times: FloatArray, values: FloatArray) -> float:
    """Return the frequency of the highest peak of a spectrum [Hz].

    Args:
        times: of the samples, evenly spaced or not. Shape (n,) [s].
        values: NaN where there is no sample. Shape (n,).
    """
    known = np.isfinite(values)
    frequencies = np.arange(1.0, 100.0, 0.05)
    waves = np.exp(-1j * math.tau * np.outer(frequencies, times[known]))
    return float(frequencies[np.abs(waves @ values[known]).argmax()])
