r"""What the drives of the three sliders are allowed to do, and what else bounds all motion.

An added bound says which part of it a motion uses at most in short cells of time. It is given the
Taylor series of the platform's position there, with bounds of what they leave out (``series.py``).
So the proof is one of bounds, not of samples, for lines, slider moves, paths, steps of tracking and
stops alike. A new bound is one class; ``SliderLimits.added`` holds those in force.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import ClassVar, NamedTuple

import numpy as np

from tri_glide_kinematics.checks import checked_vector, positive
from tri_glide_kinematics.motion.errors import AddedBoundError
from tri_glide_kinematics.motion.limits.series import Series, polynomial, position_of
from tri_glide_kinematics.motion.limits.setpoint import SliderState
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3

QUANTITIES = (("velocity", "m/s"), ("acceleration", "m/s^2"), ("jerk", "m/s^3"))

# A bound may be exceeded by this fraction of it: rounding.
RELATIVE_ROUNDING = 1e-8

# A slider may pass an end of its travel by this: rounding [m].
TRAVEL_ROUNDING = 1e-9

# By differences, a motion may use more of a bound than by derivatives, by this part of it times the
# square of the period: they leave out how it changes from one setpoint to the next [1/s^2].
DIFFERENCES_TOLERANCE = 1e3

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
            checked = checked_vector(name, getattr(self, name), positive, unit)
            object.__setattr__(self, name, checked)

    @classmethod
    def uniform(cls, velocity: float, acceleration: float, jerk: float) -> SliderLimits:
        """Return equal limits for all three sliders [m/s, m/s^2, m/s^3]."""
        return cls((velocity,) * 3, (acceleration,) * 3, (jerk,) * 3)

    @cached_property
    def table(self) -> FloatArray:
        """Velocity, acceleration and jerk of all sliders; read-only. Shape (3, 3)."""
        table = np.array((self.velocity, self.acceleration, self.jerk))
        table.setflags(write=False)
        return table

    @cached_property
    def of_sliders(self) -> tuple[Vector3, ...]:
        """Velocity, acceleration and jerk of each slider in turn, in plain floats."""
        return tuple(zip(self.velocity, self.acceleration, self.jerk))

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

    def check_holding(self, positions: FloatArray) -> None:
        """Check that the added bounds allow rest.

        Args:
            positions: of the platform. Shape (n, 3) [m].

        Raises:
            CannotHoldError: names the slider, the force that it needs, and the limit.
        """
        for bound in self.added:
            bound.check_holding(positions)

    def times(self, velocity: float, acceleration: float, jerk: float) -> SliderLimits:
        """Return the limits multiplied by a number for each quantity."""
        factors = np.array(((velocity,), (acceleration,), (jerk,)))
        return self.with_table(factors * self.table)


class UsedParts(NamedTuple):
    """Which part of an added bound a motion uses in n cells.

    Attributes:
        most: anywhere in the cells, by bounds; NaN where none is known. Shape (n,).
        middle: in the middles of the cells, but for rounding. Shape (n,).
    """

    most: FloatArray
    middle: FloatArray


class SeenParts(NamedTuple):
    """Which part of an added bound n setpoints use, as differences of their heights tell.

    Attributes:
        parts: of the bound; NaN where there is no pose. Shape (n,).
        tolerance: by which a part may be above 1, as differences are no derivatives.
        text: what is used in a row, in words.
    """

    parts: FloatArray
    tolerance: float
    text: Callable[[int], str]


class PathPlaces(NamedTuple):
    """n places on a path.

    Attributes:
        positions: Shape (3, n) [m].
        tangents: their derivatives by the parameter u of the path. Shape (3, n).
        curvatures: the second derivatives. Shape (3, n).
        speed: that u may have there, about. Shape (n,).
    """

    positions: FloatArray
    tangents: FloatArray
    curvatures: FloatArray
    speed: FloatArray


class PathRows(NamedTuple):
    r"""What a bound asks of the timing of a path, at each of n places.

    It is kept where $a \ddot u + b \dot u^2 \le 1$ for each of k rows.

    Attributes:
        acceleration: a. Shape (k, n).
        squared: b. Shape (k, n).
    """

    acceleration: FloatArray
    squared: FloatArray

    @classmethod
    def none(cls, count: int) -> PathRows:
        """Return no rows, at so many places."""
        return cls(*np.empty((2, 0, count)))


class AddedBound(ABC):
    """Something that bounds every motion besides the limits of the sliders.

    Attributes:
        machine: whose motion it bounds.
        name: in words.
        quantity: that it bounds, in words.
        order: 1 if a motion in n times the time uses an nth of it, 2 if the square of that.
    """

    machine: TriGlide
    name: ClassVar[str]
    quantity: ClassVar[str] = "added bound"
    order: ClassVar[int]

    @property
    def platform_speed(self) -> float:
        """Largest speed of the platform that it allows anywhere; inf if that depends [m/s]."""
        return inf

    def acceleration(self, heights: Vector3) -> float:
        """Return how fast all sliders may get faster, whichever way, at ``heights`` [m].

        It leaves out what velocities ask for; inf where it bounds velocities only [m/s^2].
        """
        return inf

    def check_holding(self, positions: FloatArray) -> None:  # noqa: B027
        """Check that it allows rest at ``positions``, (n, 3) [m]; see ``SliderLimits``."""

    @abstractmethod
    def used(self, position: Series, half: FloatArray) -> UsedParts:
        """Return which part of it is used.

        Args:
            position: of the platform in n cells. Shape (6, 3, n) [m].
            half: of the lengths of the cells. Shape (n,) [s].
        """

    def rows(self, places: PathPlaces, part: float = 1.0) -> PathRows:
        """Return what it asks of the timing of a path; nothing, where that is known otherwise.

        Args:
            places: on the path.
            part: of it that is allowed.
        """
        return PathRows.none(len(places.speed))

    @abstractmethod
    def error(self, part: float, time: float) -> AddedBoundError:
        """Return the error of a motion that would use a ``part`` of it above 1, at a ``time``."""

    def part_at(self, state: SliderState) -> float:
        """Return which part of it is used in one ``state``; infinite if that is not known."""
        (part,) = self._parts_at(*(np.array([each]) for each in state))
        return float(np.nan_to_num(part, nan=inf))

    def _parts_at(
        self, heights: FloatArray, rates: FloatArray, accelerations: FloatArray
    ) -> FloatArray:
        """Return which part of it is used in each state of the sliders. Shape (n,)."""
        at_once = np.zeros(len(heights))
        series = polynomial(np.array((heights.T, rates.T, 0.5 * accelerations.T)), at_once)
        return self.used(position_of(self.machine, series, at_once), at_once).middle

    def seen(self, heights: FloatArray, period: float, rounding: float) -> SeenParts:
        """Return which part of it recorded setpoints use, by their heights alone.

        A row tells of what was between it and the one before if ``order`` is 1; else it is the
        middle of three. So the first row tells nothing, and else the last one neither.

        Args:
            heights: a period after each other. Shape (n, 3) [m].
            period: [s].
            rounding: by which a height may be wrong; what that makes is no use of a bound, where a
                bound can tell it [m].
        """
        rates = np.diff(heights, axis=0, prepend=heights[:1]) / period
        if self.order == 1:
            parts = self._parts_at(heights - 0.5 * period * rates, rates, np.zeros(rates.shape))
        else:
            after = np.append(rates[1:], rates[-1:], axis=0)
            parts = self._parts_at(heights, 0.5 * (rates + after), (after - rates) / period)
        return SeenParts(
            parts,
            DIFFERENCES_TOLERANCE * period**2,
            lambda row: f"the motion uses {parts[row]:.6f} of {self.name}",
        )

    def times(self, part: float) -> AddedBound:
        """Return a bound that allows this ``part`` of it, in (0, 1]."""
        return self if part == 1.0 else PartOfBound(self, part)

    def raised(self, state: SliderState) -> AddedBound:
        """Return a bound that a motion from ``state`` on can keep: a part of one is raised to that.

        What is no part is returned as it is.
        """
        return self


@dataclass(frozen=True)
class PartOfBound(AddedBound):
    """A part of another bound: what plans keep, so that a shaper has the rest.

    Attributes:
        bound: the other one.
        part: of it, in (0, 1].
    """

    bound: AddedBound
    part: float

    def __post_init__(self) -> None:
        """Take over what both have in common."""
        for name in ("machine", "name", "order"):
            object.__setattr__(self, name, getattr(self.bound, name))

    @property
    def platform_speed(self) -> float:
        """Largest speed of the platform that it allows anywhere [m/s]."""
        return self.part * self.bound.platform_speed

    def acceleration(self, heights: Vector3) -> float:
        """Return how fast all sliders may get faster, whichever way, at ``heights`` [m]."""
        return self.part * self.bound.acceleration(heights)

    def used(self, position: Series, half: FloatArray) -> UsedParts:
        """Return which part of it is used."""
        most, middle = self.bound.used(position, half)
        return UsedParts(most / self.part, middle / self.part)

    def rows(self, places: PathPlaces, part: float = 1.0) -> PathRows:
        """Return what it asks of the timing of a path."""
        return self.bound.rows(places, part * self.part)

    def error(self, part: float, time: float) -> AddedBoundError:
        """Return the error of the other bound."""
        return self.bound.error(part, time)

    def times(self, part: float) -> AddedBound:
        """Return a bound that allows this ``part`` of it."""
        return self.bound.times(self.part * part)

    def raised(self, state: SliderState) -> AddedBound:
        """Return as large a part as is used in a ``state``, if that is more."""
        return self.bound.times(max(self.part, min(self.bound.part_at(state), 1.0)))
