"""Decides how a probe goes on: down until a contact, to rest, back up.

It reads no clock, and knows no ROS: a ``JoggedMachine`` takes twists.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

from tri_glide_kinematics.calibration.session.leading import (
    Course,
    Delivery,
    Leader,
    Leading,
    LeadingError,
    MachineView,
    RecordingError,
)
from tri_glide_kinematics.control import IDLE, JOGGING, STOPPING, WAS_STOPPED, Cause
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text

# After a stop ik_node refuses twists until it is told of zero: so each probe begins with that [s].
LETTING_GO = 0.1
# Farther than this from the way down, somebody else leads the platform [m].
LARGEST_DEVIATION = 2e-3
# Measured heights that are silent for longer end a probe, and so does our own silence [s].
LONGEST_SILENCE = 0.5
# A driver that looks less often than this may have missed a contact [s].
LONGEST_LOOK = 0.05
# The platform has to move by some part of the way that was asked for in this time, or is held [s].
PATIENCE = 4.0
LEAST_PART = 0.05
# The longest that a stop, and the way back, may take [s].
LONGEST_STOP = 5.0
LONGEST_WAY_BACK = 15.0
# A twist is renewed this often [s]: several times in the time after which ik_node stops.
TWIST_PERIOD = 0.02
# The platform is back within this distance [m].
BACK_TOLERANCE = 5e-5
# On its way back it moves at this speed at least, and slows down over the last of it [m/s], [s].
BACK_SPEED = 0.01
SLOWING = 0.2
# On its way back it may not fall by more than this [m].
LARGEST_FALL = 3e-4
# Below this distance from the lowest place, a contact may chatter as it opens [m].
CHATTER = 5e-4


@dataclass(frozen=True)
class ProbeSettings:
    """How to probe.

    Attributes:
        speed: downwards [m/s].
        depth: how far down at most [m].
        contact_timeout: longest time between two messages about the contact; 0 for a switch that
            tells of changes only [s].
        contact_delay: time from a contact to its message [s].
    """

    speed: float
    depth: float
    contact_timeout: float
    contact_delay: float = 0.0


@dataclass(frozen=True)
class ProbeResult:
    """The result of a probe.

    Attributes:
        heights: as reported, at the contact. Shape (3,) [m].
        overrun: how far down the platform went after it [m].
        text: what went wrong; empty if nothing did.
    """

    heights: Vector3
    overrun: float
    text: str


class JoggedMachine(Protocol):
    """What a probe asks for."""

    @property
    def is_there(self) -> bool:
        """Whether anybody tells the state of the machine."""

    def jog(self, upwards: float) -> None:
        """Let it move upwards with this speed [m/s], for a moment."""


class Probe(Leader):
    """One probe, from the first step down until the platform rests again.

    Attributes:
        contact_stamp: when the contact was made, by the clock of the machine [s]; None before.
        heights: as reported, at the contact; None where they are not known. Shape (3,) [m].
        failures: what went wrong, in words.
        lowest: where the platform was farthest down [m].
    """

    def __init__(
        self,
        leading: Leading,
        jogged: JoggedMachine,
        place_of: Callable[[Vector3], Vector3],
        settings: ProbeSettings,
        heights: Vector3,
    ) -> None:
        """Begin at rest at reported ``heights`` [m]; the others are as for ``probe``."""
        self.contact_stamp: float | None = None
        self.heights: Vector3 | None = None
        self.failures: list[str] = []
        self._leading, self._jogged, self._place_of = leading, jogged, place_of
        self._settings = settings
        self._start = start = place_of(heights)
        self.lowest = start[2]
        self._heard = self._measured = leading.now
        self._height = self._highest = start[2]
        # Which way it moves: 1 upwards, -1 downwards, 0 where it is to rest.
        self._way = -1
        self._has_jogged = self._is_open = self._has_closed = False
        self._stops = leading.machine.stops
        self._sent, self._due = math.nan, 0.0

    def contact(self, is_touched: bool, delivery: Delivery) -> None:
        """Take in what the switch says."""
        self._heard = delivery.now
        if is_touched and self._way < 0:
            # A contact has no time of its own: that at which it was sent comes nearest.
            self.contact_stamp = delivery.sent - self._settings.contact_delay
            self._way = 0
        elif self._way > 0:
            is_off = self._is_open and self._height > self.lowest + CHATTER
            self._has_closed |= is_touched and is_off
            self._is_open = not is_touched

    def measured(self, heights: Vector3, stamp: float, delivery: Delivery) -> None:
        """Take in reported heights [m]; some that have no place are no progress."""
        try:
            x, y, z = self._place_of(heights)
        except KinematicsError:
            return
        x0, y0, z0 = self._start
        self._measured, self._height = delivery.now, z
        self.lowest, self._highest = min(self.lowest, z), max(self._highest, z)
        if self.contact_stamp is not None and self.heights is None:
            # At once: the way back may take longer than measurements are kept.
            with suppress(RecordingError):
                self.heights = self._leading.record.at(self.contact_stamp)
        away = max(math.hypot(x - x0, y - y0), z - z0)
        if away > LARGEST_DEVIATION:
            self._leading.fail(
                f"the platform is {number_text(1e3 * away, 3)} mm away from its way down: "
                "somebody else leads it"
            )

    def machine(self, view: MachineView) -> None:
        """Take in what ik_node tells of itself."""
        # That a twist came late is no reason to give up: the next one is on its way.
        is_late = view.cause is Cause.TWISTS_SILENT
        is_stopped = view.state in (IDLE, STOPPING) and not is_late
        if self._way and self._has_jogged and is_stopped:
            self._leading.fail(f"it was stopped: {view.text}")
        self._has_jogged |= view.state is JOGGING
        # In these states it does what we have asked for.
        if view.state not in (IDLE, JOGGING, STOPPING):
            self._leading.fail(str(view))
        # The state tells nothing of a stop while nothing moved.
        if view.stops != self._stops:
            self._leading.fail(WAS_STOPPED)

    def target_pose(self) -> None:
        """Notice a command that our next twist takes the place of before it makes a state."""
        self._leading.fail("another node sends a target pose")

    def led(self) -> Course[None]:
        """Move down until a contact, come to rest, move back, and come to rest."""
        try:
            yield from self._down()
            yield from self._rest()
            yield from self._back()
            yield from self._rest()
        except LeadingError as error:
            # Whoever leads the machine is left to it, and without twists it stops.
            self.failures.append(str(error))

    def _down(self) -> Course[None]:
        """Move down until a contact, or until something goes wrong that the way back mends."""
        settings, leading = self._settings, self._leading
        begin = since = leading.now
        height, timeout = self._height, settings.contact_timeout
        while self._way < 0:
            now = leading.now
            if self._start[2] - self._height > settings.depth:
                self._fail(f"no contact on {number_text(1e3 * settings.depth, 6)} mm")
            elif 0.0 < timeout < now - self._heard:
                self._fail(f"nothing about the contact for {number_text(timeout, 3)} s")
            elif now - since > PATIENCE:
                if height - self._height < LEAST_PART * settings.speed * PATIENCE:
                    self._fail(f"the platform does not go down: {leading.machine}")
                since, height = now, self._height
            else:
                yield from self._jog(0.0 if now - begin < LETTING_GO else -settings.speed)

    def _back(self) -> Course[None]:
        """Move up to where it began."""
        begin, longest = self._leading.now, LONGEST_WAY_BACK
        longest += (self._start[2] - self.lowest) / BACK_SPEED
        fastest = max(BACK_SPEED, self._settings.speed)
        self._way, self._has_jogged, self._highest = 1, False, self._height
        while self._way > 0:
            # By measured heights alone: a position is another place to who believes in other
            # offsets.
            left = self._start[2] - self._height
            if left < BACK_TOLERANCE:
                self._way = 0
            elif self._has_closed:
                self._fail("the contact closes on the way back")
            elif self._highest - self._height > LARGEST_FALL:
                self._fail("the platform moves down on its way back")
            elif self._leading.now - begin > longest:
                text = f"the platform is not back after {number_text(longest, 3)} s"
                self._fail(f"{text}: {self._leading.machine}")
            else:
                yield from self._jog(min(fastest, left / SLOWING))

    def _rest(self) -> Course[None]:
        """Come to rest, until ik_node has told that, too: a late state would end the way back."""
        begin = self._leading.now
        while (passed := self._leading.now - begin) <= LONGEST_STOP:
            yield from self._jog(0.0)
            with suppress(RecordingError):
                self._leading.record.resting(self._leading.now)
                if self._leading.machine.state is IDLE and passed > LETTING_GO:
                    return
        raise LeadingError(f"the sliders do not come to rest within {LONGEST_STOP:g} s")

    def _jog(self, speed: float) -> Course[None]:
        """Have the platform move upwards with a ``speed`` [m/s] until the next look."""
        leading = self._leading
        if speed != self._sent or leading.now >= self._due:
            self._jogged.jog(speed)
            self._sent, self._due = speed, leading.now + TWIST_PERIOD
        timeout = self._settings.contact_timeout or LONGEST_SILENCE
        gap = yield from leading.next_look(max(min(LONGEST_SILENCE, timeout), LONGEST_LOOK))
        if gap > LONGEST_LOOK:
            # A short time in which we were kept from listening is no silence of others.
            self._heard += gap
            self._measured += gap
        if self._way and leading.now - self._measured > LONGEST_SILENCE:
            raise LeadingError(f"no measured heights for {LONGEST_SILENCE:g} s")

    def _fail(self, failure: str) -> None:
        """Note what went wrong, and come to rest."""
        self.failures.append(failure)
        self._way = 0


def probe(
    leading: Leading,
    machine: JoggedMachine,
    place_of: Callable[[Vector3], Vector3],
    settings: ProbeSettings,
) -> Course[ProbeResult]:
    """Probe from where the sliders rest, and come back.

    Args:
        leading: that lets it lead.
        machine: that takes twists.
        place_of: tells where the platform is at reported heights, and may raise a KinematicsError.
        settings: how to probe.

    Raises:
        LeadingError: if that is not possible now, or there was no contact that counts.
        KinematicsError: if the measured heights do not rest, or are those of no place.
    """
    stops = leading.stops
    heights = yield from leading.resting_heights()
    leading.check_not_stopped(stops)
    silence = leading.now - leading.switch_heard
    if leading.is_touched is None:
        raise LeadingError("no message has come on the topic contact yet")
    if 0.0 < settings.contact_timeout < silence:
        raise LeadingError(f"contact is silent for {silence:.3g} s")
    if leading.is_touched:
        raise LeadingError("the contact is closed already: move the platform up first")
    if not machine.is_there:
        raise LeadingError("there is no ik_node that could move the platform")
    leading.check_idle()
    made = Probe(leading, machine, place_of, settings, heights)
    yield from leading.lead(made, made.led(), "a probe")
    touched, overrun, texts = made.heights, 0.0, [*made.failures]
    if made.contact_stamp is not None:
        try:
            touched = touched or leading.record.at(made.contact_stamp)
            overrun = place_of(touched)[2] - made.lowest
        except KinematicsError as error:
            texts.append(str(error))
    if leading.is_touched and not made.failures:
        texts.append("the contact does not open again")
    text = "; ".join(texts)
    if touched is None:
        raise LeadingError(text)
    return ProbeResult(touched, overrun, text)
