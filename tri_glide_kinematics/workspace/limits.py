"""The limits of the workspace of a tri-glide: the numbers, checked as a set, and shapes in space.

Reach and cylinder are discs about an upright axis; the sides of the box and the ends of the
cylinder are planes; the ends of slider travel are the lower halves of spheres about the carriage
there, as the platform hangs from it on the arm.

For what has been commanded, as arrays, ``overruns`` tells by how much many heights of the sliders
pass them; a ``Workspace`` checks one place, or a whole way.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from enum import Enum
from math import hypot, inf, sqrt
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import (
    array_of_shape,
    finite,
    finite_vector,
    non_negative,
    positive,
)
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, Refusal
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Vector3
from tri_glide_kinematics.wording import number_text, unit_question, vector_text


class OutsideWorkspaceError(KinematicsError):
    """A place breaks a limit of the workspace."""

    refusal = Refusal.OUTSIDE_WORKSPACE

    def __init__(
        self,
        limit: WorkspaceLimit,
        arm: int | None,
        position: Sequence[float],
        value: float,
        bound: float,
    ) -> None:
        """Store which limit is broken, and where.

        Args:
            limit: that is broken.
            arm: index of the arm (and slider), if the limit belongs to one.
            position: of the platform [m].
            value: of the limited quantity, in the limit's unit.
            bound: that it breaks.
        """
        of_arm = "" if arm is None else f" of arm {arm + 1}"
        unit = f" {limit.unit}" if limit.unit else ""
        question = unit_question(value, bound) if limit.unit else ""
        super().__init__(
            f"outside the workspace at {vector_text(position)} m: {number_text(value)}{unit} "
            f"breaks the {limit.value}{of_arm}, {number_text(bound)}{unit}{question}"
        )
        self.limit = limit
        self.arm = arm
        self.position = tuple(position)
        self.value = value
        self.bound = bound


class UndecidedWayError(KinematicsError):
    """A way could not be proved to be inside the workspace, though no place outside was found."""

    refusal = Refusal.OUTSIDE_WORKSPACE

    def __init__(self, position: Sequence[float]) -> None:
        """Store the place from where on nothing is proved. Shape (3,) [m]."""
        super().__init__(
            f"the way is not proved to be inside the workspace from {vector_text(position)} m on: "
            "it runs too close along an edge"
        )
        self.position = tuple(position)


class WorkspaceLimit(Enum):
    """Names of the limits, as texts of errors give them."""

    LOWER_TRAVEL = "lower end of slider travel"
    UPPER_TRAVEL = "upper end of slider travel"
    REACH = "horizontal reach"
    CONDITION = "largest condition number"
    BOX_X = "box in x"
    BOX_Y = "box in y"
    BOX_Z = "box in z"
    CYLINDER_RADIUS = "radius of the cylinder"
    CYLINDER_Z = "height of the cylinder"

    @property
    def unit(self) -> str:
        """Unit of the limited quantity, empty if it has none."""
        return "" if self is WorkspaceLimit.CONDITION else "m"


@dataclass(frozen=True)
class Cylinder:
    """An upright cylinder in which the platform centre has to stay.

    Attributes:
        center_x: place of its axis [m].
        center_y: place of its axis [m].
        radius: [m].
        z_min: lower end [m].
        z_max: upper end [m].
    """

    center_x: float
    center_y: float
    radius: float
    z_min: float
    z_max: float

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if one of them is NaN or infinite.
            OutOfBoundsError: if the radius or the height is not greater than zero.
        """
        for name in ("center_x", "center_y", "z_min", "z_max"):
            object.__setattr__(self, name, finite(f"cylinder {name}", getattr(self, name)))
        object.__setattr__(self, "radius", positive("cylinder radius", self.radius, "m"))
        _check_order("cylinder z_min", self.z_min, "cylinder z_max", self.z_max)


