"""A wish: what a machine has to do, and what it may not exceed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from tri_glide_kinematics.checks import finite, finite_vector, non_negative, positive
from tri_glide_kinematics.dynamics import Masses
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Cylinder

# Places at which a design is tried before it is proved: on the edge of the volume, and inside.
EDGE_PLACES = 24


@dataclass(frozen=True)
class Box:
    """A box with sides along the axes, in which the platform centre has to be able to be.

    Attributes:
        lower: its lower corner. Shape (3,) [m].
        upper: its upper corner. Shape (3,) [m].
    """

    lower: Vector3
    upper: Vector3

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            WrongShapeError: if a corner has not three numbers.
            NotFiniteError: if one of them is NaN or infinite.
            OutOfBoundsError: if the upper corner is not above the lower one in each coordinate.
        """
        for name in ("lower", "upper"):
            object.__setattr__(self, name, finite_vector(f"box {name}", getattr(self, name), 3))
        for i, (low, high) in enumerate(zip(self.lower, self.upper)):
            if not high > low:
                raise OutOfBoundsError(f"box upper[{i}]", high, f"greater than {low:g}", "m")


Volume = Cylinder | Box


def heights_of(volume: Volume) -> tuple[float, float]:
    """Return the lower and the upper end of a volume [m]."""
    if isinstance(volume, Box):
        return volume.lower[2], volume.upper[2]
    return volume.z_min, volume.z_max


def level_box(volume: Volume) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the least rectangle around a volume, seen from above. (2,) each [m]."""
    if isinstance(volume, Box):
        return np.array(volume.lower[:2]), np.array(volume.upper[:2])
    center = np.array((volume.center_x, volume.center_y))
    return center - volume.radius, center + volume.radius


def nearest_inside(volume: Volume, places: FloatArray) -> FloatArray:
    """Return the place of a volume, seen from above, that is nearest to each of ``places``.

    Args:
        volume: convex, so that two results are no farther apart than their two places.
        places: Shape (n, 2) [m].
    """
    if isinstance(volume, Box):
        return np.clip(places, volume.lower[:2], volume.upper[:2])
    center = np.array((volume.center_x, volume.center_y))
    across = places - center
    sizes = np.hypot(across[:, 0], across[:, 1])
    return center + across * (volume.radius / np.maximum(sizes, volume.radius))[:, np.newaxis]


def distances(volume: Volume, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least and the largest distance of a volume, seen from above, from ``places``.

    Args:
        volume: whose distances they are.
        places: Shape (n, 2) [m].

    Returns:
        Both of shape (n,) [m].
    """
    nearest = places - nearest_inside(volume, places)
    if isinstance(volume, Box):
        lower, upper = level_box(volume)
        farthest = np.maximum(np.abs(places - lower), np.abs(places - upper))
        largest = np.hypot(farthest[:, 0], farthest[:, 1])
    else:
        away = places - np.array((volume.center_x, volume.center_y))
        largest = np.hypot(away[:, 0], away[:, 1]) + volume.radius
    return np.hypot(nearest[:, 0], nearest[:, 1]), largest


