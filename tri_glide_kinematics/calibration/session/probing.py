"""Decides how a probe goes on: down until a contact, to rest, back up.

It reads no clock, and knows no ROS: a ``JoggedMachine`` takes twists.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from tri_glide_kinematics.calibration.session.leading import (
    Course,
    Delivery,
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


class ProbePhase(Enum):
    """The phase of a probe."""

    DOWN = "moves down"
    STOPPING = "comes to rest"
    BACK = "moves back"
    RESTING = "comes to rest at the end"
    ENDED = "has ended"


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


class Probe:
    """One probe, from the first step down until the platform rests again.

    Attributes:
        phase: what it does.
        contact_stamp: when the contact was made, by the clock of the machine [s]; None before.
        failure: what went wrong, in words; None if nothing did.
        lowest: where the platform was farthest down [m].
    """

    def __init__(self, settings: ProbeSettings, start: Vector3, now: float) -> None:
        """Begin at rest.

        Args:
            settings: how to probe.
            start: where the platform is. Shape (3,) [m].
            now: time of a steady clock, as in all that follows [s].
        """
        self.phase = ProbePhase.DOWN
        self.contact_stamp: float | None = None
        self.failure: str | None = None
        self.lowest = start[2]
        self._settings = settings
        self._start = start
        self._heard = self._measured = self._changed = self._stepped = now
        self._progress = (now, start[2])
        self._has_jogged = False
        self._height = self._highest = start[2]
        self._is_open = False
        self._machine = MachineView()
        # The stops of ik_node when the probe began.
        self._stops: int | None = None

    def contact(self, is_touched: bool, sent: float, now: float) -> None:
        """Take in what the switch says, sent when by the clock of the machine [s]."""
        self._heard = now
        if is_touched and self.phase is ProbePhase.DOWN:
            # A contact has no time of its own: that at which it was sent comes nearest.
            self.contact_stamp = sent - self._settings.contact_delay
            self._go_to(ProbePhase.STOPPING, now)
        elif self.phase is ProbePhase.BACK:
            if is_touched and self._is_open and self._height > self.lowest + CHATTER:
                self._halt("the contact closes on the way back", now)
            self._is_open = not is_touched

    def measured(self, position: Vector3, now: float) -> None:
        """Take in where the platform is measured to be [m]."""
        (x, y, z), (x0, y0, z0) = position, self._start
        self._measured, self._height = now, z
        self.lowest = min(self.lowest, z)
        if self.phase is ProbePhase.ENDED:
            return
        away = max(math.hypot(x - x0, y - y0), z - z0)
        if away > LARGEST_DEVIATION:
            self.end(
                f"the platform is {number_text(1e3 * away, 3)} mm away from its way down: "
                "somebody else leads it"
            )
        elif self.phase is ProbePhase.DOWN:
            self._look_down(z, now)
        elif self.phase is ProbePhase.BACK:
            self._look_up(z, now)

    def _look_down(self, z: float, now: float) -> None:
        settings, (since, height) = self._settings, self._progress
        if self._start[2] - z > settings.depth:
            self._fail(f"no contact on {number_text(1e3 * settings.depth, 6)} mm", now)
        elif now - since > PATIENCE:
            if height - z < LEAST_PART * settings.speed * PATIENCE:
                self._fail(f"the platform does not go down: {self._machine}", now)
            self._progress = (now, z)

    def _look_up(self, z: float, now: float) -> None:
        self._highest = max(self._highest, z)
        if self._highest - z > LARGEST_FALL:
            self._halt("the platform moves down on its way back", now)
        elif z > self._start[2] - BACK_TOLERANCE:
            self._go_to(ProbePhase.RESTING, now)

    def machine(self, view: MachineView, now: float) -> None:
        """Take in what ik_node tells of itself."""
        self._machine = view
        # That a twist came late is no reason to give up: the next one is on its way.
        is_late = view.cause is Cause.TWISTS_SILENT
        is_stopped = view.state in (IDLE, STOPPING) and not is_late
        is_sent = self.phase in (ProbePhase.DOWN, ProbePhase.BACK)
        if is_sent and self._has_jogged and is_stopped:
            self.end(f"it was stopped: {view.text}")
        self._has_jogged |= view.state is JOGGING
        if self._stops is None:
            self._stops = view.stops
        # In these states it does what we have asked for.
        if view.state not in (IDLE, JOGGING, STOPPING):
            self.end(str(view))
        # The state tells nothing of a stop while nothing moved.
        if view.stops != self._stops:
            self.end(WAS_STOPPED)

    def end(self, failure: str) -> None:
        """End at once: whoever leads the machine is left to it, and without twists it stops."""
        if self.phase is not ProbePhase.ENDED:
            self._note(failure)
            self.phase = ProbePhase.ENDED

    def at_rest(self, now: float) -> None:
        """Take in that the sliders rest."""
        # A state that is still to come would be taken for one of the way back.
        if self.phase is ProbePhase.STOPPING and self._machine.state is IDLE:
            self._has_jogged, self._highest = False, self._height
            self._go_to(ProbePhase.BACK, now)

    def step(self, now: float) -> float | None:
        """Return how fast ik_node has to move upwards now [m/s]; None for nothing to be told."""
        self._look_at_own_gap(now)
        if self.phase in (ProbePhase.DOWN, ProbePhase.BACK):
            self._listen(now)
        self._look_at_time(now)
        if self.phase is ProbePhase.ENDED:
            return None
        if self.phase is ProbePhase.DOWN:
            is_letting_go = now - self._changed < LETTING_GO
            return 0.0 if is_letting_go else -self._settings.speed
        return self._speed_back() if self.phase is ProbePhase.BACK else 0.0

    def _speed_back(self) -> float:
        """Return the speed upwards [m/s].

        By measured heights alone: a position is another place to who believes in other offsets.
        """
        fastest = max(BACK_SPEED, self._settings.speed)
        return min(fastest, max(0.0, self._start[2] - self._height) / SLOWING)

    def _look_at_time(self, now: float) -> None:
        """End what takes too long, and what is at rest at the end."""
        passed = now - self._changed
        if self.phase is ProbePhase.BACK:
            longest = LONGEST_WAY_BACK + (self._start[2] - self.lowest) / BACK_SPEED
            if passed > longest:
                self._halt(
                    f"the platform is not back after {number_text(longest, 3)} s: {self._machine}",
                    now,
                )
        elif (
            self.phase is ProbePhase.RESTING and self._machine.state is IDLE and passed > LETTING_GO
        ):
            self._go_to(ProbePhase.ENDED, now)
        elif self.phase in (ProbePhase.STOPPING, ProbePhase.RESTING) and passed > LONGEST_STOP:
            self.end(f"the sliders do not come to rest within {LONGEST_STOP:g} s")

    def _look_at_own_gap(self, now: float) -> None:
        """Count a short time in which we were kept from listening as no silence of others.

        After a longer one nobody knows what has happened meanwhile.
        """
        gap, self._stepped = now - self._stepped, now
        longest = min(LONGEST_SILENCE, self._settings.contact_timeout or LONGEST_SILENCE)
        if gap > max(longest, LONGEST_LOOK):
            self.end(f"this node was held up for {number_text(gap, 3)} s")
        elif gap > LONGEST_LOOK:
            self._heard += gap
            self._measured += gap

    def _listen(self, now: float) -> None:
        timeout = self._settings.contact_timeout
        if now - self._measured > LONGEST_SILENCE:
            self.end(f"no measured heights for {LONGEST_SILENCE:g} s")
        elif self.phase is ProbePhase.DOWN and 0.0 < timeout < now - self._heard:
            self._fail(f"nothing about the contact for {number_text(timeout, 3)} s", now)

    def _fail(self, failure: str, now: float) -> None:
        """Come to rest and go back."""
        self.failure = failure
        self._go_to(ProbePhase.STOPPING, now)

    def _halt(self, failure: str, now: float) -> None:
        """Come to rest where it is, and end."""
        self._note(failure)
        self._go_to(ProbePhase.RESTING, now)

    def _note(self, failure: str) -> None:
        self.failure = "; ".join(filter(None, (self.failure, failure)))

    def _go_to(self, phase: ProbePhase, now: float) -> None:
        self.phase = phase
        self._changed = now


class JoggedMachine(Protocol):
    """What a probe asks for."""

    @property
    def is_there(self) -> bool:
        """Whether anybody tells the state of the machine."""

    def jog(self, upwards: float) -> None:
        """Let it move upwards with this speed [m/s], for a moment."""


class ProbeDriver:
    """Makes one probe at a time, as what comes in from the machine lets it."""

    def __init__(
        self, leading: Leading, machine: JoggedMachine, place_of: Callable[[Vector3], Vector3]
    ) -> None:
        """Be ready.

        Args:
            leading: that lets it lead.
            machine: that takes twists.
            place_of: tells where the platform is at reported heights, and may raise a
                KinematicsError.
        """
        self._leading = leading
        self._machine = machine
        self._place_of = place_of
        self._probe: Probe | None = None
        self._is_touched: bool | None = None
        self._heard = 0.0

    def probe(self, settings: ProbeSettings) -> Course[ProbeResult]:
        """Probe from where the sliders rest, and come back.

        Raises:
            LeadingError: if that is not possible now, or there was no contact that counts.
            KinematicsError: if the measured heights do not rest, or are those of no place.
        """
        leading = self._leading
        stops = leading.stops
        heights = yield from leading.resting_heights()
        leading.check_not_stopped(stops)
        silence = leading.now - self._heard
        if self._is_touched is None:
            raise LeadingError("no message has come on the topic contact yet")
        if 0.0 < settings.contact_timeout < silence:
            raise LeadingError(f"contact is silent for {silence:.3g} s")
        if self._is_touched:
            raise LeadingError("the contact is closed already: move the platform up first")
        if not self._machine.is_there:
            raise LeadingError("there is no ik_node that could move the platform")
        leading.check_idle()
        self._probe = probe = Probe(settings, self._place_of(heights), leading.now)
        probe.machine(leading.machine, leading.now)
        yield from leading.lead(self._led(probe), "a probe", probe.end)
        self._probe = None
        return self._result(probe)

    def contact(self, is_touched: bool, delivery: Delivery) -> None:
        """Take in what the switch says."""
        self._is_touched, self._heard = is_touched, delivery.now
        if self._probe is not None:
            self._probe.contact(is_touched, delivery.sent, delivery.now)

    def measured(self, heights: Vector3, now: float) -> None:
        """Take in reported heights [m], received ``now`` [s]."""
        if self._probe is not None:
            # Heights that have no place are no progress: the probe finds that out by itself.
            with suppress(KinematicsError):
                self._probe.measured(self._place_of(heights), now)

    def machine(self, view: MachineView, now: float) -> None:
        """Take in what ik_node tells of itself."""
        self._leading.machine = view
        if self._probe is not None:
            self._probe.machine(view, now)

    def target_pose(self) -> None:
        """Notice a command that our next twist takes the place of before it makes a state."""
        if self._probe is not None:
            self._probe.end("another node sends a target pose")

    def _led(self, probe: Probe) -> Course[None]:
        """Tell ik_node what it has to do, until the probe has ended."""
        leading, sent, due = self._leading, None, 0.0
        while True:
            now = leading.now
            if probe.phase is ProbePhase.STOPPING:
                with suppress(RecordingError):
                    leading.record.resting(now)
                    probe.at_rest(now)
            speed = probe.step(now)
            if speed is not None and (speed != sent or now >= due):
                self._machine.jog(speed)
                sent, due = speed, now + TWIST_PERIOD
            if probe.phase is ProbePhase.ENDED:
                return
            yield

    def _result(self, probe: Probe) -> ProbeResult:
        heights, overrun, texts = None, 0.0, [probe.failure]
        if probe.contact_stamp is not None:
            try:
                heights = self._leading.record.at(probe.contact_stamp)
                overrun = self._place_of(heights)[2] - probe.lowest
            except KinematicsError as error:
                texts.append(str(error))
        if self._is_touched and probe.failure is None:
            texts.append("the contact does not open again")
        text = "; ".join(filter(None, texts))
        if heights is None:
            raise LeadingError(text)
        return ProbeResult(heights, overrun, text)
