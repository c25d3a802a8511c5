"""A stream of commanded slider heights as a drive sees it: its derivatives by differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.checks import array_of_shape, positive


@dataclass(frozen=True)
class CommandStream:
    """Commanded heights, one row a period, with their finite differences.

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
    def from_heights(cls, heights: ArrayLike, period: float) -> CommandStream:
        """Differentiate ``heights`` (shape (n, 3) [m]) that are ``period`` [s] apart.

        Raises:
            WrongShapeError: if ``heights`` has another shape.
            OutOfBoundsError: if ``period`` is not positive.
        """
        rows = array_of_shape("heights", heights, (None, 3))
        period = positive("period", period, "s")
        derivatives: list[NDArray[np.float64]] = [rows]
        for order in (1, 2, 3):
            derivative = np.zeros(rows.shape)
            derivative[order:] = np.diff(rows, n=order, axis=0) / period**order
            derivatives.append(derivative)
        return cls(period * np.arange(len(rows), dtype=np.float64), *derivatives)

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
