"""What is known of a machine before anything is measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.calibration.fit.machine import MachineParameters
from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text


@dataclass(frozen=True)
class Priors:
    """The nominal values with standard deviations: how far the real machine may be from them.

    The default assumes a machine that was built with care: each coordinate of an anchor is known to
    1 mm, each arm to 0.5 mm and each slider's zero to 2 mm (one standard deviation each, all
    independent and normally distributed).

    Attributes:
        anchors: standard deviation of each coordinate of each anchor [m].
        arm_lengths: standard deviation of each length [m].
        height_offsets: standard deviation of each offset [m].
        mean: around which the parameters lie; None for the nominal machine of the calibration.
    """

    anchors: float = 1e-3
    arm_lengths: float = 5e-4
    height_offsets: float = 2e-3
    mean: MachineParameters | None = None

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if a standard deviation is NaN or infinite.
            OutOfBoundsError: if one is not greater than zero.
        """
        for name in ("anchors", "arm_lengths", "height_offsets"):
            value = positive(f"standard deviation of {name}", getattr(self, name), "m")
            object.__setattr__(self, name, value)

    def deviations(self) -> FloatArray:
        """Return the standard deviations of all twelve parameters. Shape (12,) [m]."""
        return np.repeat([self.anchors, self.arm_lengths, self.height_offsets], [6, 3, 3])

    def __str__(self) -> str:
        """Return in words what is assumed."""
        anchors, arms, offsets = (
            number_text(1000.0 * value, 3)
            for value in (self.anchors, self.arm_lengths, self.height_offsets)
        )
        return (
            f"anchors within {anchors} mm in x and in y, arms within {arms} mm, height offsets "
            f"within {offsets} mm of the nominal ones (standard deviations)"
        )
