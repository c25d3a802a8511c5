r"""What bounds all motion besides the limits of the sliders, and the proof that a motion keeps it.

An added bound says which part of it a motion uses at most in short cells of time. It is given the
Taylor series of the platform's position there, with bounds of what they leave out (``series.py``).
So the proof is one of bounds, not of samples, for lines, slider moves, paths, steps of tracking and
stops alike. A new bound is one class; ``SliderLimits.added`` holds those in force.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeVar

import numpy as np

from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.interruptible import Interruptible, blocks
from tri_glide_kinematics.motion.trajectory.errors import AddedBoundError
from tri_glide_kinematics.motion.trajectory.knots import ascending
from tri_glide_kinematics.motion.trajectory.limits import RELATIVE_ROUNDING, SliderLimits
from tri_glide_kinematics.motion.trajectory.series import (
    Series,
    divided,
    polynomial,
    position_of,
    product,
    quartered,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.trajectory.trajectory import SliderState, Trajectory

Motion = TypeVar("Motion", bound="Trajectory")

# So many cells are looked at between two breaks: that takes a millisecond at most.
CELLS_AT_ONCE = 64

# Between two knots there are so many at first, at most.
_CELLS_BETWEEN = 4

# How much is used is known to this part, where it is more than is allowed.
_CLOSE = 1e-6

# A motion leaves this part of a bound beyond what it exceeded, so that the next one keeps it; and
# with each attempt so many times as much.
_SPARE = 1e-6
_MORE_TO_SPARE = 3.0

# Cells are not made shorter than this [s].
_SHORTEST = 0.0005


class UsedParts(NamedTuple):
    """Which part of an added bound a motion uses in n cells.

    Attributes:
        most: anywhere in the cells, by bounds; NaN where none is known. Shape (n,).
        middle: in the middles of the cells, but for rounding. Shape (n,).
    """

    most: FloatArray
    middle: FloatArray


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
        order: 1 if a motion in n times the time uses an nth of it, 2 if the square of that.
    """

    machine: TriGlide
    name: ClassVar[str]
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
        at_once = np.zeros(1)
        heights, rates, accelerations = (np.array(each)[:, np.newaxis] for each in state)
        series = polynomial(np.array((heights, rates, 0.5 * accelerations)), at_once)
        position = position_of(self.machine, series, at_once)
        return float(np.nan_to_num(self.used(position, at_once).middle[0], nan=inf))

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

    @property
    def machine(self) -> TriGlide:  # type: ignore[override]
        """Whose motion it bounds."""
        return self.bound.machine

    @property
    def name(self) -> str:  # type: ignore[override]
        """As that of the other bound."""
        return self.bound.name

    @property
    def order(self) -> int:  # type: ignore[override]
        """As that of the other bound."""
        return self.bound.order

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


@dataclass(frozen=True)
class PlatformSpeedLimit(AddedBound):
    """A largest speed of the platform.

    Attributes:
        machine: whose platform it is.
        speed: [m/s].
    """

    name = "a platform speed limit"
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

    def error(self, part: float, time: float) -> AddedBoundError:
        """Return the error with the speed and the limit."""
        value = part * self.speed
        return AddedBoundError("speed of the platform", value, self.speed, "m/s", time)


def largest_value(coefficients: FloatArray, rest: FloatArray, half: FloatArray) -> FloatArray:
    """Return upper bounds of polynomials of the third degree, and a rest, in cells. Shape (n,).

    Args:
        coefficients: of ascending powers of the time from the middles. Shape (4, n).
        rest: bound of the absolute coefficient of the fourth power. Shape (n,).
        half: of the lengths of the cells. Shape (n,) [s].
    """
    c0, c1, c2, c3 = coefficients
    # A parabola that has its top inside; else it is largest at an end.
    top_inside = np.abs(c1) < -2.0 * c2 * half
    top = -0.25 * c1 * c1 / np.where(top_inside, c2, -1.0)
    parabola = np.where(top_inside, top, np.abs(c1) * half + c2 * half * half)
    return np.asarray(c0 + parabola + (np.abs(c3) + rest * half) * half**3)


class AddedUse(NamedTuple):
    """How much of an added bound a motion uses at most, by bounds.

    Attributes:
        part: an upper bound; NaN where nothing is known.
        time: when [s].
    """

    part: float
    time: float


def added_use(
    trajectory: Trajectory, bound: AddedBound, since: float = 0.0, until: float = inf
) -> Interruptible[AddedUse]:
    """Return which part of an added ``bound`` a motion uses at most between two instants [s].

    Where it may be exceeded, cells are made smaller, and so the bounds. Where a middle uses more
    than is allowed, no cell is made smaller that cannot use more than that. So only cells about the
    largest use are, and there are few of them however long the motion takes.
    """
    edges = trajectory.knots()
    until = min(until, trajectory.duration)
    inside = edges[(edges > since) & (edges < until)]
    edges = ascending(np.concatenate(((since,), inside, (max(until, since),))))
    middles, half = divided(edges, _CELLS_BETWEEN)
    part, time, known = 0.0, since, 0.0
    while len(middles):
        most, middle = np.empty((2, len(middles)))
        for some in blocks(len(middles), CELLS_AT_ONCE):
            yield
            with np.errstate(invalid="ignore"):
                series = trajectory.platform_series(bound.machine, middles[some], half[some])
                most[some], middle[some] = bound.used(series, half[some])
        known = float(np.fmax(known, np.fmax.reduce(middle)))
        settled = (half <= 0.5 * _SHORTEST) | (most <= close_to(known))
        found = np.where(settled, most, 0.0)
        worst = int(found.argmax())
        # What is not known counts as more, and stays unknown.
        if not found[worst] <= part and part == part:
            part, time = float(found[worst]), float(middles[worst])
        middles, half = quartered(middles[~settled], half[~settled])
    return AddedUse(part, time)


