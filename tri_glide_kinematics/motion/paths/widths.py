"""What is chosen for each rounding."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.vectors import FloatArray


class Widths(NamedTuple):
    """Widths and shapes of all roundings.

    Attributes:
        half_widths: Shape (m,) [m].
        deviations: bound of the deviation of the path at each joint. Shape (m,) [m].
        single: whether a rounding overlapped no other when it was made. Shape (m,).
        tapers: how much it tapers off, from 0 to 1 (``tapering``). Shape (m,).
    """

    half_widths: FloatArray
    deviations: FloatArray
    single: NDArray[np.bool_]
    tapers: FloatArray

    def part(self, some: slice) -> Widths:
        """Return ``some`` of them."""
        return Widths(
            self.half_widths[some], self.deviations[some], self.single[some], self.tapers[some]
        )

    def followed_by(self, others: Widths) -> Widths:
        """Return these and then ``others``."""
        return Widths(
            np.concatenate((self.half_widths, others.half_widths)),
            np.concatenate((self.deviations, others.deviations)),
            np.concatenate((self.single, others.single)),
            np.concatenate((self.tapers, others.tapers)),
        )


NONE_KEPT = Widths(np.zeros(0), np.zeros(0), np.zeros(0, dtype=bool), np.zeros(0))
