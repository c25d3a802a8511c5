"""A simulated belt with parts, its encoder, cameras and a gripper: told the time, by seed."""

from __future__ import annotations

import math
import random
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from tri_glide_kinematics.picking.belt import BeltState
from tri_glide_kinematics.picking.parts import Sighting
from tri_glide_kinematics.vectors import Vector3, combined, dot, minus, plus

# Part of a count of an encoder by which rounding may leave a place below the count that it is at.
ROUNDING = 1e-6

# Distance of parts along the belt, at least, where it is at random [m].
LEAST_SPACING = 0.015

# A part that is lost on the way is lost so soon, at most [s].
LOST_WITHIN = 0.3


class SimulatedBelt:
    """A belt that goes over from one speed to the next, at a constant acceleration.

    Attributes:
        direction: in which it runs, a unit vector. Shape (3,).
    """

    def __init__(
        self, direction: Vector3, speed: float, changes: Sequence[tuple[float, float, float]] = ()
    ) -> None:
        """Run; it is at 0 m at 0 s.

        Args:
            direction: a unit vector. Shape (3,).
            speed: until the first change [m/s].
            changes: when it begins to go over to another speed, negative for backwards, and at
                which acceleration [s, m/s, m/s^2]. A later one cuts short what is not over yet.
        """
        self.direction = direction
        self._pieces = [(0.0, BeltState(0.0, speed, 0.0))]
        for time, wanted, acceleration in changes:
            now = self.at(time)
            signed = math.copysign(acceleration, wanted - now.velocity)
            end = time + (wanted - now.velocity) / signed
            self._pieces = [piece for piece in self._pieces if piece[0] <= time]
            self._pieces.append((time, now._replace(acceleration=signed)))
            self._pieces.append((end, BeltState(self.at(end).position, wanted, 0.0)))

    def at(self, time: float) -> BeltState:
        """Return where the belt is at a ``time`` [s], and how it moves."""
        index = max(bisect_right(self._pieces, time, key=lambda piece: piece[0]) - 1, 0)
        begin, (position, velocity, acceleration) = self._pieces[index]
        dt = time - begin
        moved = (velocity + acceleration * dt / 2.0) * dt
        return BeltState(position + moved, velocity + acceleration * dt, acceleration)


@dataclass
class SimulatedPart:
    """A part as it truly is.

    Attributes:
        number: which one it is.
        position: in the frame of the belt. Shape (3,) [m].
        slide: with which velocity it moves on the belt from ``since`` on. Shape (3,) [m/s].
        since: when it begins to slide [s].
        taken: when it was gripped [s].
        lost: when it is lost after that [s].
        placed: where it was released; None until then. Shape (3,) [m].
    """

    number: int
    position: Vector3
    slide: Vector3 = (0.0, 0.0, 0.0)
    since: float = 0.0
    taken: float = math.inf
    lost: float = math.inf
    placed: Vector3 | None = None

    def at(self, time: float, belt: SimulatedBelt) -> Vector3:
        """Return where it is at a ``time`` [s], while it lies on the ``belt``. Shape (3,) [m]."""
        slid, moved = max(time - self.since, 0.0), belt.at(time).position
        return plus(self.position, combined(moved, belt.direction, slid, self.slide))


def laid_parts(
    belt: SimulatedBelt,
    count: int,
    spacing: float,
    *,
    first: Vector3,
    width: float = 0.0,
    at_random: bool = False,
    seed: int = 1,
) -> list[SimulatedPart]:
    """Return parts on a ``belt``, one behind the other.

    Args:
        belt: on which they lie.
        count: how many.
        spacing: mean distance along the belt [m].
        first: where the first one lies, but for the width. Shape (3,) [m].
        width: of what they lie on at random, across the belt [m].
        at_random: whether the distances are at random, none below ``LEAST_SPACING``.
        seed: of what is at random.
    """
    drawn, behind, parts = random.Random(seed), 0.0, []
    x, y, _ = belt.direction
    for number in range(count):
        aside = width * (drawn.random() - 0.5)
        place = combined(-behind, belt.direction, aside, (-y, x, 0.0))
        parts.append(SimulatedPart(number, plus(first, place)))
        further = drawn.expovariate(1.0) if at_random else 1.0
        behind += LEAST_SPACING + (spacing - LEAST_SPACING) * further
    return parts


class Readings:
    """When something is read at a rate, and comes in later."""

    def __init__(self, rate: float, delay: float, jitter: float = 0.0, seed: int = 1) -> None:
        """Read from 0 s on.

        Args:
            rate: of the readings [1/s].
            delay: until each comes in, from when it was to be read [s].
            jitter: by which it is read later, at most, at random [s].
            seed: of all that is at random in them.
        """
        self.random, self._count = random.Random(seed), 0
        self._rate, self._delay, self._jitter = rate, delay, jitter

    def due(self, now: float) -> Iterator[float]:
        """Yield the times of the readings that have come in until ``now`` [s], each once."""
        while (time := self._count / self._rate) + self._delay <= now:
            self._count += 1
            yield time + self._jitter * self.random.random()


