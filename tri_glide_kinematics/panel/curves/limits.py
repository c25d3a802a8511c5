"""The limits that are drawn beside the curves."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.checks import finite_vector
from tri_glide_kinematics.vectors import Vector3


@dataclass(frozen=True)
class CurveLimits:
    """Limits of the three sliders.

    Attributes:
        lower_heights: [m].
        upper_heights: [m].
        velocities: largest ones, either way [m/s].
        accelerations: largest ones, either way [m/s^2].

    Raises:
        WrongShapeError: if there are not three of each.
        NotFiniteError: if one is NaN or infinite.
    """

    lower_heights: Vector3
    upper_heights: Vector3
    velocities: Vector3
    accelerations: Vector3

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, values in vars(self).items():
            object.__setattr__(self, name, finite_vector(name, values, 3))
