"""A largest speed of the platform, as a bound of all motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.motion.errors import AddedBoundError
from tri_glide_kinematics.motion.limits.limits import AddedBound, SeenParts, UsedParts
from tri_glide_kinematics.motion.limits.series import Series, largest_value, product
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text


@dataclass(frozen=True)
class PlatformSpeedLimit(AddedBound):
    """A largest speed of the platform.

    Attributes:
        machine: whose platform it is.
        speed: [m/s].
    """

    name = "a platform speed limit"
    quantity = "platform speed"
    order = 1

    machine: TriGlide
    speed: float

    def __post_init__(self) -> None:
        """Check the speed.

        Raises:
            NotFiniteError: if it is NaN or infinite.
            OutOfBoundsError: if it is not greater than zero.
        """
        object.__setattr__(self, "speed", positive("platform_speed_limit", self.speed, "m/s"))

    @property
    def platform_speed(self) -> float:
        """The speed [m/s]."""
        return self.speed

    def used(self, position: Series, half: FloatArray) -> UsedParts:
        """Return which part of the speed is used; its square is a series as well."""
        orders = np.arange(1.0, 6.0)[:, np.newaxis, np.newaxis]
        velocity, bounds = orders * position.values[1:], orders * position.bounds[1:]
        # Of the velocity the coefficients up to the third order are known, of the fourth the bound.
        padded = np.concatenate((velocity[:4], np.zeros((2, *velocity.shape[1:]))))
        squares = product(padded, padded).sum(axis=1)[:4]
        b0, b1, b2, b3, b4 = bounds
        rest = (2.0 * (b0 * b4 + b1 * b3) + b2 * b2).sum(axis=0)
        largest = largest_value(squares, rest, half)
        return UsedParts(np.sqrt(largest) / self.speed, np.sqrt(squares[0]) / self.speed)

    def seen(self, heights: FloatArray, period: float, rounding: float) -> SeenParts:
        """Return which part of the speed is used, by differences of the places of the platform.

        Such a difference is a mean of velocities, so it keeps each limit that they keep.
        """
        places = self.machine.forward_batch(heights)
        # Errors of all heights grow by the square root of 3 over the least singular value. As the
        # largest is at least that root, this is no more than the condition number.
        wrong = 2.0 * rounding * self.machine.condition_number_batch(places)
        steps = np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1)
        parts = np.maximum(steps - wrong, 0.0) / period / self.speed
        return SeenParts(
            parts,
            0.0,
            lambda row: (
                f"the platform moves at {steps[row] / period:.9g} m/s, {parts[row]:.6f} of its "
                f"limit, {number_text(self.speed)} m/s"
            ),
        )

    def error(self, part: float, time: float) -> AddedBoundError:
        """Return the error with the speed and the limit."""
        value = part * self.speed
        return AddedBoundError("speed of the platform", value, self.speed, "m/s", time)
