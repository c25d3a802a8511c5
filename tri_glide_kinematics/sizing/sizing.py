"""Symmetric machines for a wish: what they need, and all that is proved of one over the volume.

For the kinematics only two numbers of a symmetric machine count: the difference of its radii, e,
and the length L of its arms. All else follows in closed form, or from the Jacobian at places.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.dynamics import Masses
from tri_glide_kinematics.files import parameter_file
from tri_glide_kinematics.keys import in_a_line
from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.sizing.fields import TIGHTNESS, Cells, Extremes, Loads, largest_over
from tri_glide_kinematics.sizing.wish import (
    Box,
    Demand,
    Objective,
    Volume,
    Wish,
    distances,
    heights_of,
    level_box,
)
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import WorkspaceLimits

DEMANDS = tuple(Demand)


class Needs(NamedTuple):
    """What machines need, one column for each.

    Attributes:
        ratios: what each demand needs, as part of what it allows; in the order of ``Demand``, 0
            where nothing is demanded. Shape (8, n).
        size: of ``Objective.SIZE``. Shape (n,) [m^3].
        power: of ``Objective.POWER``. Shape (n,) [W].
    """

    ratios: FloatArray
    size: FloatArray
    power: FloatArray

    @property
    def worst(self) -> FloatArray:
        """The largest ratio of each; a machine does what is wished if it is at most 1. (n,)."""
        return np.asarray(self.ratios.max(axis=0))

    def of(self, objective: Objective) -> FloatArray:
        """Return the numbers that an objective makes least. Shape (n,)."""
        return self.size if objective is Objective.SIZE else self.power


class Spans(NamedTuple):
    """What follows from the distances of a volume from the anchors, one number for each machine.

    Attributes:
        nearest: least horizontal distance of a platform joint from its tower joint [m].
        farthest: largest one [m].
        least_rise: of an arm; NaN if it does not reach [m].
        largest_rise: of an arm [m].
    """

    nearest: FloatArray
    farthest: FloatArray
    least_rise: FloatArray
    largest_rise: FloatArray


def directions(orientation: float) -> FloatArray:
    """Return the directions of the towers from the axis. Shape (3, 2)."""
    angles = orientation + np.radians((90.0, 210.0, 330.0))
    return np.stack((np.cos(angles), np.sin(angles)), axis=1)


def span_of(volume: Volume, orientation: float, differences: FloatArray) -> FloatArray:
    """Return the least and the largest distance of a volume from the anchors of machines.

    Args:
        volume: seen from above.
        orientation: of the machines [rad].
        differences: of the radii of each machine. Shape (n,) [m].

    Returns:
        Shape (2, n) [m].
    """
    anchors = differences[:, np.newaxis, np.newaxis] * directions(orientation)
    least, largest = distances(volume, anchors.reshape(-1, 2))
    return np.stack((least.reshape(-1, 3).min(axis=1), largest.reshape(-1, 3).max(axis=1)))


def spans(wish: Wish, differences: FloatArray, lengths: FloatArray) -> Spans:
    """Return the spans of machines; both arrays have the shape (n,) [m]."""
    nearest, farthest = span_of(wish.volume, wish.orientation, differences)
    with np.errstate(invalid="ignore"):
        least = np.sqrt((lengths - farthest) * (lengths + farthest))
        largest = np.sqrt((lengths - nearest) * (lengths + nearest))
    return Spans(nearest, farthest, least, largest)


def loads_of(wish: Wish, lengths: FloatArray) -> Loads:
    """Return the loads of machines with arms of these lengths. Shape (n,) [m]."""
    # Arms of a uniform density: all is linear in their length.
    one, two = (Loads.of(wish.masses(length), (length,) * 3) for length in (1.0, 2.0))
    return Loads(*(a + (b - a) * (lengths - 1.0) for a, b in zip(one, two)))


def field_bounds(
    wish: Wish, differences: FloatArray, lengths: FloatArray, places: FloatArray, radius: float
) -> FloatArray:
    """Return condition number, position error and force about places, one machine for each.

    Args:
        wish: whose speed, acceleration and masses count.
        differences: of the radii. Shape (n,) [m].
        lengths: of the arms. Shape (n,) [m].
        places: Shape (n, 2) [m].
        radius: of the cells about them [m].

    Returns:
        Largest condition number, largest position error for errors of 1 of the sliders, and
        largest force of a slider [N] in each cell. Shape (3, n).
    """
    anchors = directions(wish.orientation)[:, :, np.newaxis] * differences
    cells = Cells.around(anchors - places.T, np.broadcast_to(lengths, (3, len(places))), radius)
    forces = cells.forces(loads_of(wish, lengths), wish.speed, wish.acceleration)
    return np.stack((cells.conditions(), cells.position_errors(), forces.max(axis=0)))


def needs(wish: Wish, differences: FloatArray, lengths: FloatArray, largest: FloatArray) -> Needs:
    """Return what machines need.

    Args:
        wish: for which they are.
        differences: of the radii. Shape (n,) [m].
        lengths: of the arms. Shape (n,) [m].
        largest: condition number, position error and force, as in ``field_bounds``, over the
            volume. Shape (3, n).
    """
    span = spans(wish, differences, lengths)
    bottom, top = heights_of(wish.volume)
    column = top - bottom + span.largest_rise + wish.end_margin
    radius = differences + wish.platform_radius
    condition, error, force = largest
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = lengths / span.least_rise
        speed = wish.speed * ratio
        needed = {
            Demand.BASE_RADIUS: differences,
            Demand.COLUMN_HEIGHT: column,
            Demand.CLEARANCE: wish.clearance / np.maximum(span.nearest, 1e-9),
            Demand.ARM_ANGLE: math.sin(wish.least_arm_angle) * ratio,
            Demand.CONDITION: condition,
            Demand.SLIDER_SPEED: speed,
            Demand.RESOLUTION: wish.drive_resolution * error,
            Demand.FORCE: force,
        }
        ratios = np.array([needed[each] / _allowed(wish, each) for each in DEMANDS])
    ratios[:, ~np.isfinite(ratios.sum(axis=0))] = np.inf
    with np.errstate(invalid="ignore", over="ignore"):
        return Needs(ratios, np.pi * radius * radius * column, force * speed)


def _allowed(wish: Wish, demand: Demand) -> float:
    """Return what a demand allows, infinity without a bound; 1 where it is part of the need."""
    if demand in (Demand.CLEARANCE, Demand.ARM_ANGLE):
        return 1.0
    allowed = getattr(wish, demand.value)
    if allowed is None:
        return math.inf
    return float(allowed) - (wish.platform_radius if demand is Demand.BASE_RADIUS else 0.0)


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
        limits = WorkspaceLimits(
            (lower,) * 3,
            (upper,) * 3,
            min(PART_OF_REACH * reach, LARGEST_REACH_MARGIN),
            self.condition_number * (1.0 + ABOVE_PROVED),
        )
        if isinstance(volume, Box):
            return replace(limits, box_lower=volume.lower, box_upper=volume.upper)
        return replace(limits, cylinder=volume)


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


FIRST_LINE = "Parameters of a machine that was sized by tri_glide_kinematics."


def parameter_text(sizing: Sizing) -> str:
    """Return a parameter file for all nodes, with its last line ended.

    The platform may be in all of the wanted volume, and nowhere else. The simulator begins in its
    middle.

    Args:
        sizing: the machine.
    """
    limits, volume = sizing.slider_limits(), sizing.wish.volume
    (low, high), level = heights_of(volume), np.mean(level_box(volume), axis=0)
    values: dict[str, str | float | tuple[float, ...]] = {
        "geometry": "symmetric",
        "base_radius": sizing.base_radius,
        "platform_radius": sizing.platform_radius,
        "arm_length": sizing.arm_length,
        "orientation": sizing.wish.orientation,
        "velocity_limits": limits.velocity,
        "acceleration_limits": limits.acceleration,
        "jerk_limits": limits.jerk,
        "space": "box" if isinstance(volume, Box) else "cylinder",
        **sizing.workspace_limits().by_name(),
        "initial_heights": sizing.machine.inverse((*level, 0.5 * (low + high))),
        "encoder_resolution": sizing.wish.drive_resolution,
    }
    rows = [(name, in_a_line(_rounded(value)), "") for name, value in values.items()]
    return parameter_file((FIRST_LINE,), "/**", rows)


def _rounded(value: str | float | tuple[float, ...]) -> str | float | list[float]:
    """Return a text as it is, and numbers in twelve digits."""
    if isinstance(value, tuple):
        return [float(f"{each:.12g}") + 0.0 for each in value]
    return value if isinstance(value, str) else float(f"{value:.12g}") + 0.0
