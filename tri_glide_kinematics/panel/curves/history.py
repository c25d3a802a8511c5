"""The last seconds of the sliders' motion in bins of equal length, whatever the rate of samples."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tri_glide_kinematics.vectors import FloatArray

SPAN = 10.0  # s
BIN = 0.05  # s
SLIDERS = 3
HEIGHTS, VELOCITIES, ACCELERATIONS = QUANTITIES = range(3)
LATEST = 1.0  # s that a sample may come after newer ones


class History:
    """A ring of bins.

    A bin holds the newest height, and of velocities and accelerations that which is farthest from
    zero: what comes near a limit for a moment is never lost. A bin without a sample holds NaN.
    """

    def __init__(self) -> None:
        """Start without samples."""
        self._count = round(SPAN / BIN)
        self._bins = np.full((len(QUANTITIES), SLIDERS, self._count), math.nan)
        self._newest: int | None = None
        self.ages = (np.arange(self._count) - (self._count - 1)) * BIN

    def add(
        self,
        time: float,
        heights: Sequence[float],
        velocities: Sequence[float],
        accelerations: Sequence[float],
    ) -> None:
        """Take in a sample, a little late at most; a clock that goes back starts the history anew.

        Args:
            time: of a steady clock [s].
            heights: Shape (3,) [m].
            velocities: Shape (3,) [m/s].
            accelerations: Shape (3,) [m/s^2].
        """
        self.advance(time)
        place = math.floor(time / BIN) % self._count
        self._bins[HEIGHTS, :, place] = heights
        for quantity, new in ((VELOCITIES, velocities), (ACCELERATIONS, accelerations)):
            bins = self._bins[quantity, :, place]
            # A bin without a sample, which is NaN, keeps nothing.
            keep = np.abs(bins) >= np.abs(new)
            self._bins[quantity, :, place] = np.where(keep, bins, new)

    def advance(self, time: float) -> None:
        """Let the bins up to ``time`` [s] be the newest ones, empty if nothing came in them."""
        bin_now = math.floor(time / BIN)
        if self._newest is None or bin_now < self._newest - LATEST / BIN:
            self._bins[:] = math.nan
        elif bin_now < self._newest:
            return
        else:
            passed = min(bin_now - self._newest, self._count)
            self._bins[:, :, (bin_now - np.arange(passed)) % self._count] = math.nan
        self._newest = bin_now

    def values(self, quantity: int) -> FloatArray:
        """Return one quantity of all sliders, oldest first. Shape (3, n)."""
        if self._newest is None:
            return self._bins[quantity].copy()
        return np.roll(self._bins[quantity], -(self._newest + 1), axis=1)
