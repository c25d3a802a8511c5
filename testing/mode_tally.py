"""Modes from many simulated swings: are they where the result says, and how near?"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from testing.swings import NOISE_OF_ACCELEROMETER, Measuring, two_modes
from tri_glide_kinematics.calibration.ringdown import Oscillation, Quantity, RingDown, find_modes
from tri_glide_kinematics.motion.shaping import Mode

# Largest errors: of a frequency as a part of it, of a damping.
FREQUENCY, DAMPING = 0.01, 0.01
# Two-sided, of a normal distribution.
INTERVAL = 1.96

WIDE, NEAR = (1.2, 4.0), (1.0, 1.7)
POSITIONS = Measuring()
ACCELERATIONS = Measuring(Quantity.ACCELERATION, noise=NOISE_OF_ACCELEROMETER)


@dataclass
class Tally:
    """What was found in many recordings of two modes.

    Attributes:
        both: recordings in which two modes were found.
        exact: of these, those whose four numbers are near enough.
        deviations: errors of all numbers over their standard deviations.
        one: recordings with one mode.
        covered: of these, those whose mode is one of the two, or between two that its resolution
            does not tell apart.
    """

    both: int = 0
    exact: int = 0
    deviations: list[float] = field(default_factory=list)
    one: int = 0
    covered: int = 0

    @property
    def coverage(self) -> float:
        """Part of the numbers that lie inside their 95 % interval."""
        return float(np.mean(np.abs(self.deviations) <= INTERVAL))

    def add(self, modes: Sequence[Mode], found: RingDown) -> None:
        """Compare what was ``found`` with the true ``modes``."""
        if len(found.modes) == len(modes):
            self.both += 1
            pairs = list(zip(_ascending(modes), _ascending(found.modes)))
            self.exact += all(_is_exact(*pair) for pair in pairs)
            for pair in pairs:
                self.deviations += _deviations(*pair)
        elif found.modes:
            self.one += 1
            self.covered += any(_is_covered(mode, found.modes[0]) for mode in modes)


def tally(measuring: Measuring, ratios: tuple[float, float], count: int, seed: int) -> Tally:
    """Return what is found in ``count`` recordings of two modes at random."""
    rng = np.random.default_rng(seed)
    result = Tally()
    for _ in range(count):
        modes = two_modes(rng, ratios)
        result.add(modes, find_modes(measuring.of(modes, rng)))
    return result


def _ascending(modes: Sequence[Mode] | Sequence[Oscillation]) -> list[Mode | Oscillation]:
    return sorted(modes, key=lambda each: each.frequency)


def _is_exact(true: Mode | Oscillation, found: Mode | Oscillation) -> bool:
    frequency = abs(found.frequency / true.frequency - 1.0)
    return frequency <= FREQUENCY and abs(found.damping - true.damping) <= DAMPING


def _deviations(true: Mode | Oscillation, found: Mode | Oscillation) -> list[float]:
    assert isinstance(found, Oscillation)
    return [
        (found.frequency - true.frequency) / found.frequency_deviation,
        (found.damping - true.damping) / found.damping_deviation,
    ]


def _is_covered(true: Mode, found: Oscillation) -> bool:
    away = abs(found.frequency - true.frequency)
    return away <= math.hypot(3.0 * found.frequency_deviation, found.resolution)
