"""The machine that is wished for: found on grids that get ever finer, then proved.

The unknowns are the difference of the radii and the angle of the arms where they lie flattest; the
length of the arms follows. A machine is tried at some places of the volume. The one that is found
is proved over all of it; where the proof finds a worse place, that is tried, too, and the search is
done again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.checks import member
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.sizing.fields import TIGHTNESS
from tri_glide_kinematics.sizing.sizing import (
    DEMANDS,
    Needs,
    Sizing,
    field_bounds,
    needs,
    sizing_of,
    span_of,
)
from tri_glide_kinematics.sizing.wish import Demand, Objective, Wish, distances, some_places
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text

# Differences of the radii that are looked at, as parts of the farthest distance of the volume from
# the axis, or of what a large clearance needs; the other ranges only where nothing is found in the
# first. Angles of the arms [rad].
DIFFERENCES = ((0.05, 10.0), (10.0, 2000.0), (2.5e-4, 0.05))
ANGLES = (math.radians(1.0), math.radians(88.0))

# The first grid, and the finer ones around its best machines.
FIRST_GRID = 45
FINE_GRID = 11
STARTS = 4
# Each round shrinks the grid to this part: after all of them it is 1e-4 of the first one.
ROUNDS = 18
SHRINKING = 0.6

# Places times machines that are worked through at once.
TOGETHER = 60_000

# Room that a machine leaves to each demand, so that it can be proved.
ROOM = 2.0 * TIGHTNESS
# Attempts to prove a machine: each adds the places where the one before failed.
ATTEMPTS = 8

# How tight bounds are of a machine that does not do what is wished.
ROUGHLY = 2e-3

# Machines with rounded lengths of which so many are proved at most.
MOST_ROUNDINGS = 3

# A nearest possible wish is loosened by this more than it has to be.
MORE_THAN_NEEDED = 2e-3

# The nearest possible wish has a machine with at most this condition number: beyond it the cells of
# a proof get too small.
PROVABLE = 8.0

# A machine that is not possible is worse than every one that is.
NOT_POSSIBLE = 1e12


class Stop(NamedTuple):
    """A demand that cannot be met together with others.

    Attributes:
        demand: that is meant.
        wanted: what the wish allows.
        possible: what the nearest possible wish allows.
    """

    demand: Demand
    wanted: float
    possible: float

    def __str__(self) -> str:
        """Return it in words."""
        unit = f" {self.demand.unit}" if self.demand.unit else ""
        return (
            f"{self.demand.value} = {number_text(self.wanted, 6)}{unit} "
            f"({number_text(self.possible, 6)}{unit} would do)"
        )


class ImpossibleWishError(KinematicsError):
    """No symmetric machine does what is wished."""

    def __init__(self, stops: tuple[Stop, ...], nearest: Wish) -> None:
        """Store the demands that stop it and the nearest possible wish.

        Args:
            stops: the demands that all have to be loosened.
            nearest: the same wish with these demands loosened, the largest factor of which is as
                small as it can be.
        """
        demands = " and ".join(map(str, stops))
        super().__init__(f"no machine does all that is wished: it is too much for {demands}")
        self.stops = stops
        self.nearest = nearest


def size(wish: Wish, objective: Objective = Objective.SIZE) -> Sizing:
    """Return the best symmetric machine for a wish, proved over the whole volume.

    Args:
        wish: what the machine has to do.
        objective: what is to be least.

    Raises:
        NotAChoiceError: if ``objective`` is no ``Objective``.
        ImpossibleWishError: if no machine does what is wished; it has the nearest possible wish.
    """
    member("objective", objective, Objective)
    search = _Search(wish)
    limit = 1.0 - ROOM
    is_possible = False
    for _ in range(ATTEMPTS):
        least = search.nearest(limit)
        if least.worst > limit:
            if is_possible:
                break
            proved = search.proved(least, ROUGHLY)
            if proved.worst <= least.worst * (1.0 + 2.0 * ROUGHLY):
                raise _impossible(wish, proved.needs)
            if _is_beyond_proof(proved):
                raise _impossible(wish, search.needs_of(least))
            search.add_places(proved)
            continue
        is_possible = True
        found = search.best(
            lambda found: np.where(
                found.worst <= limit, found.of(objective), NOT_POSSIBLE * found.worst
            )
        )
        proved = search.proved(found)
        if proved.worst <= 1.0:
            return search.rounded(proved, objective)
        if _is_beyond_proof(proved):
            if search.is_to_be_proved:
                break
            search.is_to_be_proved = True
        search.add_places(proved)
    condition = f"a condition number of {proved.extremes.values[0]:.4g} somewhere, too large for it"
    raise KinematicsError(f"nothing is proved: the best machine found has {condition}")


def _is_beyond_proof(proved: Sizing) -> bool:
    """Tell whether a machine has finite numbers at all places tried, and no bounds."""
    return bool(
        np.isinf(proved.extremes.bounds).any() and np.isfinite(proved.extremes.values).all()
    )


class _Found(NamedTuple):
    """A machine on a grid: its difference of radii [m], arm length [m], and largest ratio."""

    difference: float
    length: float
    worst: float


class _Search:
    """Tries machines at places of a volume.

    Attributes:
        is_to_be_proved: whether machines that are too hard to prove are left out.
    """

    def __init__(self, wish: Wish) -> None:
        self._wish = wish
        self._places = some_places(wish.volume)
        extent = float(distances(wish.volume, np.zeros((1, 2)))[1][0])
        # A clearance asks for about as much where it is far larger than the volume.
        self._unit = max(extent, wish.clearance - extent)
        self._range = DIFFERENCES[0]
        self.is_to_be_proved = False
        flattest = min(ANGLES[0], 0.5 * wish.least_arm_angle)
        self._angles = flattest, max(ANGLES[1], 0.5 * (wish.least_arm_angle + 0.5 * math.pi))

    def add_places(self, proved: Sizing) -> None:
        """Try the worst places of a machine, too."""
        self._places = np.concatenate((self._places, proved.extremes.places))

    def proved(self, found: _Found, tightness: float = TIGHTNESS) -> Sizing:
        """Return a machine with what is proved of it."""
        radius = found.difference + self._wish.platform_radius
        return sizing_of(self._wish, radius, found.length, tightness)

    def rounded(self, proved: Sizing, objective: Objective) -> Sizing:
        """Return a machine with lengths in four digits that is about as good, if there is one."""
        step = 10.0 ** (math.floor(math.log10(proved.arm_length)) - 3)
        radii = _around(proved.base_radius, step)
        lengths = _around(proved.arm_length, step)
        pairs = [(radius, length) for radius in radii for length in lengths]
        tried = self._needs(*(np.array(pairs) - (self._wish.platform_radius, 0.0)).T)
        ranked = np.argsort(tried.of(objective), kind="stable").tolist()
        for index in [each for each in ranked if tried.worst[each] <= 1.0][:MOST_ROUNDINGS]:
            sizing = sizing_of(self._wish, *pairs[index])
            if sizing.worst <= 1.0:
                return sizing
        return proved

    def nearest(self, limit: float) -> _Found:
        """Return a machine that needs at most this part of what is allowed.

        If there is none: of those that can be proved, the one that needs least.
        """
        while True:
            found = []
            for self._range in DIFFERENCES:
                found.append(self.best(lambda needed: needed.worst))
                if found[-1].worst <= limit:
                    return found[-1]
            if self.is_to_be_proved:
                return min(found, key=lambda each: each.worst)
            self.is_to_be_proved = True

    def needs_of(self, found: _Found) -> Needs:
        """Return what a machine needs at the places that are tried."""
        return self._needs(np.array([found.difference]), np.array([found.length]))

    def best(self, merit: Callable[[Needs], FloatArray]) -> _Found:
        """Return the machine with the least ``merit``."""
        low, high = np.array((np.log(self._range), self._angles)).T
        grid, merits = self._tried(low, high, FIRST_GRID, merit)
        cell = (high - low) / (FIRST_GRID - 1)
        starts: list[FloatArray] = []
        for index in np.argsort(merits, kind="stable"):
            apart = [np.abs((grid[index] - start) / cell).max() for start in starts]
            if min(apart, default=math.inf) > 2.5:
                starts.append(grid[index])
            if len(starts) == STARTS:
                break
        ends = [self._refined(start, 1.5 * cell, low, high, merit) for start in starts]
        point, _ = min(ends, key=lambda end: end[1])
        differences, lengths = self._machines(point[np.newaxis])
        worst = float(self._needs(differences, lengths).worst[0])
        return _Found(float(differences[0]), float(lengths[0]), worst)

    def _refined(
        self,
        start: FloatArray,
        half: FloatArray,
        low: FloatArray,
        high: FloatArray,
        merit: Callable[[Needs], FloatArray],
    ) -> tuple[FloatArray, float]:
        """Return the best point near a start, and its merit."""
        point, least = start, math.inf
        for _ in range(ROUNDS):
            lower, upper = np.maximum(point - half, low), np.minimum(point + half, high)
            grid, merits = self._tried(lower, upper, FINE_GRID, merit)
            index = int(merits.argmin())
            if merits[index] < least:
                point, least = grid[index], float(merits[index])
            half = SHRINKING * half
        return point, least

    def _tried(
        self,
        low: FloatArray,
        high: FloatArray,
        count: int,
        merit: Callable[[Needs], FloatArray],
    ) -> tuple[FloatArray, FloatArray]:
        axes = [np.linspace(a, b, count) for a, b in zip(low, high)]
        grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        return grid, merit(self._needs(*self._machines(grid)))

    def _machines(self, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return differences of the radii and arm lengths of points of a grid. (n,) each [m]."""
        differences = self._unit * np.exp(grid[:, 0])
        farthest = span_of(self._wish.volume, self._wish.orientation, differences)[1]
        return differences, farthest / np.cos(grid[:, 1])

    def _needs(self, differences: FloatArray, lengths: FloatArray) -> Needs:
        count, machines = len(self._places), len(differences)
        size = max(1, TOGETHER // count)
        parts = []
        for start in range(0, machines, size):
            some = slice(start, start + size)
            number = len(differences[some])
            tried = field_bounds(
                self._wish,
                np.repeat(differences[some], count),
                np.repeat(lengths[some], count),
                np.tile(self._places, (number, 1)),
                0.0,
            )
            parts.append(tried.reshape(3, number, count).max(axis=2))
        largest = np.concatenate(parts, axis=1)
        if self.is_to_be_proved:
            largest[:, ~(largest[0] <= PROVABLE)] = np.inf
        return needs(self._wish, differences, lengths, largest)


def _around(value: float, step: float) -> list[float]:
    """Return the multiples of a step that are nearest to a value, two on each side."""
    first = math.floor(value / step)
    digits = max(0, -round(math.log10(step)))
    return [round((first + k) * step, digits) for k in range(-1, 3)]


def _impossible(wish: Wish, least: Needs) -> ImpossibleWishError:
    """Return the error about a wish, for what the machine needs that comes nearest to it."""
    stops = []
    nearest = wish
    for demand, ratio in zip(DEMANDS, least.ratios[:, 0].tolist()):
        if ratio > 1.0 - ROOM:
            nearest = nearest.loosened(demand, max(1.0, ratio) * (1.0 + MORE_THAN_NEEDED))
            wanted, possible = getattr(wish, demand.value), getattr(nearest, demand.value)
            stops.append(Stop(demand, wanted, possible))
    return ImpossibleWishError(tuple(stops), nearest)
