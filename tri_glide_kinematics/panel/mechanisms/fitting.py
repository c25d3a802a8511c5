"""Brings mechanisms of any size to a good size on the drawing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.vectors import FloatArray

# A drawing is fitted anew when its largest side is below or above these parts of the good size.
TOO_SMALL, TOO_LARGE = 0.5, 1.2


@dataclass(frozen=True, eq=False)
class Fit:
    """From metres of a mechanism to metres of the scene.

    Attributes:
        scale: of the drawing.
        centre: of the mechanism, which lies in the centre of the drawing. Shape (2,) [m].
    """

    scale: float
    centre: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return points of the drawing, on its plane. Shape (..., 2) to (..., 3) [m]."""
        flat = (points - self.centre) * self.scale
        return np.concatenate([flat, np.zeros((*flat.shape[:-1], 1))], axis=-1)


def fitted(box: FloatArray, size: float, before: Fit | None) -> Fit:
    """Return a fit that brings the larger side of a box to ``size`` [m].

    While a length is being changed the drawing keeps its scale, so that the change can be seen:
    the fit ``before`` is kept as long as it is good enough.

    Args:
        box: lowest and highest corner. Shape (2, 2) [m].
        size: of the drawing [m].
        before: of the same mechanism; None for another mechanism.
    """
    if before is not None:
        low, high = (box - before.centre) * before.scale
        reach = 2.0 * max(np.abs(low).max(), np.abs(high).max())
        if size * TOO_SMALL <= reach <= size * TOO_LARGE:
            return before
    side = float((box[1] - box[0]).max())
    return Fit(size / side, 0.5 * (box[0] + box[1]))
