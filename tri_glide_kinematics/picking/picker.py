"""Picks parts from a belt and places them, one after the other: told the time, it tells what to do.

It gives transfers from a part to a place, and newer motion of the part while the platform is on its
way there. Each part has its one outcome, whatever the machine does; and nothing begins again by
itself once the machine was stopped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import GoalCode, Station, Transfer
from tri_glide_kinematics.picking.belt import BeltMotion, BeltState, BeltUnknownError
from tri_glide_kinematics.picking.order import PickOrder
from tri_glide_kinematics.picking.parts import Part, PartOutcome, Parts, Sighting
from tri_glide_kinematics.picking.places import Place, Places
from tri_glide_kinematics.vectors import Vector3, minus, plus, scaled

# The machine gets newer motion of a part if that moves the place of the grip by this [m], but not
# more often than this [s].
RENEWED_FROM = 2e-5
RENEWED_AFTER = 0.01

# Period of looking for a part while the machine is free, and for parts that have passed while it is
# not [s].
LOOKS_EACH = 0.02
PASSES_EACH = 0.5

# A transfer is given so long before it is to begin: it has to be planned [s].
PLANNED_BEFORE = 0.4

# Drives are late by this at most: so long after a transfer has failed, the gripper may still close,
# as its output was on the way [s].
LATEST = 0.2

# A part is given up so long before the arrival at the latest, as that takes a moment [s].
GIVEN_UP_BEFORE = 0.05

# A run goes on after a transfer that has ended like that.
GOES_ON = (GoalCode.NOT_REACHED, GoalCode.REFUSED)

# A run goes on after the encoder of the belt was silent, but not for longer than this [s].
LONGEST_SILENCE = 2.0

# A transfer that was given up ends when the platform rests. That the machine takes commands again
# is told by another message, within this time [s].
BRAKES_FOR = 0.5


class RunEnd(Enum):
    """Why a run ended, and that in words where nothing more can be said."""

    ALL_PLACED = "all are placed"
    PLACES_FULL = "all places are full"
    CANCELED = "cancelled"
    STOPPED = "stopped by ~/stop"
    SHUTDOWN = "the node ends"
    BELT_SILENT = f"the belt is not heard for {LONGEST_SILENCE:g} s"
    GRIPPER_CLOSED = "the gripper has closed with no part to be gripped"
    MACHINE_STOPPED = "the machine was stopped, or takes no commands"
    TRANSFER_FAILED = "a transfer has failed"


class GripperClosedError(KinematicsError):
    """A run is to begin while the gripper may hold a part of the last one."""

    def __init__(self) -> None:
        """Say what is to be done."""
        super().__init__("the gripper is closed since the last run: empty it first")


class Machine(NamedTuple):
    """What a machine says of itself.

    Attributes:
        position: where the platform is. Shape (3,) [m].
        accepts: whether it carries commands out: it is enabled, and neither stopped nor paused.
        stops: how often it was stopped or has lost its lead, as far as it has counted.
        arrivals: when the platform is at each station of the latest transfer, from now on; negative
            if that is past, infinite if it does not get there. Empty before it begins [s].
        passed: what the gripper was told since the last time: true to close, false to open.
        holds: whether a sensor says that the gripper holds a part; None without one.
    """

    position: Vector3
    accepts: bool = True
    stops: int = 0
    arrivals: tuple[float, ...] = ()
    passed: Sequence[bool] = ()
    holds: bool | None = None


class Renewal(NamedTuple):
    """The first station of the transfer moves otherwise, as of ``seen`` [s]."""

    motion: Station
    seen: float


class GivingUp(NamedTuple):
    """The transfer is to be given up, for a reason: up, and rest."""

    reason: str


@dataclass(frozen=True)
class PickSettings:
    """How parts are picked and placed.

    Attributes:
        height: of the platform between stations [m].
        tolerance: how far it may be from a corner of its way [m].
        waiting: where the platform waits for parts; None for where it is. Shape (3,) [m].
        point: of the gripper, from that of the platform. Shape (3,) [m].
        closing: time from an output to the closed gripper [s].
        opening: time from an output to the open gripper [s].
        dwells: at the part and at the place; it has closed or opened at their ends [s].
        sensing: time from the closed gripper until its sensor tells [s].
        allowed: so far from a part the platform may arrive; else it goes up again [m].
    """

    height: float
    tolerance: float = 0.005
    waiting: Vector3 | None = None
    point: Vector3 = (0.0, 0.0, 0.0)
    closing: float = 0.02
    opening: float = 0.02
    dwells: tuple[float, float] = (0.02, 0.02)
    sensing: float = 0.05
    allowed: float = 1e-3


class PartEvent(NamedTuple):
    """A part has its outcome, which it says itself.

    Attributes:
        part: that has ended.
        error: distance from it to the gripper's point when that had closed; NaN if it had not [m].
        gripped: when the gripper had closed; infinite if it had not [s].
    """

    part: Part
    error: float = math.nan
    gripped: float = math.inf


@dataclass
class _Cycle:
    """A part on its way to a place; else as in ``PartEvent``, and whether it was felt."""

    part: Part
    place: Place
    error: float = math.nan
    gripped: float = math.inf
    was_held: bool = False
    transfer: Transfer | None = None


class Picker:
    """Picks and places, while a run goes on.

    Attributes:
        is_running: whether a run goes on.
        end: why the last run has ended; None while one goes on, and before the first.
        text: what it does, or why the last run has ended, in words.
        events: of parts that have ended; who tells them clears it.
    """

    def __init__(
        self,
        belt: BeltMotion,
        parts: Parts,
        order: PickOrder,
        places: Places,
        settings: PickSettings,
        note_way: Callable[[Vector3, float], None] = lambda *_: None,
    ) -> None:
        """Wait for a run.

        Args:
            belt: on which the parts come.
            parts: that are known.
            order: in which they are picked.
            places: where they are put.
            settings: of each cycle.
            note_way: is told the place of a grip [m] and how long the way there takes [s], as soon
                as that is known.
        """
        self.is_running, self.text = False, "no run has begun"
        self.end: RunEnd | None = None
        self.events: list[PartEvent] = []
        self._belt, self._parts, self._order, self._places = belt, parts, order, places
        self._settings, self._note_way = settings, note_way
        # When the way to a part begins that is not noted yet; infinite without one [s].
        self._sets_out = math.inf
        # The last one is the present one; one before it is still to be released.
        self._cycles: list[_Cycle] = []
        self._given: Transfer | None = None
        self._renewal: Renewal | None = None
        # When the gripper closes by the plan for that motion; NaN until this is known [s].
        self._planned_grip = math.nan
        self._gives_up = self._carries_on = self._waits = self._is_closed = False
        # Why no other part is begun.
        self._ends: RunEnd | None = None
        self._failed = (-math.inf, "")
        # So many parts are to be placed yet.
        self._left = math.inf
        self._stops: int | None = None
        self._looked = self._free_at = self._brakes_until = -math.inf
        # When the belt was heard last in this run; infinite at its begin.
        self._heard = math.inf

    def run(self, is_emptied: bool = False, count: int = 0) -> None:
        """Begin to pick parts.

        Args:
            is_emptied: whether somebody has taken out what the gripper held, and opened it.
            count: of parts that are to be placed; 0 for all.

        Raises:
            GripperClosedError: if it is closed since the last run, and not emptied.
        """
        if self._is_closed and not is_emptied:
            raise GripperClosedError
        if not self.is_running:
            self.is_running, self.text, self.end = True, "picks parts", None
            self._is_closed = self._waits = False
            self._heard = math.inf
            self._stops, self._ends, self._left = None, None, count or math.inf
            if self._places.is_full:
                # Somebody has put other places there: else there would be nothing to run for.
                self._places.empty()

    @property
    def target(self) -> int:
        """Number of the part that is to be gripped next; 0 for none."""
        cycles = [cycle for cycle in self._cycles if math.isinf(cycle.gripped)]
        return cycles[-1].part.number if cycles else 0

    @property
    def parts_on_belt(self) -> list[Part]:
        """Parts without an outcome, in the frame of the belt."""
        return self._parts.on_belt()

    def belt_at(self, time: float) -> BeltState | None:
        """Return how the belt moves at a ``time`` [s]; None if that is not known."""
        with suppress(BeltUnknownError):
            return self._belt.at(time)
        return None

    def finish(self, end: RunEnd) -> None:
        """Begin no other part, and ``end`` the run when the present one is placed."""
        self._ends = self._ends or end

    def see(self, sighting: Sighting) -> None:
        """Take in what was seen, if it is known where the belt was then."""
        with suppress(BeltUnknownError):
            self._parts.see(sighting, self._belt.at(sighting.time).position)

    def report(self, time: float, position: float) -> None:
        """Take a report of the belt's encoder [s, m]. If it has jumped, its parts are lost."""
        if self._belt.report(time, position):
            for cycle in self._cycles:
                cycle.part.is_taken = math.isfinite(cycle.gripped)
            lost = self._parts.lose("the encoder of the belt has jumped", time)
            self.events += [PartEvent(part) for part in lost]

    def renewed(self, renewal: Renewal) -> None:
        """Note that the machine has taken a ``renewal``; it cannot while it is planning."""
        self._renewal, self._planned_grip = renewal, math.nan

    def step(self, now: float, machine: Machine) -> Transfer | Renewal | GivingUp | None:
        """Return what is to be done ``now`` [s], as the ``machine`` is like that."""
        for closes in machine.passed:
            self._pass(closes, now)
        self._watch_gripper(now, machine)
        if math.isinf(self._heard) or not self._belt.is_silent(now):
            self._heard = now
        if now > self._heard + LONGEST_SILENCE:
            self.finish(RunEnd.BELT_SILENT)
        if self.is_running and (obstacle := self._obstacle(now, machine)):
            self._end(now, *obstacle)
        last = self._cycles[-1] if self._cycles else None
        is_free = self.is_running and machine.accepts and len(self._cycles) < min(2, self._left)
        if len(self._cycles) > 1 and _has_failed(self._cycles[0].transfer):
            return self._turn_back()
        if self._given is not None:
            if last is not None and math.isinf(last.gripped):
                return self._approach(now, machine, last)
            arrival = machine.arrivals[-1] if machine.arrivals else math.inf
            is_free &= arrival < PLANNED_BEFORE and not self._gives_up
            self._free_at = now + arrival + self._settings.dwells[1]
        elif self._carries_on and last is not None:
            if math.isfinite(last.gripped):
                last.transfer = self._transfer(now, self._release(last))
                return last.transfer
            if now > self._failed[0] + LATEST:
                self._end_cycle(last, PartOutcome.MISSED, self._failed[1], now)
            return None
        elif self._ends and last is None and self.is_running:
            self._end(now, self._ends)
        if now < self._looked + (LOOKS_EACH if is_free else PASSES_EACH):
            return None
        self._looked = now
        return None if self._belt.is_silent(now) else self._look(now, is_free)

    def _pass(self, closes: bool, now: float) -> None:
        """Take in what the gripper was told: to close at the next part, or to open at a place."""
        if closes and self._is_closed:
            # Whoever has told it once more: it keeps what it has.
            return
        self._is_closed = closes
        cycle = next((each for each in self._cycles if math.isinf(each.gripped) == closes), None)
        if cycle is None:
            if self.is_running and closes:
                self._end(now, RunEnd.GRIPPER_CLOSED)
        elif closes:
            cycle.gripped = now + self._settings.closing
        else:
            self._end_cycle(cycle, PartOutcome.PLACED, "picked and placed", now)
            self._left -= cycle.part.outcome is PartOutcome.PLACED
            if self._left <= 0:
                self.finish(RunEnd.ALL_PLACED)

    def _watch_gripper(self, now: float, machine: Machine) -> None:
        """Note how near the gripper was to its part, and whether it holds it."""
        for cycle in self._cycles:
            if now < cycle.gripped:
                continue
            if math.isnan(cycle.error):
                point = plus(machine.position, self._settings.point)
                cycle.error = math.dist(point, self._place_of(cycle.part, now))
            if machine.holds:
                cycle.was_held = True
            elif machine.holds is not None and now >= cycle.gripped + self._settings.sensing:
                if cycle.was_held:
                    self._end_part(cycle, PartOutcome.LOST, "lost on the way", now)
                else:
                    self._end_part(cycle, PartOutcome.MISSED, "the gripper holds nothing", now)

    def _obstacle(self, now: float, machine: Machine) -> tuple[RunEnd, str] | None:
        """Return why the run has to end, if it has to; take in how a transfer has ended."""
        before, self._stops = self._stops, machine.stops
        accepts = machine.accepts or self._gives_up or now < self._brakes_until
        if not accepts or before not in (None, machine.stops):
            return RunEnd.MACHINE_STOPPED, ""
        outcome = None if self._given is None else self._given.outcome
        if outcome is None:
            return None
        given, self._given = self._given, None
        gave_up, self._gives_up = self._gives_up, False
        if gave_up:
            self._brakes_until = now + BRAKES_FOR
        again, self._carries_on = self._carries_on, False
        last = self._cycles[-1] if self._cycles else None
        if outcome.code is GoalCode.SUCCEEDED:
            return None
        if not gave_up and (again or not _has_failed(given)):
            return RunEnd.TRANSFER_FAILED, outcome.text
        if last is None:
            return None
        if outcome.code is GoalCode.REFUSED and math.isinf(last.gripped):
            self._end_cycle(last, PartOutcome.PASSED, outcome.text, now)
        else:
            # It has gone up. If it has the part, it may get to the place from there after all.
            self._carries_on, self._failed = True, (now, outcome.text)
        return None

    def _approach(self, now: float, machine: Machine, cycle: _Cycle) -> Renewal | GivingUp | None:
        """Return newer motion of a part where that matters, or that it is given up."""
        arrival = machine.arrivals[0] if machine.arrivals else math.inf
        grip = now + arrival + self._settings.dwells[0]
        if self._gives_up:
            return None
        # At the part the gripper has closed before the platform could go up.
        is_silent = arrival > GIVEN_UP_BEFORE and self._belt.is_silent(now)
        if cycle.part.outcome is not None or is_silent:
            self._end_part(cycle, PartOutcome.MISSED, "the encoder of the belt is silent", now)
            if len(self._cycles) > 1:
                # The part before has to be released first.
                return None
            self._gives_up = True
            return GivingUp(cycle.part.text)
        if arrival < math.inf and self._sets_out < math.inf:
            self._note_way(
                self._place_of(cycle.part, now + arrival), now + arrival - self._sets_out
            )
            self._sets_out = math.inf
        known = self._renewal
        if known is None or now < known.seen + RENEWED_AFTER or not now < grip < math.inf:
            return None
        if math.isnan(self._planned_grip):
            self._planned_grip = grip
        # A machine whose cycles come late is there later, but where the part was to be before.
        meant = known.motion.after(self._planned_grip - known.seen).position
        there = minus(self._place_of(cycle.part, grip), self._settings.point)
        if math.dist(meant, there) < RENEWED_FROM:
            return None
        return Renewal(self._grip(cycle.part, now), now)

    def _turn_back(self) -> GivingUp:
        """Give the next part up for the time being, as the one before did not get to its place."""
        cycle = self._cycles.pop()
        self._places.give_back(cycle.place)
        cycle.part.is_taken = False
        self._gives_up = self._carries_on = True
        return GivingUp("the part before is not placed yet")

    def _look(self, now: float, is_free: bool) -> Transfer | None:
        """Return the transfer of the part that is next, or to where the platform waits."""
        busy = [cycle.part for cycle in self._cycles]
        parts = {part.number: part for part in self._parts.on_belt() if part not in busy}
        position, velocity, _ = self._belt.at(now)
        free_at = max(self._free_at, now) if self._cycles else now
        places = {number: part.position for number, part in parts.items()}
        choice = self._order.choose(places, (position, velocity), now, free_at)
        for number in choice.passed:
            part = parts.pop(number)
            self._parts.end(part, PartOutcome.PASSED, "it could not be reached any more", now)
            self.events.append(PartEvent(part))
        if self._places.is_full:
            self.finish(RunEnd.PLACES_FULL)
        if not is_free or self._ends:
            return None
        pick, waiting = choice.pick, self._settings.waiting
        if pick is not None and pick.leave_at < now + PLANNED_BEFORE:
            cycle = _Cycle(parts[pick.part], self._places.take())
            cycle.part.is_taken, self._waits, self._carries_on = True, False, False
            self._cycles.append(cycle)
            grip = self._grip(cycle.part, now)
            self.renewed(Renewal(grip, now))
            stations = grip, self._release(cycle)
            cycle.transfer = self._transfer(now, *stations, leave_at=max(pick.leave_at, free_at))
            self._sets_out = max(now, cycle.transfer.leave_at)
            return cycle.transfer
        if parts or self._cycles or self._waits or waiting is None:
            return None
        self._waits = True
        return self._transfer(now, Station(waiting))

    def _transfer(self, now: float, *stations: Station, leave_at: float = -math.inf) -> Transfer:
        """Return a transfer that rests at its last station."""
        settings = self._settings
        given = Transfer(stations, settings.height, lifts=False, seen=now, leave_at=leave_at)
        given.tolerance, given.allowed = settings.tolerance, settings.allowed
        self._given = given
        return given

    def _grip(self, part: Part, now: float) -> Station:
        """Return the station at a part, as of ``now`` [s]."""
        settings, direction = self._settings, self._order.direction
        _, velocity, acceleration = self._belt.at(now)
        place, dwell = minus(self._place_of(part, now), settings.point), settings.dwells[0]
        outputs = ((dwell - settings.closing, True),)
        motion = scaled(direction, velocity), scaled(direction, acceleration)
        return Station(place, dwell, *motion, outputs)

    def _release(self, cycle: _Cycle) -> Station:
        """Return the station at the place of a part."""
        settings, dwell = self._settings, self._settings.dwells[1]
        outputs = ((dwell - settings.opening, False),)
        return Station(minus(cycle.place.position, settings.point), dwell, outputs=outputs)

    def _place_of(self, part: Part, time: float) -> Vector3:
        """Return where a part on the belt is at a ``time`` [s]. Shape (3,) [m]."""
        return plus(part.position, scaled(self._order.direction, self._belt.at(time).position))

    def _end_part(self, cycle: _Cycle, outcome: PartOutcome, text: str, now: float) -> None:
        """Give a part its outcome, if it has none, and tell it."""
        if cycle.part.outcome is None:
            self._parts.end(cycle.part, outcome, text, now)
            self.events.append(PartEvent(cycle.part, cycle.error, cycle.gripped))

    def _end_cycle(self, cycle: _Cycle, outcome: PartOutcome, text: str, now: float) -> None:
        """End the cycle of a part; if nothing was placed, its place is free again."""
        self._end_part(cycle, outcome, text, now)
        self._cycles.remove(cycle)
        if cycle.part.outcome is not PartOutcome.PLACED:
            self._places.give_back(cycle.place)

    def _end(self, now: float, end: RunEnd, text: str = "") -> None:
        """End the run and what is on its way; the gripper stays as it is.

        Args:
            now: the time [s].
            end: why.
            text: why in words, if there is more to be said.
        """
        reason = text or end.value
        for cycle in tuple(self._cycles):
            if math.isinf(cycle.gripped):
                self._end_cycle(cycle, PartOutcome.MISSED, reason, now)
            else:
                self._end_cycle(cycle, PartOutcome.LOST, f"{reason}, with it in the gripper", now)
        self._given, self._gives_up, self._carries_on = None, False, False
        self.is_running, self.end, self.text = False, end, reason


def _has_failed(transfer: Transfer | None) -> bool:
    """Return whether a transfer has ended on its way by itself."""
    outcome = None if transfer is None else transfer.outcome
    return outcome is not None and outcome.code in GOES_ON
