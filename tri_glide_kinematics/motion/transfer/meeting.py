r"""Legs that are carried: from station to station, of which one moves at least.

A leg is upright in the frame of the station that it leaves, then of the one that it comes to. Both
meet at an instant that depends on the leg, and the leg on the place that is met. So the instant is
found by iteration; where the sum exceeds a limit, the leg is made slower by as much.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.shaped import LimitBounds
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import PathPlan
from tri_glide_kinematics.motion.transfer.carried import Carriage, CarriedPlan
from tri_glide_kinematics.motion.transfer.legs import Leg, Station, TransferError, slope_of
from tri_glide_kinematics.motion.transfer.ways import (
    BESIDE,
    LEFT_IN_CHANGE,
    LEFT_TO_BASE,
    SPARE_HEIGHT,
    Ways,
    slowdown,
    upright,
)
from tri_glide_kinematics.vectors import Vector3, combined, dot, minus, plus, scaled

# A base leads to where the place is met, or so far from there [m]: the rest of the way is the
# frame's. After so many attempts there is none. At first it is guessed that so much of the time
# passes until the next station is met, or as much less that it takes to leave the last one.
AIMED = 0.012
ATTEMPTS = 12
PART_OF_GUESS = 0.05

# So often a base is planned for less of the limits that a leg exceeds, if it had to be slower by
# more than this factor else.
PLANNED_FOR_LESS, MUCH_SLOWER = 1, 1.015

# A leg that exceeds a limit is made slower by as much, and by this factor.
SPARE = 1.002

# The frame goes over from station to station in one of these parts of the time that it has: the
# longer it takes, the farther the base is beside the way of the platform.
PARTS_OF_LEG = (1.0, 0.5, 0.25)

# A leg is not made slower than by this factor.
SLOWEST = 1.6


class Instants(NamedTuple):
    """When a base does what [s].

    Attributes:
        arrival: at its end.
        upright: from when on it is upright above that.
        leaves: when it is no more upright above its start.
    """

    arrival: float
    upright: float
    leaves: float

    @classmethod
    def of(cls, base: PathPlan) -> Instants:
        """Return those of a ``base``."""
        return cls(base.duration, *upright(base))


class Crossing(NamedTuple):
    """How a frame goes over from one place to the next.

    Attributes:
        frame: how the place moves that is left, as of the start of the base.
        place: the next one, likewise.
        moves: whether the next one moves.
        part: of the time between that the frame takes, in (0, 1].
    """

    frame: MovingTarget
    place: MovingTarget
    moves: bool
    part: float

    def goes_over(self, instants: Instants) -> tuple[float, float]:
        """Return when it begins to go over to the next place, and when that is met [s]."""
        _, upright, leaves = instants
        time = self.part * (upright - leaves)
        # Where the next place rests, the frame of the one before is soon left.
        begin = upright - time if self.moves else leaves
        return begin, begin + time

    def ends(self, instants: Instants) -> tuple[Vector3, Vector3]:
        """Return how the frame is displaced at first, and where the base ends in it [m].

        In the middle between both places the base is where the platform is.
        """
        frame, place = self.frame, self.place
        begin, met = self.goes_over(instants)
        left, there, end = frame.after(begin), place.after(met), place.after(instants.arrival)
        way = plus(minus(left.position, frame.position), minus(there.position, end.position))
        way = combined(1.0, way, 0.5 * (met - begin), plus(left.velocity, there.velocity))
        bend = minus(left.acceleration, there.acceleration)
        way = combined(1.0, way, (met - begin) ** 2 / 12.0, bend)
        return scaled(way, -0.5), combined(1.0, end.position, -0.5, way)


class Aim(NamedTuple):
    """Where a base is to lead to, for when it is expected to do what.

    Attributes:
        crossing: of the frame.
        wait: before the base begins [s].
        instants: as they are expected.
        last: when it was to arrive before that, and by how much later it did [s]; None at first.
    """

    crossing: Crossing
    wait: float
    instants: Instants
    last: tuple[float, float] | None = None

    @property
    def way(self) -> tuple[Vector3, Vector3]:
        """Where the base begins and ends in the frame [m]."""
        first, goal = self.crossing.ends(self.instants)
        return minus(self.crossing.frame.position, first), goal

    def is_missed(self, found: Instants) -> bool:
        """Return whether a base does what it does at instants for which it leads elsewhere."""
        expected, ends = self.crossing.ends(self.instants), self.crossing.ends(found)
        return max(map(math.dist, ends, expected)) > AIMED

    def corrected(self, found: Instants, speed: float) -> Aim:
        """Return the next aim, after a base did what it does at other instants.

        How long it takes depends on where the place is met: a secant, or about that.

        Args:
            found: when it does what.
            speed: of the base, at most [m/s].
        """
        crossing, arrival = self.crossing, found.arrival
        expected = self.instants.arrival
        off = arrival - expected
        start, goal = self.way
        across = minus(goal, start)
        relative = minus(crossing.place.after(arrival).velocity, crossing.frame.velocity)
        slope = 0.5 * dot(across, relative) / math.hypot(*across)
        slope /= speed
        if self.last is not None and expected != self.last[0]:
            slope = (off - self.last[1]) / (expected - self.last[0]) + 1.0
        later = off / (1.0 - min(max(slope, -1.0), 0.5)) - off
        ratio = max(1.0 + later / (arrival - self.wait), 0.1)
        instants = Instants(*(self.wait + ratio * (each - self.wait) for each in found))
        return self._replace(instants=instants, last=(expected, off))


class Meeting:
    """Plans the leg to one station from the one before it."""

    def __init__(
        self, ways: Ways, frame: MovingTarget, station: Station, age: float, wait: float
    ) -> None:
        """Prepare for a ``station``.

        Args:
            ways: in the frame.
            frame: how the station moves that the platform is at.
            station: to be reached.
            age: time from that of the station to the begin of the leg [s].
            wait: rest in the frame before it begins [s].
        """
        self._ways, self._frame, self._station, self._wait = ways, frame, station, wait
        self._place, self._expected = station.after(age), station.after(age + wait)
        # Why there is no leg: what was found last, if anything was.
        self._refusal: KinematicsError = TransferError("the place is not met: it moves too fast")

    def leg(self, limits: SliderLimits) -> Interruptible[Leg]:
        """Return the leg, within ``limits``, which takes as long as it has to.

        Raises:
            KinematicsError: if there is none.
        """
        guess = self._ways.guess(self._frame.position, self._expected.position, limits)
        for part in PARTS_OF_LEG:
            leg, guess = yield from self._leg(limits, part, guess)
            if leg is not None:
                return leg
            yield
        raise self._refusal

    def _leg(
        self, limits: SliderLimits, part: float, guess: float
    ) -> Interruptible[tuple[Leg | None, float]]:
        """Return the same; the frame goes over in a ``part`` of the time that it has for it.

        Args:
            limits: of the sliders.
            part: in (0, 1].
            guess: how long the way takes, about [s].

        Returns:
            The leg, None if there is none; and how long the way takes, about [s].

        Raises:
            KinematicsError: if the place cannot be reached.
        """
        ways, wait, station, place = self._ways, self._wait, self._station, self._place
        region = ways.workspace
        changes = any(station.acceleration) or any(self._frame.acceleration)
        less = limits.times(*(LEFT_IN_CHANGE if changes else LEFT_TO_BASE))
        early, late = PART_OF_GUESS * guess, (1.0 - PART_OF_GUESS) * guess
        crossing = Crossing(self._frame, place, station.moves, part)
        aim = Aim(crossing, wait, Instants(wait + guess, wait + late, wait + early))
        first, _ = crossing.ends(aim.instants)
        higher = replace(ways, height=ways.height + SPARE_HEIGHT * abs(first[2]))
        natural: PathPlan | None = None
        stretch, planned = 1.0, 0
        for _ in range(ATTEMPTS):
            if natural is None:
                try:
                    natural = yield from ways.timed(higher.between(*aim.way), less)
                except KinematicsError as error:
                    region.check_position(place.after(aim.instants.arrival).position)
                    self._refusal = error
                    return None, guess
                guess = natural.duration
            # Where the base does not lead to just there, the frame does.
            base = PathPlan(natural.heights, natural.scaling.slower(stretch).delayed(wait))
            found = Instants.of(base)
            if aim.is_missed(found):
                aim, natural = aim.corrected(found, float(less.table[0].min())), None
                continue
            for instant in (found.arrival, found.arrival + station.dwell):
                region.check_position(place.after(instant).position)
            carried = self._carried(base, found, aim)
            spare = higher.spare(*aim.way, ways.height)
            sunk = -carried.carriage.lowest(found.leaves, found.upright)
            if sunk > spare + BESIDE:
                higher, natural = replace(ways, height=ways.height + SPARE_HEIGHT * sunk), None
                continue
            try:
                use = yield from carried.use_inside(region, limits)
            except KinematicsError as error:
                self._refusal = error
                return None, guess
            if use.keeps_limits:
                _, met = crossing.goes_over(found)
                slope, moves, ride = slope_of(station), station.moves, station.ride
                leg = Leg(carried, base, met, found.arrival, 0.0, slope, moves, ride, spare)
                return leg, guess
            slower = slowdown(use, limits)
            if slower > MUCH_SLOWER and planned < PLANNED_FOR_LESS:
                # Less of the limits that are exceeded costs less time than to be slower everywhere.
                planned += 1
                less, natural = _less_of(less, use), None
                continue
            # What the frame takes gets less only slowly.
            stretch *= (slower if stretch == 1.0 else slower * slower) * SPARE
            if not stretch < SLOWEST:
                break
            yield
        return None, guess

    def _carried(self, base: PathPlan, found: Instants, aim: Aim) -> CarriedPlan:
        """Return a ``base``, carried, to where it is aimed at."""
        first, goal = aim.crossing.ends(aim.instants)
        begin, met = aim.crossing.goes_over(found)
        present = self._frame._replace(position=first)
        begins = [(0.0, present)]
        if begin > 0.0:
            begins.append((begin, present.after(begin)))
        end = found.arrival + self._station.ride
        carriage = Carriage.onto(begins, self._place, goal, (met, found.arrival, end))
        return CarriedPlan(self._ways.workspace.machine, base, carriage, end)


def _less_of(limits: SliderLimits, use: LimitBounds) -> SliderLimits:
    """Return less of the ``limits`` that a motion exceeds, which makes this ``use`` of all."""
    table = limits.table / np.maximum(use.use, 1.0)
    added = (each.times(1.0 / max(part, 1.0)) for each, part in zip(limits.added, use.added))
    return limits.with_table(table).with_added(*added)