@dataclass(frozen=True)
class SimulatedEncoder:
    """An encoder of a belt.

    Attributes:
        belt: that it reads.
        readings: when it does.
        step: of one count [m].
        wrap: counts after which it begins at 0 again; 0 for never.
        silences: from when to when nothing is read [s].
        jumps: when it jumps, and by how much [s, m].
    """

    belt: SimulatedBelt
    readings: Readings
    step: float = 1e-4
    wrap: int = 0
    silences: Sequence[tuple[float, float]] = ()
    jumps: Sequence[tuple[float, float]] = ()

    def take(self, now: float) -> list[tuple[float, float]]:
        """Return what has come in until ``now`` [s]: when the belt was where [s, m]."""
        reports = []
        for time in self.readings.due(now):
            jumped = sum(jump for when, jump in self.jumps if when <= time)
            count = math.floor((self.belt.at(time).position + jumped) / self.step + ROUNDING)
            if not any(begin <= time < end for begin, end in self.silences):
                reports.append((time, self.step * (count % self.wrap if self.wrap else count)))
        return reports


@dataclass(frozen=True)
class SimulatedCamera:
    """A camera that looks down on some of a belt.

    Attributes:
        name: of the camera.
        belt: on which the parts lie.
        parts: all that there are.
        view: from where to where it sees, along the direction of the belt [m].
        readings: when it takes pictures, and when these come in.
        noise: rms of each of the two horizontal coordinates [m].
        missing: probability that a part is not seen in a picture.
        nameless: probability that it has no identity there.
        renamed: probability that it has another identity than before.
    """

    name: str
    belt: SimulatedBelt
    parts: Sequence[SimulatedPart]
    view: tuple[float, float]
    readings: Readings
    noise: float = 0.0
    missing: float = 0.0
    nameless: float = 0.0
    renamed: float = 0.0

    def take(self, now: float) -> list[Sighting]:
        """Return what is seen in the pictures that have come in until ``now`` [s]."""
        drawn, seen = self.readings.random, []
        for time in self.readings.due(now):
            for part in self.parts:
                place = part.at(time, self.belt)
                along = dot(place, self.belt.direction)
                if part.taken <= time or not self.view[0] <= along <= self.view[1]:
                    continue
                off = (drawn.gauss(0.0, self.noise), drawn.gauss(0.0, self.noise), 0.0)
                name = f"{part.number}.{time}" if drawn.random() < self.renamed else part.number
                name = "" if drawn.random() < self.nameless else str(name)
                if drawn.random() >= self.missing:
                    seen.append(Sighting(time, plus(place, off), "part", name, 0.0, self.name))
        return seen


class Grip(NamedTuple):
    """What happened when a gripper had closed.

    Attributes:
        time: when it had closed [s].
        part: that it holds; None if that was too far away.
        error: from the nearest part on the belt to its point. Shape (3,) [m].
    """

    time: float
    part: SimulatedPart | None
    error: Vector3


@dataclass
class SimulatedGripper:
    """A gripper that takes the nearest part, if that is near enough.

    Attributes:
        belt: on which the parts lie.
        parts: all that there are.
        delay: from an output to the closed or open gripper [s].
        sensing: from then until its sensor tells [s].
        reach: how far from its point it takes a part [m].
        losing: probability that it loses a part on the way.
        random: what is at random.
        grips: what happened each time that it had closed.
        held: what it holds.
    """

    belt: SimulatedBelt
    parts: Sequence[SimulatedPart]
    delay: float = 0.02
    sensing: float = 0.02
    reach: float = 0.003
    losing: float = 0.0
    random: random.Random = field(default_factory=lambda: random.Random(1))
    grips: list[Grip] = field(default_factory=list)
    held: SimulatedPart | None = None
    _orders: list[tuple[float, bool]] = field(default_factory=list)
    _sensed: list[tuple[float, bool]] = field(default_factory=list)

    def order(self, closed: bool, now: float) -> None:
        """Close or open it, which takes its delay from ``now`` [s] on."""
        self._orders.append((now + self.delay, closed))

    def step(self, now: float, point: Vector3) -> bool:
        """Do what is to be done by ``now`` [s], with its point where that is [m].

        Returns:
            Whether its sensor says that it holds a part.
        """
        if self.held is not None and self.held.lost <= now:
            self.held = None
        while self._orders and self._orders[0][0] <= now:
            _, closes = self._orders.pop(0)
            if closes and self.held is None:
                self._close(now, point)
            elif self.held is not None and not closes:
                self.held.placed, self.held = point, None
        self._sensed.append((now + self.sensing, self.held is not None))
        while len(self._sensed) > 1 and self._sensed[1][0] <= now:
            self._sensed.pop(0)
        return any(holds for time, holds in self._sensed[:1] if time <= now)

    def _close(self, now: float, point: Vector3) -> None:
        places = [(part.at(now, self.belt), part) for part in self.parts if part.taken > now]
        if not places:
            return
        place, part = min(places, key=lambda each: math.dist(each[0], point))
        if math.dist(place, point) <= self.reach:
            self.held, part.taken = part, now
            if self.random.random() < self.losing:
                part.lost = now + LOST_WITHIN * self.random.random()
        self.grips.append(Grip(now, self.held, minus(point, place)))
