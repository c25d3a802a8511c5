"""What is chosen for each rounding."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.vectors import FloatArray


class Widths(NamedTuple):
    """Widths and shapes of all roundings.

    Attributes:
        half_widths: of the part that does not swing out. Shape (m,) [m].
        deviations: bound of the deviation of the path at each joint. Shape (m,) [m].
        single: whether a rounding overlapped no other when it was made. Shape (m,).
        tapers: how much of that part tapers off, from 0 to 1 (``tapering``). Shape (m,).
        swings: how far the rounding swings out to the other side, by its height; 0 if it does not
            (``swinging``). Shape (m,).
        swing_widths: half width of the part that does; 0 where there is none. Shape (m,) [m].
    """

    half_widths: FloatArray
    deviations: FloatArray
    single: NDArray[np.bool_]
    tapers: FloatArray
    swings: FloatArray
    swing_widths: FloatArray

    @classmethod
    def of_hats(
        cls, half_widths: FloatArray, deviations: FloatArray, single: NDArray[np.bool_]
    ) -> Widths:
        """Return widths of roundings that neither taper off nor swing out."""
        nothing = np.zeros(len(half_widths))
        return cls(half_widths, deviations, single, nothing, nothing, nothing)

    @property
    def reaches(self) -> FloatArray:
        """Half widths of whole roundings. Shape (m,) [m]."""
        return np.asarray(np.maximum(self.half_widths, self.swing_widths))

    def part(self, some: slice) -> Widths:
        """Return ``some`` of them."""
        return Widths(*(getattr(self, name)[some] for name in self._fields))

    def followed_by(self, others: Widths) -> Widths:
        """Return these and then ``others``."""
        both = ((getattr(self, name), getattr(others, name)) for name in self._fields)
        return Widths(*(np.concatenate(pair) for pair in both))


NONE_KEPT = Widths.of_hats(np.zeros(0), np.zeros(0), np.zeros(0, dtype=bool))