def close_to(known: float | FloatArray) -> FloatArray:
    """Return what a cell may use at most, by bounds, so that no smaller ones are looked at.

    Args:
        known: which part is used somewhere. Of any shape, as the result.
    """
    part = np.where(known > 1.0 + RELATIVE_ROUNDING, known * (1.0 + _CLOSE), 1.0)
    return np.asarray(part * (1.0 + RELATIVE_ROUNDING))


class UsableParts(NamedTuple):
    """Which parts of the limits a motion from rest to rest can use where there are added bounds.

    Attributes:
        velocity: in (0, 1].
        rising: of the accelerations while it gets faster, in (0, 1].
        braking: of the accelerations while it gets slower, in (0, 1].
        slower: the whole motion takes so many times as long.
    """

    velocity: float = 1.0
    rising: float = 1.0
    braking: float = 1.0
    slower: float = 1.0

    def after(
        self, motion: Trajectory, fastest: float, limits: SliderLimits, attempt: int
    ) -> Interruptible[UsableParts]:
        """Return less, by as much as a ``motion`` with these exceeds the added bounds.

        Args:
            motion: from rest to rest.
            fastest: when it is so [s].
            limits: with the added bounds.
            attempt: how many there were before. Late ones are slower as a whole: that takes longer,
                but makes all forces smaller that come of the motion, those of its speed, too.

        Raises:
            AddedBoundError: if a part of a bound is not known.
        """
        velocity, rising, braking, slower = self
        spare = _SPARE * _MORE_TO_SPARE**attempt
        for bound in limits.added:
            before = yield from added_use(motion, bound, 0.0, fastest)
            behind = yield from added_use(motion, bound, fastest)
            first, last = before.part, behind.part
            for use in (before, behind):
                if use.part != use.part:
                    raise bound.error(use.part, use.time)
            if attempt >= _STRETCHED:
                slower /= _left(max(first, last), spare) ** (1.0 / bound.order)
            elif bound.order == 1:
                velocity *= _left(max(first, last), spare)
            else:
                rising, braking = rising * _left(first, spare), braking * _left(last, spare)
        return UsableParts(velocity, rising, braking, slower)


def _left(part: float, spare: float) -> float:
    """Return by which factor less is to be used where a ``part`` of a bound is."""
    return (1.0 - spare) / part if part > 1.0 + RELATIVE_ROUNDING else 1.0


# So often a motion is made with other parts of its limits, until it keeps the added bounds.
ATTEMPTS = 10

# From this attempt on the whole motion is made slower.
_STRETCHED = 5


def kept(
    plan: Callable[[UsableParts], tuple[Motion, float]], limits: SliderLimits
) -> Interruptible[Motion]:
    """Return a motion from rest to rest that is proved to keep all added bounds.

    Args:
        plan: makes the motion with parts of the limits, and tells when it is fastest [s].
        limits: with the added bounds.

    Raises:
        AddedBoundError: if a part of a bound is not known, or none keeps it after some attempts.
        KinematicsError: if there is no plan.
    """
    usable = UsableParts()
    motion, fastest = plan(usable)
    for attempt in range(ATTEMPTS if limits.added else 0):
        yield
        less = yield from usable.after(motion, fastest, limits, attempt)
        if less == usable:
            return motion
        usable = less
        motion, fastest = plan(usable)
    yield from check_added(motion, limits)
    return motion


# In motion where forces are bounded, one multiple after the other of the acceleration that they
# allow whichever way is tried, as the direction may allow more, and velocities ask for a part.
_MULTIPLES = (4.0, 2.0, 1.0, 0.5)


def gentler(limits: SliderLimits, state: SliderState) -> Iterator[SliderLimits]:
    """Yield ``limits``, and lower accelerations one after the other where forces are bounded.

    Args:
        limits: in force.
        state: where a motion begins; its accelerations stay within all of them.
    """
    yield limits
    allowed = min((bound.acceleration(state.heights) for bound in limits.added), default=inf)
    for multiple in _MULTIPLES:
        if multiple * allowed < limits.table[1].max():
            table = limits.table.copy()
            table[1] = np.minimum(table[1], np.maximum(multiple * allowed, np.abs(state[2])))
            yield limits.with_table(table)


def checked(motion: Motion, limits: SliderLimits, since: float = 0.0) -> Interruptible[Motion]:
    """Return a ``motion`` that keeps limits and added bounds; see ``Trajectory.check_limits``."""
    motion.check_sliders(limits, since)
    yield from check_added(motion, limits, since)
    return motion


def check_added(
    trajectory: Trajectory, limits: SliderLimits, since: float = 0.0
) -> Interruptible[None]:
    """Raise an error if a motion may exceed one of the added bounds from ``since`` [s] on.

    Raises:
        AddedBoundError: names what would be exceeded, and the bound.
    """
    for bound in limits.added:
        if since < trajectory.duration:
            use = yield from added_use(trajectory, bound, since)
            if not use.part <= 1.0 + RELATIVE_ROUNDING:
                raise bound.error(use.part, use.time)
