"""A stream of commanded slider heights as a drive sees it: its derivatives by differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.checks import array_of_shape, positive


@dataclass(frozen=True)
class CommandStream:
    """Commanded heights, one row after each period, with their finite differences.

    Row k of ``velocities`` is the mean over the period that ends at row k of ``heights``, and
    likewise further down; the first rows, which have too few predecessors, are zero.

    Attributes:
        times: Shape (n,) [s], from zero.
        heights: Shape (n, 3) [m].
        velocities: Shape (n, 3) [m/s].
        accelerations: Shape (n, 3) [m/s^2].
        jerks: Shape (n, 3) [m/s^3].
    """

    times: NDArray[np.float64]
    heights: NDArray[np.float64]
    velocities: NDArray[np.float64]
    accelerations: NDArray[np.float64]
    jerks: NDArray[np.float64]

    @classmethod
    def from_heights(cls, heights: ArrayLike, period: ArrayLike) -> CommandStream:
        """Differentiate ``heights`` that are a ``period`` apart.

        A difference of order k is k! times the divided difference, so whatever the periods are it
        is a mean of the derivative of that order: it keeps each limit that the derivative keeps.

        Args:
            heights: Shape (n, 3) [m].
            period: between two rows; or before each row, where the first is not used: shape (n,)
                [s].

        Raises:
            WrongShapeError: if ``heights`` or ``period`` has another shape.
            OutOfBoundsError: if a ``period`` is not positive.
        """
        rows = array_of_shape("heights", heights, (None, 3))
        count = len(rows)
        if np.ndim(period) == 0:
            periods = np.full(count, positive("period", float(np.asarray(period)), "s"))
            times = periods * np.arange(count, dtype=np.float64)
        else:
            periods = array_of_shape("period", period, (count,))
            if count > 1:
                positive("period", periods[1:].min(), "s")
            times = np.asarray(np.cumsum(periods) - periods[:1], dtype=np.float64)
        derivatives: list[NDArray[np.float64]] = [rows]
        spans = np.zeros(count)
        for order in (1, 2, 3):
            # Before row k lie the last ``order`` periods.
            spans = periods[order:] + spans[:-1] if order > 1 else periods[1:]
            derivative = np.zeros(rows.shape)
            change = np.diff(derivatives[-1][order - 1 :], axis=0)
            derivative[order:] = order * change / spans[:, np.newaxis]
            derivatives.append(derivative)
        return cls(times, *derivatives)

    def part(self, first: int, end: int) -> CommandStream:
        """Return the rows from ``first`` up to but not including ``end``."""
        rows = slice(first, end)
        return CommandStream(
            self.times[rows],
            self.heights[rows],
            self.velocities[rows],
            self.accelerations[rows],
            self.jerks[rows],
        )
