"""Which part a machine takes next from its belt, so that as many as possible are placed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

from tri_glide_kinematics.vectors import Vector3, combined, dot

# Of the parts that can be reached, so many are planned. More change nothing that is done next, and
# cost time.
AHEAD = 12

# A belt that is slower is at rest [m/s].
SLOWEST = 1e-6

# A belt may turn back for a while. A part that leaves the window backwards is passed on when it is
# so far away from it [m].
TURNED_BACK = 1.0

# Instants of a grip are as exact as that [s].
PRECISION = 1e-4
MOST_STEPS = 20

# For a stroke of this length, this part of the time is fixed; the rest grows with the length to
# this power.
STROKE, FIXED, POWER = 0.305, 0.45, 0.5

# Weight of a new time in the mean of the times of ways.
NEWEST = 0.2


class CycleTimes(NamedTuple):
    """How long the cycle of one part takes [s].

    Attributes:
        reach: from the last place until the platform arrives at the part.
        rest: from there until it may leave the place of the part.
    """

    reach: float
    rest: float


class WayTimes:
    """How long ways take, learnt from those that were driven."""

    def __init__(self, place: Vector3, first: float, dwells: tuple[float, float]) -> None:
        """Expect a ``first`` time for a usual stroke [s], from and to about one ``place`` [m]."""
        self._place, self._time, self._dwells = place, first, dwells

    def __call__(self, grip: Vector3, _velocity: float) -> CycleTimes:
        """Return the times of the cycle of a part that is gripped at a place [m]."""
        way = self._time * self._part(grip)
        return CycleTimes(way, self._dwells[0] + way + self._dwells[1])

    def note(self, grip: Vector3, taken: float) -> None:
        """Take in how long a way was ``taken`` to a part [s]."""
        self._time += NEWEST * (taken / self._part(grip) - self._time)

    def _part(self, grip: Vector3) -> float:
        stroke = math.dist(grip, self._place) / STROKE
        return FIXED + (1.0 - FIXED) * float(stroke**POWER)


class Pick(NamedTuple):
    """What is to be done next.

    Attributes:
        part: its number.
        leave_at: when the platform is to leave [s]. Until then another part may come up, so a
            machine that waits asks again.
        grip_at: when it arrives at the part [s].
        position: where that is, in the frame of the machine [m].
    """

    part: int
    leave_at: float
    grip_at: float
    position: Vector3


class Choice(NamedTuple):
    """The next part, and those that are passed on.

    Attributes:
        pick: None while there is no part that can be reached.
        passed: numbers of the parts that have left the window for good.
    """

    pick: Pick | None
    passed: tuple[int, ...]


class _Arrival(NamedTuple):
    """A part that is in the window from one instant to another."""

    until: float
    left: float  # of the way to the end of the window [m]
    number: int
    since: float
    position: Vector3  # now, in the frame of the machine


@dataclass(frozen=True)
class PickOrder:
    """Chooses parts for one machine at one belt.

    Attributes:
        direction: in which the belt ordinarily runs. Unit vector.
        window: the first and the last way along ``direction`` at which parts can be gripped, in
            the frame of the machine [m].
        cycle: of the position of a grip [m] and the velocity of the belt [m/s], its times.
    """

    direction: Vector3
    window: tuple[float, float]
    cycle: Callable[[Vector3, float], CycleTimes]

    def choose(
        self,
        parts: Mapping[int, Vector3],
        belt: tuple[float, float],
        now: float,
        free_at: float,
    ) -> Choice:
        """Return what to pick next, by all parts that are known, those still to come included.

        Args:
            parts: their numbers, and their positions in the frame of the belt [m].
            belt: its position [m] and velocity [m/s] now.
            now: the time [s].
            free_at: when the machine may leave its last place [s]; before ``now``, it may at once.
        """
        free_at = max(free_at, now)
        velocity = belt[1] if abs(belt[1]) > SLOWEST else 0.0
        arrivals, passed, (first, last) = [], [], self.window
        for number, position in parts.items():
            here = combined(1.0, position, belt[0], self.direction)
            way = dot(here, self.direction)
            since, until = now, math.inf if first <= way <= last else -math.inf
            if velocity:
                ends = (first, last) if velocity > 0.0 else (last, first)
                since, until = (now + (end - way) / velocity for end in ends)
                if until < now and (velocity > 0.0 or way < first - TURNED_BACK):
                    passed.append(number)
            if until >= free_at:
                # Where the belt rests, the first in the way of the belt: it may start again.
                arrivals.append(_Arrival(until, last - way, number, since, here))
        arrivals.sort()
        reachable = (each for each in arrivals if self._grip(each, velocity, now, free_at))
        plan = self._best_plan(islice(reachable, AHEAD), velocity, now, free_at)
        return Choice(plan, tuple(passed))

    def _best_plan(
        self, arrivals: Iterable[_Arrival], velocity: float, now: float, free_at: float
    ) -> Pick | None:
        """Return the first pick of the plan that places most, and of these is over first.

        Plans take parts in the order in which they leave; other orders place hardly more. After
        each part, ``plans[n]`` is the one that is over first of those that place n so far.
        """
        plans: list[tuple[float, Pick | None]] = [(free_at, None)]
        for arrival in arrivals:
            for count in reversed(range(len(plans))):
                free, first = plans[count]
                grip = self._grip(arrival, velocity, now, free)
                if grip is None:
                    continue
                pick, end = grip
                plan = (end, first or pick)
                if count + 1 == len(plans):
                    plans.append(plan)
                elif end < plans[count + 1][0]:
                    plans[count + 1] = plan
        return plans[-1][1]

    def _grip(
        self, arrival: _Arrival, velocity: float, now: float, free_at: float
    ) -> tuple[Pick, float] | None:
        """Return the first grip of a part from ``free_at`` on, and the end of its cycle [s].

        None if the part is gone before.
        """
        at = max(arrival.since, free_at)
        for _ in range(MOST_STEPS):
            # No further, as beyond the window there may be no cycle.
            seen_at = min(at, arrival.until)
            position = combined(1.0, arrival.position, velocity * (seen_at - now), self.direction)
            reach, rest = self.cycle(position, velocity)
            at = max(arrival.since, free_at + reach)
            if abs(at - seen_at) < PRECISION:
                break
        if at > arrival.until:
            return None
        return Pick(arrival.number, at - reach, at, position), at + rest