def some_places(volume: Volume) -> FloatArray:
    """Return places of a volume, seen from above: on its edge, and some inside. (n, 2) [m]."""
    if isinstance(volume, Box):
        lower, upper = level_box(volume)
        part = np.linspace(-1.0, 1.0, EDGE_PLACES // 4 + 1)[:-1]
        ones = np.ones_like(part)
        edge = np.concatenate(
            [np.stack(side, axis=1) for side in ((part, -ones), (ones, part))]
            + [np.stack(side, axis=1) for side in ((-part, ones), (-ones, -part))]
        )
        center, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    else:
        angles = math.radians(90.0) + np.linspace(0.0, 2.0 * math.pi, EDGE_PLACES, endpoint=False)
        edge = np.stack((np.cos(angles), np.sin(angles)), axis=1)
        center, half = np.array((volume.center_x, volume.center_y)), np.full(2, volume.radius)
    inside = np.concatenate((edge, 0.5 * edge[::4], np.zeros((1, 2))))
    return np.asarray(center + half * inside)


class Demand(Enum):
    """What a wish may bound, with the name of its number in the wish."""

    BASE_RADIUS = "largest_base_radius"
    COLUMN_HEIGHT = "largest_column_height"
    CLEARANCE = "clearance"
    ARM_ANGLE = "least_arm_angle"
    CONDITION = "max_condition_number"
    SLIDER_SPEED = "largest_slider_speed"
    RESOLUTION = "platform_resolution"
    FORCE = "largest_force"

    @property
    def unit(self) -> str:
        """Unit of the number, empty if it has none."""
        return {
            Demand.ARM_ANGLE: "rad",
            Demand.CONDITION: "",
            Demand.SLIDER_SPEED: "m/s",
            Demand.FORCE: "N",
        }.get(self, "m")


class Objective(Enum):
    """What is to be least, among all machines that do what is wished."""

    SIZE = "size"
    """Volume of the upright cylinder through the tower joints, from the lower end of the wanted
    volume to the upper ends of travel [m^3]."""
    POWER = "power"
    """Largest force of a slider times its largest speed, anywhere in the wanted volume [W]."""


@dataclass(frozen=True)
class Wish:
    """What a machine has to do, and what it may not exceed.

    The axis of the machine is at x = y = 0; a volume may be beside it.

    Attributes:
        volume: in which the platform centre has to be able to be.
        speed: of the platform, in any direction [m/s].
        acceleration: of the platform, in any direction and at this speed [m/s^2].
        payload: on the platform [kg].
        carriage_mass: of each slider [kg].
        arm_density: mass of an arm, both rods of it, for each metre [kg/m].
        platform_mass: [kg].
        platform_radius: of the circle through its joints, as small as the tool allows [m].
        drive_resolution: step of the drives; a slider is up to half of it beside its setpoint [m].
        platform_resolution: the platform may be at most half of this beside its setpoint for it;
            None for any [m].
        largest_base_radius: room for the towers; None for any [m].
        largest_column_height: from the lower end of the volume to the upper ends of travel; None
            for any [m].
        largest_force: of a slider; None for any [N].
        largest_slider_speed: None for any [m/s].
        max_condition_number: of the Jacobian.
        least_arm_angle: of an arm from the level [rad].
        clearance: least horizontal distance of a platform joint from its tower joint [m].
        end_margin: of travel at both ends [m].
        jerk_time: in which the acceleration builds up [s].
        orientation: of the first tower, counter-clockwise from the y axis [rad].
    """

    volume: Volume
    speed: float
    acceleration: float
    payload: float = 0.0
    carriage_mass: float = 0.5
    arm_density: float = 0.3
    platform_mass: float = 0.3
    platform_radius: float = 0.05
    drive_resolution: float = 1e-5
    platform_resolution: float | None = None
    largest_base_radius: float | None = None
    largest_column_height: float | None = None
    largest_force: float | None = None
    largest_slider_speed: float | None = None
    max_condition_number: float = 6.0
    least_arm_angle: float = math.radians(20.0)
    clearance: float = 0.02
    end_margin: float = 0.02
    jerk_time: float = 0.05
    orientation: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers and store them as plain floats.

        Raises:
            KinematicsError: if the volume is none, or a number is not one, or out of its bounds.
        """
        if not isinstance(self.volume, (Cylinder, Box)):
            raise KinematicsError(f"volume = {self.volume!r} must be a Cylinder or a Box")
        for names, check in (
            (("speed", "acceleration", "carriage_mass", "platform_mass", "jerk_time"), positive),
            (("max_condition_number", "least_arm_angle", "drive_resolution"), positive),
            (
                ("payload", "arm_density", "platform_radius", "clearance", "end_margin"),
                non_negative,
            ),
            (("orientation",), finite),
        ):
            for name in names:
                object.__setattr__(self, name, check(name, getattr(self, name)))
        for demand in Demand:
            value = getattr(self, demand.value)
            if value is not None and demand is not Demand.CLEARANCE:
                value = positive(demand.value, value, demand.unit)
                object.__setattr__(self, demand.value, value)
        if self.max_condition_number <= 1.0:
            number = self.max_condition_number
            raise OutOfBoundsError("max_condition_number", number, "greater than 1")
        if self.least_arm_angle >= 0.5 * math.pi:
            angle = self.least_arm_angle
            raise OutOfBoundsError("least_arm_angle", angle, "less than a right angle", "rad")
        largest = self.largest_base_radius
        if largest is not None and largest <= self.platform_radius:
            bound = f"greater than platform_radius = {self.platform_radius:g}"
            raise OutOfBoundsError("largest_base_radius", largest, bound, "m")

    def masses(self, arm_length: float) -> Masses:
        """Return the masses of a machine with arms of a length [m]."""
        return Masses.uniform(
            self.carriage_mass,
            self.arm_density * arm_length,
            self.platform_mass,
            payload=self.payload,
        )

    def loosened(self, demand: Demand, factor: float) -> Wish:
        """Return the same wish with one demand loosened by a ``factor`` of at least 1."""
        value = getattr(self, demand.value)
        if value is None:
            return self
        if demand is Demand.CLEARANCE:
            value = value / factor
        elif demand is Demand.ARM_ANGLE:
            value = math.asin(math.sin(value) / factor)
        elif demand is Demand.BASE_RADIUS:
            # Of the machine it is the difference of the radii that counts.
            value = self.platform_radius + (value - self.platform_radius) * factor
        else:
            value = value * factor
        return replace(self, **{demand.value: value})
