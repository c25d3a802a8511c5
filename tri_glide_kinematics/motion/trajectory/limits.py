"""What the drives of the three sliders are allowed to do, and what else bounds all motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.checks import finite_vector, positive
from tri_glide_kinematics.vectors import FloatArray, Vector3

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.trajectory.added_bounds import AddedBound

QUANTITIES = (("velocity", "m/s"), ("acceleration", "m/s^2"), ("jerk", "m/s^3"))

# A bound may be exceeded by this fraction of it: rounding.
RELATIVE_ROUNDING = 1e-8

# A slider may pass an end of its travel by this: rounding [m].
TRAVEL_ROUNDING = 1e-9

# A motion ends this far from the edge of the workspace, and needs as much room to begin [m].
EDGE_CLEARANCE = 1e-6


@dataclass(frozen=True)
class SliderLimits:
    """Largest velocity, acceleration and jerk of each slider, upwards and downwards alike.

    Attributes:
        velocity: Shape (3,) [m/s].
        acceleration: Shape (3,) [m/s^2].
        jerk: Shape (3,) [m/s^3].
        added: what bounds all motion besides, as the speed of the platform.
    """

    velocity: Vector3
    acceleration: Vector3
    jerk: Vector3
    added: tuple[AddedBound, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers and store them as plain floats.

        Raises:
            WrongShapeError: if one of the attributes has not three numbers.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a number is not greater than zero.
        """
        for name, unit in QUANTITIES:
            values: Sequence[float] = getattr(self, name)
            checked = tuple(
                positive(f"{name}[{i}]", value, unit)
                for i, value in enumerate(finite_vector(name, values, 3))
            )
            object.__setattr__(self, name, checked)

    @classmethod
    def uniform(cls, velocity: float, acceleration: float, jerk: float) -> SliderLimits:
        """Return equal limits for all three sliders [m/s, m/s^2, m/s^3]."""
        return cls((velocity,) * 3, (acceleration,) * 3, (jerk,) * 3)

    @cached_property
    def table(self) -> NDArray[np.float64]:
        """Velocity, acceleration and jerk of all sliders; read-only. Shape (3, 3)."""
        table = np.array((self.velocity, self.acceleration, self.jerk))
        table.setflags(write=False)
        return table

    @cached_property
    def platform_speed(self) -> float:
        """Largest speed of the platform that the added bounds allow; inf without one [m/s]."""
        return min((bound.platform_speed for bound in self.added), default=math.inf)

    def with_table(self, table: FloatArray) -> SliderLimits:
        """Return the same with another ``table`` of velocity, acceleration and jerk, (3, 3)."""
        velocity, acceleration, jerk = table.tolist()
        return SliderLimits(velocity, acceleration, jerk, self.added)

    def with_added(self, *added: AddedBound) -> SliderLimits:
        """Return the same with other added bounds."""
        return replace(self, added=added)

    def with_velocity_scaled(self, scale: float) -> SliderLimits:
        """Return the same limits with velocities multiplied by ``scale``."""
        return self.times(scale, 1.0, 1.0)

    def times(self, velocity: float, acceleration: float, jerk: float) -> SliderLimits:
        """Return the limits multiplied by a number for each quantity."""
        factors = np.array(((velocity,), (acceleration,), (jerk,)))
        return self.with_table(factors * self.table)
