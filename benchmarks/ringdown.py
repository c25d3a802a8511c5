"""Modes from many simulated swings: are they where the result says, and how near?

``python -m benchmarks.ringdown`` prints the table; ``--count 40`` for a quick look.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.machine import description
from benchmarks.table import Row, print_rows
from testing.swings import NOISE_OF_ACCELEROMETER, RATE, Measuring, two_modes
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
        possible: number of recordings that would be near enough by the standard deviations, which
            are those of Cramér and Rao: the most for an unbiased method.
        deviations: errors of all numbers over their standard deviations.
        one: recordings with one mode.
        covered: of these, those whose mode is one of the two, or between two that its resolution
            does not tell apart.
        times: processor time of each [s].
    """

    both: int = 0
    exact: int = 0
    possible: float = 0.0
    deviations: list[float] = field(default_factory=list)
    one: int = 0
    covered: int = 0
    times: list[float] = field(default_factory=list)

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
            self.possible += math.prod(map(_chance, found.modes))
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
        recording = measuring.of(modes, rng)
        before = time.process_time()
        found = find_modes(recording)
        result.times.append(time.process_time() - before)
        result.add(modes, found)
    return result


def main() -> None:
    """Measure and print the table."""
    options = numbers(
        __doc__, count=(200, "recordings of each kind"), seed=(1, "of modes and noise")
    )
    print(description(), flush=True)
    print_rows("ring-down", rows(options.count, options.seed))


def rows(count: int, seed: int) -> Iterator[Row]:
    """Yield one row after the other."""
    for axes in (3, 1):
        for name, measuring in (("1 µm", POSITIONS), ("accelerometer, 30 dB", ACCELERATIONS)):
            for ratios in (WIDE, NEAR):
                of_axes = Measuring(measuring.quantity, axes=axes, noise=measuring.noise)
                result = tally(of_axes, ratios, count, seed)
                what = f"{name}, axes: {axes}, ratio {ratios[0]:g} to {ratios[1]:g}"
                yield from _rows_of(what, result, count)


def _rows_of(what: str, result: Tally, count: int) -> Iterator[Row]:
    exact = result.exact / count
    yield Row(
        f"{what}: both modes, frequency within 1 %, damping within 0.01",
        f"{100.0 * exact:.1f} % (both found: {100.0 * result.both / count:.1f} %)",
        f"95 %; Cramér-Rao: {100.0 * result.possible / count:.1f} %",
        exact >= 0.95,
    )
    what = "the same: numbers inside their 95 % interval"
    yield Row.in_percent(what, result.coverage, "90 to 100 %", result.coverage >= 0.9)
    if result.one:
        yield Row(
            "the same: one mode told of two, true or within its resolution",
            f"{result.covered} of {result.one}",
            "all but 1 %",
            result.one - result.covered <= 0.01 * count,
        )
    what = f"the same: processor time for {RATE * POSITIONS.duration:.0f} samples, median"
    yield Row(what, f"{1e3 * np.median(result.times):.0f} ms")


def _ascending(modes: Sequence[Mode] | Sequence[Oscillation]) -> list[Mode | Oscillation]:
    return sorted(modes, key=lambda each: each.frequency)


def _is_exact(true: Mode | Oscillation, found: Mode | Oscillation) -> bool:
    frequency = abs(found.frequency / true.frequency - 1.0)
    return frequency <= FREQUENCY and abs(found.damping - true.damping) <= DAMPING


def _chance(found: Oscillation) -> float:
    """Return how probable it is that both numbers of a mode are near enough."""
    sizes = (
        FREQUENCY * found.frequency / found.frequency_deviation,
        DAMPING / found.damping_deviation,
    )
    return math.prod(math.erf(size / math.sqrt(2.0)) for size in sizes)


def _deviations(true: Mode | Oscillation, found: Mode | Oscillation) -> list[float]:
    assert isinstance(found, Oscillation)
    return [
        (found.frequency - true.frequency) / found.frequency_deviation,
        (found.damping - true.damping) / found.damping_deviation,
    ]


def _is_covered(true: Mode, found: Oscillation) -> bool:
    away = abs(found.frequency - true.frequency)
    return away <= math.hypot(3.0 * found.frequency_deviation, found.resolution)


if __name__ == "__main__":
    main()
