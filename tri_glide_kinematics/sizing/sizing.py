"""A symmetric machine with all that is proved of it over the wanted volume."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tri_glide_kinematics.dynamics import Masses
from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.sizing.designs import DEMANDS, Needs, Spans, field_bounds, needs, spans
from tri_glide_kinematics.sizing.proof import TIGHTNESS, Extremes, largest_over
from tri_glide_kinematics.sizing.wish import Box, Demand, Wish, heights_of
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Cylinder, WorkspaceLimits

# A largest condition number is put this part above what is proved.
ABOVE_PROVED = 1e-6

# A reach margin of a machine: this part of what its arms are longer than they have to be [m].
PART_OF_REACH = 0.5
LARGEST_REACH_MARGIN = 0.005


@dataclass(frozen=True, eq=False)
class Sizing:
    """A machine for a wish; all largest and least numbers hold over the whole volume.

    Attributes:
        wish: for which it is.
        base_radius: of the circle through the tower joints [m].
        arm_length: [m].
        extremes: condition number, position error for errors of 1 of the sliders, and largest force
            of a slider [N]: proved bounds, and values that are reached.
        needs: what it needs of each demand, and the objectives.
    """

    wish: Wish
    base_radius: float
    arm_length: float
    extremes: Extremes
    needs: Needs

    @property
    def platform_radius(self) -> float:
        """Radius of the circle through the platform joints [m]."""
        return self.wish.platform_radius

    @cached_property
    def span(self) -> Spans:
        """Horizontal distances and rises of the arms, each of shape (1,)."""
        difference = np.array([self.base_radius - self.platform_radius])
        return spans(self.wish, difference, np.array([self.arm_length]))

    @cached_property
    def machine(self) -> TriGlide:
        """Its kinematics."""
        return TriGlide(
            TriGlideGeometry.symmetric(
                self.base_radius, self.platform_radius, self.arm_length, self.wish.orientation
            )
        )

    @property
    def masses(self) -> Masses:
        """Its masses."""
        return self.wish.masses(self.arm_length)

    @property
    def travel(self) -> tuple[float, float]:
        """Lower and upper end of travel of each slider [m]."""
        bottom, top = heights_of(self.wish.volume)
        margin = self.wish.end_margin
        low, high = bottom + self.span.least_rise[0], top + self.span.largest_rise[0]
        return float(low) - margin, float(high) + margin

    @property
    def column_height(self) -> float:
        """From the lower end of the volume to the upper ends of travel [m]."""
        return self.travel[1] - heights_of(self.wish.volume)[0]

    @property
    def slider_speed(self) -> float:
        """Largest one of a slider at the wanted speed of the platform in any direction [m/s]."""
        return float(self.wish.speed * self.arm_length / self.span.least_rise[0])

    @property
    def slider_acceleration(self) -> float:
        """Largest one of a slider at the wanted speed and acceleration [m/s^2]."""
        rise = float(self.span.least_rise[0])
        speed_squared = self.wish.speed * self.wish.speed
        linear = self.wish.acceleration * self.arm_length / rise
        return linear + speed_squared * self.arm_length**2 / rise**3

    @property
    def condition_number(self) -> float:
        """Largest one of the Jacobian."""
        return float(self.extremes.bounds[0])

    @property
    def platform_resolution(self) -> float:
        """Twice the largest position error, each slider half a step beside its setpoint [m]."""
        return float(self.wish.drive_resolution * self.extremes.bounds[1])

    @property
    def force(self) -> float:
        """Largest one of a slider, at the wanted speed and acceleration in any direction [N]."""
        return float(self.extremes.bounds[2])

    @property
    def power(self) -> float:
        """Largest force times largest speed of a slider [W]."""
        return float(self.needs.power[0])

    @property
    def size(self) -> float:
        """Volume of the upright cylinder through the tower joints [m^3]."""
        return float(self.needs.size[0])

    @property
    def worst(self) -> float:
        """The largest part of a demand that is used; at most 1 if all is kept."""
        return float(self.needs.worst[0])

    @property
    def tight(self) -> tuple[Demand, ...]:
        """The demands that are used up to a hundredth."""
        return tuple(d for d, ratio in zip(DEMANDS, self.needs.ratios[:, 0]) if ratio > 0.99)

    def slider_limits(self) -> SliderLimits:
        """Return the limits with which the platform reaches what is wished in every direction."""
        acceleration = self.slider_acceleration
        return SliderLimits.uniform(
            self.slider_speed, acceleration, acceleration / self.wish.jerk_time
        )

    def workspace_limits(self) -> WorkspaceLimits:
        """Return limits inside which all of the volume is, and nothing beside it."""
        lower, upper = self.travel
        volume = self.wish.volume
        reach = self.arm_length - float(self.span.farthest[0])
        lower_corner: Vector3 | None = None
        upper_corner: Vector3 | None = None
        cylinder: Cylinder | None = None
        if isinstance(volume, Box):
            lower_corner, upper_corner = volume.lower, volume.upper
        else:
            cylinder = volume
        return WorkspaceLimits(
            (lower,) * 3,
            (upper,) * 3,
            min(PART_OF_REACH * reach, LARGEST_REACH_MARGIN),
            self.condition_number * (1.0 + ABOVE_PROVED),
            lower_corner,
            upper_corner,
            cylinder,
        )


def sizing_of(
    wish: Wish, base_radius: float, arm_length: float, tightness: float = TIGHTNESS
) -> Sizing:
    """Return what is proved of a symmetric machine for a wish, whether it does all of it or not.

    Args:
        wish: what it is to do.
        base_radius: [m].
        arm_length: [m].
        tightness: largest part by which a bound is above a value that is reached.
    """
    difference = base_radius - wish.platform_radius

    def quantities(places: FloatArray, radius: float) -> FloatArray:
        ones = np.ones(len(places))
        return field_bounds(wish, difference * ones, arm_length * ones, places, radius)

    differences, lengths = np.array([difference]), np.array([arm_length])
    if not np.isfinite(spans(wish, differences, lengths).least_rise[0]):
        none = np.full(3, np.inf)
        extremes = Extremes(none, none, np.zeros((3, 2)))
    else:
        extremes = largest_over(wish.volume, quantities, tightness)
    return Sizing(
        wish,
        base_radius,
        arm_length,
        extremes,
        needs(wish, differences, lengths, extremes.bounds[:, np.newaxis]),
    )
