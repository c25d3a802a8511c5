"""The limits of the workspace of a tri-glide: the numbers, checked as a set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from tri_glide_kinematics.checks import finite, finite_vector, non_negative, positive
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, Refusal
from tri_glide_kinematics.vectors import Vector3
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