@dataclass(frozen=True)
class WorkspaceLimits:
    """The limits of the platform and of the sliders.

    Attributes:
        lower_heights: lower end of the travel of each slider. Shape (3,) [m].
        upper_heights: upper end of the travel of each slider. Shape (3,) [m].
        reach_margin: by how much the horizontal distance of each arm has to stay below the arm's
            length [m].
        max_condition_number: largest condition number of the Jacobian, greater than 1.
        box_lower: lower corner of a box for the platform centre; without it the box is open
            downwards in each coordinate. Shape (3,) [m].
        box_upper: upper corner; without it the box is open upwards. Shape (3,) [m].
        cylinder: for the platform centre, too.
    """

    lower_heights: Vector3
    upper_heights: Vector3
    reach_margin: float
    max_condition_number: float
    box_lower: Vector3 | None = None
    box_upper: Vector3 | None = None
    cylinder: Cylinder | None = None

    def __post_init__(self) -> None:
        """Check the numbers and store them as plain floats.

        Raises:
            WrongShapeError: if a vector has not three numbers.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if an upper bound is not above its lower one, the margin is negative
                or the condition number is not greater than 1.
        """
        for name in ("lower_heights", "upper_heights", "box_lower", "box_upper"):
            values: Sequence[float] | None = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, finite_vector(name, values, 3))
        _check_corners("lower_heights", self.lower_heights, "upper_heights", self.upper_heights)
        if self.box_lower is not None and self.box_upper is not None:
            _check_corners("box_lower", self.box_lower, "box_upper", self.box_upper)
        margin = non_negative("reach_margin", self.reach_margin, "m")
        object.__setattr__(self, "reach_margin", margin)
        condition = finite("max_condition_number", self.max_condition_number)
        if condition <= 1.0:
            raise OutOfBoundsError("max_condition_number", condition, "greater than 1")
        object.__setattr__(self, "max_condition_number", condition)

    def by_name(self) -> dict[str, Any]:
        """Return all that bounds, by the names of parameters: numbers, and tuples of numbers."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        cylinder: Cylinder | None = values.pop("cylinder")
        if cylinder is not None:
            values["cylinder_center"] = cylinder.center_x, cylinder.center_y
            values["cylinder_radius"] = cylinder.radius
            values["cylinder_z"] = cylinder.z_min, cylinder.z_max
        return {name: value for name, value in values.items() if value is not None}


def _check_corners(
    lower_name: str, lower: Sequence[float], upper_name: str, upper: Sequence[float]
) -> None:
    """Raise an error unless ``upper`` is above ``lower`` in each component."""
    for i in range(3):
        _check_order(f"{lower_name}[{i}]", lower[i], f"{upper_name}[{i}]", upper[i])


def _check_order(lower_name: str, lower: float, upper_name: str, upper: float) -> None:
    """Raise an error unless ``upper`` is above ``lower``."""
    if not upper > lower:
        raise OutOfBoundsError(
            upper_name, upper, f"greater than {lower_name} = {number_text(lower)}", "m"
        )


# A place that breaks a limit by less than this is inside, so that the exact edge surely is: in [m],
# or as a part of the largest condition number.
ROUNDING = 1e-9


AnyBound = TypeVar("AnyBound", bound="Bound")


class Exit(NamedTuple):
    """The point at which a line leaves the shape of a limit.

    Attributes:
        distance: from the start of the line [m].
        worst: distance at which the line is farthest outside, or near to it; infinite if it gets
            ever farther [m].
    """

    distance: float
    worst: float = inf


@dataclass(frozen=True)
class Bound(ABC):
    """One limit of a quantity that depends on the place of the platform.

    Attributes:
        limit: what it is.
        arm: index of the arm that it belongs to.
        bound: of the quantity [m].
        side: 1 if the quantity has to stay below the bound, -1 if above.
    """

    limit: WorkspaceLimit
    arm: int | None
    bound: float
    side: float

    @abstractmethod
    def value(self, position: Vector3) -> float:
        """Return the quantity [m]."""

    def values(self, places: FloatArray) -> FloatArray:
        """Return the quantity at many places, shape (n, 3) [m]. Shape (n,) [m]."""
        return np.array([self.value((x, y, z)) for x, y, z in places.tolist()])

    @abstractmethod
    def exit(self, start: Vector3, direction: Vector3) -> Exit | None:
        """Return where a line from inside passes the edge, if ever; ``direction`` is a unit."""

    @property
    def is_level(self) -> bool:
        """Whether the quantity is the height of the platform alone."""
        return False

    @property
    def edge(self) -> float:
        """The end of lines [m]: so far beyond the bound that they may end on it.

        It is nearer than what is granted to places, so that the end of a cut line is one inside.
        """
        return self.bound + 0.5 * self.side * ROUNDING

    def slack(self, position: Vector3) -> float:
        """Return by how much the bound is kept at a place, negative if it is broken [m]."""
        return self.side * (self.bound - self.value(position))

    def check(self, position: Vector3) -> None:
        """Raise an ``OutsideWorkspaceError`` if the bound is broken at a place."""
        if not self.slack(position) >= -ROUNDING:
            raise self.error(position, self.value(position))

    def error(self, position: Vector3, value: float) -> OutsideWorkspaceError:
        """Return the error for a ``value`` found on the way on from a place."""
        return OutsideWorkspaceError(self.limit, self.arm, position, value, self.bound)

    def widened_to(self: AnyBound, position: Vector3) -> AnyBound:
        """Return this bound, moved to where it just holds at a place if it does not."""
        if self.slack(position) >= 0.0:
            return self
        return replace(self, bound=self.value(position))


@dataclass(frozen=True)
class Disc(Bound):
    """The platform stays near an upright axis at ``x``, ``y`` [m]."""

    x: float
    y: float

    def value(self, position: Vector3) -> float:
        """Return the horizontal distance from the axis [m]."""
        return hypot(position[0] - self.x, position[1] - self.y)

    def values(self, places: FloatArray) -> FloatArray:
        """Return the horizontal distances from the axis. Shape (n,) [m]."""
        return np.asarray(np.hypot(places[:, 0] - self.x, places[:, 1] - self.y))

    def exit(self, start: Vector3, direction: Vector3) -> Exit | None:
        """Return where a line leaves the disc."""
        x, y = start[0] - self.x, start[1] - self.y
        a = direction[0] * direction[0] + direction[1] * direction[1]
        if a == 0.0:
            return None
        b = x * direction[0] + y * direction[1]
        squared = b * b + a * (self.edge * self.edge - x * x - y * y)
        return Exit(max(0.0, (sqrt(max(0.0, squared)) - b) / a))


@dataclass(frozen=True)
class Face(Bound):
    """The platform stays on one side of a plane across the coordinate ``axis``."""

    axis: int

    def value(self, position: Vector3) -> float:
        """Return the coordinate [m]."""
        return position[self.axis]

    def values(self, places: FloatArray) -> FloatArray:
        """Return the coordinates. Shape (n,) [m]."""
        return places[:, self.axis]

    @property
    def is_level(self) -> bool:
        """Whether the plane is level."""
        return self.axis == 2

    def exit(self, start: Vector3, direction: Vector3) -> Exit | None:
        """Return where a line passes through the plane."""
        rate = direction[self.axis]
        if self.side * rate <= 0.0:
            return None
        return Exit(max(0.0, (self.edge - start[self.axis]) / rate))


@dataclass(frozen=True)
class TravelEnd(Bound):
    """A slider over the anchor ``x``, ``y`` with an arm of some ``length`` [m] has an end."""

    x: float
    y: float
    length: float

    def value(self, position: Vector3) -> float:
        """Return the height of the slider [m]; beyond reach, as if the arm lay level."""
        x, y = position[0] - self.x, position[1] - self.y
        return position[2] + sqrt(max(0.0, self.length * self.length - x * x - y * y))

    def exit(self, start: Vector3, direction: Vector3) -> Exit | None:
        """Return where a line leaves the sphere of the lower end, or enters that of the upper."""
        x, y, z = start[0] - self.x, start[1] - self.y, start[2] - self.edge
        along = x * direction[0] + y * direction[1] + z * direction[2]
        outside = x * x + y * y + z * z - self.length * self.length
        squared = along * along - outside
        # A start that is inside by grace of the rounding only, on the wrong side of the sphere.
        if z < 0.0 and self.side * outside < 0.0:
            if self.side * along < 0.0 or squared < 0.0:
                return Exit(0.0, -along if self.side > 0.0 else inf)
            if self.side > 0.0:
                return None
        if squared < 0.0:
            return None
        distance = -self.side * sqrt(squared) - along
        if distance < 0.0 or z + distance * direction[2] > 0.0:
            return None
        return Exit(distance, -along if self.side > 0.0 else inf)


@dataclass(frozen=True)
class WorkspaceBounds:
    """The limits of a workspace.

    Attributes:
        shapes: that bound the platform: discs and faces.
        travel: lower ends of the three sliders, then upper ends.
        condition: largest condition number of the Jacobian.
    """

    shapes: tuple[Bound, ...]
    travel: tuple[TravelEnd, ...]
    condition: float

    @classmethod
    def from_limits(cls, geometry: TriGlideGeometry, limits: WorkspaceLimits) -> WorkspaceBounds:
        """Return the shapes of ``limits``."""
        arms = list(zip(range(3), geometry.anchors, geometry.arm_lengths))
        shapes: list[Bound] = [
            Disc(WorkspaceLimit.REACH, arm, length - limits.reach_margin, 1.0, x, y)
            for arm, (x, y), length in arms
        ]
        sides = (WorkspaceLimit.BOX_X, WorkspaceLimit.BOX_Y, WorkspaceLimit.BOX_Z)
        for corner, side in ((limits.box_lower, -1.0), (limits.box_upper, 1.0)):
            shapes += [
                Face(limit, None, bound, side, axis)
                for axis, (limit, bound) in enumerate(zip(sides, corner or ()))
            ]
        cylinder = limits.cylinder
        if cylinder:
            center = cylinder.center_x, cylinder.center_y
            round_about, ends = WorkspaceLimit.CYLINDER_RADIUS, WorkspaceLimit.CYLINDER_Z
            shapes += [
                Disc(round_about, None, cylinder.radius, 1.0, *center),
                Face(ends, None, cylinder.z_min, -1.0, 2),
                Face(ends, None, cylinder.z_max, 1.0, 2),
            ]
        travel: list[TravelEnd] = []
        for limit, heights, side in (
            (WorkspaceLimit.LOWER_TRAVEL, limits.lower_heights, -1.0),
            (WorkspaceLimit.UPPER_TRAVEL, limits.upper_heights, 1.0),
        ):
            travel += [
                TravelEnd(limit, arm, heights[arm], side, x, y, length)
                for arm, (x, y), length in arms
            ]
        return cls(tuple(shapes), tuple(travel), limits.max_condition_number)

    @property
    def level_ends(self) -> tuple[float, float]:
        """Lower and upper end of box and cylinder; infinite without them [m]."""
        levels = [shape for shape in self.shapes if shape.is_level]
        lower = max((shape.bound for shape in levels if shape.side < 0.0), default=-inf)
        upper = min((shape.bound for shape in levels if shape.side > 0.0), default=inf)
        return lower, upper

    def widened_to(self, position: Vector3, condition: float) -> WorkspaceBounds:
        """Return the same bounds, those that exclude a place moved to where it is."""
        return WorkspaceBounds(
            tuple(shape.widened_to(position) for shape in self.shapes),
            tuple(end.widened_to(position) for end in self.travel),
            max(self.condition, condition),
        )

    def first_exit(self, start: Vector3, direction: Vector3) -> tuple[Bound, Exit]:
        """Return where a line from a place inside first leaves a shape or the travel.

        Each line does: a level one leaves the reach, any other one the travel.
        """
        exits = [(bound, bound.exit(start, direction)) for bound in (*self.shapes, *self.travel)]
        found = [(bound, one) for bound, one in exits if one is not None]
        least = min(one.distance for _, one in found)
        # Which of several limits in a corner is named is not left to rounding.
        return next(pair for pair in found if pair[1].distance <= least + ROUNDING)

    def slack(self, position: Vector3) -> float:
        """Return the least distance to one of the shapes, negative outside [m]."""
        return min(shape.slack(position) for shape in self.shapes)

    def travel_slack(self, heights: Vector3) -> float:
        """Return the least distance of a slider to an end of its travel, negative beyond [m]."""
        return min(
            min(height - lower.bound, upper.bound - height)
            for height, lower, upper in zip(heights, self.travel[:3], self.travel[3:])
        )

    def travel_slacks(self, heights: FloatArray) -> FloatArray:
        """Return the same for many heights, shape (n, 3) [m]. Shape (n,) [m]."""
        lower, upper = np.array([end.bound for end in self.travel]).reshape(2, 3)
        return np.asarray(np.minimum(heights - lower, upper - heights).min(axis=1))


def slacks(shapes: Sequence[Bound], places: FloatArray) -> FloatArray:
    """Return the least distance to one of the ``shapes``, negative outside; inf without one.

    Args:
        shapes: that bound the platform.
        places: of the platform. Shape (n, 3) [m].

    Returns:
        Shape (n,) [m].
    """
    least = np.full(len(places), inf)
    for shape in shapes:
        np.minimum(least, shape.side * (shape.bound - shape.values(places)), out=least)
    return least


# Largest way out of the workspace that tracing leaves between its samples [m].
PLACE_TOLERANCE = 6e-5

# Places of a grid along each axis.
PLACES_ALONG = 9


class Overruns(NamedTuple):
    """By how much each row passes the limits; what is negative is inside. Not finite is outside.

    Attributes:
        travel: of the sliders. Shape (n,) [m].
        reach: of the arms. Shape (n,) [m].
        place: of box and cylinder; -inf where there is neither. Shape (n,) [m].
        condition: condition number, as a part of the largest one, less 1: the smaller one of the
            place itself and of one that is nearer to the axis by ``PLACE_TOLERANCE``. Shape (n,).
    """

    travel: FloatArray
    reach: FloatArray
    place: FloatArray
    condition: FloatArray

    @property
    def are_outside(self) -> BoolArray:
        """Whether each row passes a limit by more than its tolerance. Shape (n,)."""
        are_inside = [values <= most for values, most in zip(self, OVERRUN_TOLERANCES)]
        return ~np.logical_and.reduce(are_inside)


# A motion that was verified passes no limit by more: travel is checked exactly.
OVERRUN_TOLERANCES = (1e-8, PLACE_TOLERANCE, PLACE_TOLERANCE, 1e-6)


def overruns(machine: TriGlide, limits: WorkspaceLimits, heights: ArrayLike) -> Overruns:
    """Return by how much slider heights pass ``limits``.

    Args:
        machine: whose sliders they are.
        limits: of travel and workspace.
        heights: Shape (n, 3) [m].

    Raises:
        WrongShapeError: if ``heights`` has another shape.
    """
    rows = array_of_shape("heights", heights, (None, 3))
    positions = machine.forward_batch(rows)
    bounds = WorkspaceBounds.from_limits(machine.geometry, limits)
    # The shapes of the three arms come first.
    reach, place = slacks(bounds.shapes[:3], positions), slacks(bounds.shapes[3:], positions)
    inwards = positions * np.array((1.0, 1.0, 0.0))
    sizes = np.maximum(np.hypot(*positions[:, :2].T), PLACE_TOLERANCE)
    nearer = positions - inwards * (PLACE_TOLERANCE / sizes)[:, np.newaxis]
    conditions = np.minimum(*map(machine.condition_number_batch, (positions, nearer)))
    condition = conditions / limits.max_condition_number - 1.0
    return Overruns(-bounds.travel_slacks(rows), -reach, -place, condition)


def places_inside(machine: TriGlide, limits: WorkspaceLimits) -> FloatArray:
    """Return places of the platform inside ``limits``, spread over all of it with its corners.

    They are those of a grid over the travel of the sliders, and of one over box or cylinder.

    Returns:
        Shape (n, 3) [m].
    """
    travel = zip(limits.lower_heights, limits.upper_heights)
    heights = _grid(*(np.linspace(*ends, PLACES_ALONG) for ends in travel))
    if limits.box_lower is not None and limits.box_upper is not None:
        ends = zip(limits.box_lower, limits.box_upper)
        positions = _grid(*(np.linspace(*pair, PLACES_ALONG) for pair in ends))
        heights = np.concatenate((heights, machine.inverse_batch(positions)))
    if limits.cylinder is not None:
        cylinder = limits.cylinder
        radii = cylinder.radius * np.array((0.0, 0.5, 1.0))
        angles = np.linspace(0.0, 2.0 * math.pi, 2 * PLACES_ALONG, endpoint=False)
        levels = np.linspace(cylinder.z_min, cylinder.z_max, PLACES_ALONG)
        radius, angle, z = _grid(radii, angles, levels).T
        x = cylinder.center_x + radius * np.cos(angle)
        y = cylinder.center_y + radius * np.sin(angle)
        heights = np.concatenate((heights, machine.inverse_batch(np.stack((x, y, z), axis=1))))
    heights = heights[np.isfinite(heights).all(axis=1)]
    inside = heights[~overruns(machine, limits, heights).are_outside]
    return machine.forward_batch(inside)


def _grid(*axes: FloatArray) -> FloatArray:
    """Return all combinations of numbers of three ``axes``. Shape (n, 3)."""
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
