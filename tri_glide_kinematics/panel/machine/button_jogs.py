"""Jogs by buttons: held, or step by step."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tri_glide_kinematics.control import IDLE, JOGGING, MOVING, Cause, OperatingState
from tri_glide_kinematics.vectors import Vector3

# How often the page says that the button is held [1/s].
RENEWALS = 30.0

# A renewal that comes later than this after the one before it does not renew anything [s]. It is
# less than the usual twist_timeout of ik_node, which takes a longer pause for the end of a jog.
LONGEST_GAP = 0.09

# Messages that come faster were kept up on their way: they say nothing about the present [s].
SHORTEST_GAP = 0.01

Hold = tuple[int, Vector3]


@dataclass
class HeldJog:
    """Tells which of the messages of held buttons move the machine.

    The first one never does: a button that is held sends the next one at once. A page that nobody
    sees is given a turn once a second, so what it sends then, for a button that was never released,
    does not move anything. What somebody has ended while the button was held goes on no more before
    the page has said that it is released.

    Attributes:
        held: the page and the direction of the newest message, None if nothing is held.
        longest_gap: longest time between two messages [s].
    """

    held: Hold | None = None
    longest_gap: float = LONGEST_GAP
    _time: float = 0.0
    _has_moved: bool = False
    _ended: set[int] = field(default_factory=set)

    def renew(self, page: int, direction: Vector3, now: float) -> bool:
        """Take a message of a held button; return whether the machine may move by it.

        ``now`` is time.monotonic() [s].
        """
        gap = now - self._time
        is_same = self.held == (page, direction)
        self.held, self._time = (page, direction), now
        if not is_same:
            self._has_moved = False
            return False
        moves = page not in self._ended and SHORTEST_GAP <= gap <= self.longest_gap
        self._has_moved |= moves
        return moves

    def end(self) -> None:
        """Let what is held move nothing before it is released."""
        held = self.held
        if held is not None:
            self._ended.add(held[0])

    def bar(self, page: int) -> None:
        """Let what a ``page`` holds move nothing before it is released."""
        self._ended.add(page)

    def release(self, page: int) -> bool:
        """Note that a ``page`` holds nothing any more; return whether that ends a jog."""
        was_ended = page in self._ended
        self._ended.discard(page)
        if self.held is None or self.held[0] != page:
            return False
        self.held = None
        return self._has_moved and not was_ended


@dataclass
class JogWatch:
    """Tells by what ``ik_node`` says about itself when a jog was ended by somebody else.

    A jog whose messages were late for a moment, as a busy browser sends them, was not.
    """

    _has_jogged: bool = False

    def has_ended(self, state: OperatingState | None, cause: Cause | None) -> bool:
        """Take a state and its cause; return whether what is held must not go on."""
        if state is JOGGING:
            self._has_jogged = True
        elif self._has_jogged and cause is not Cause.TWISTS_SILENT:
            self._has_jogged = False
            return True
        return False


# Until a step that was sent is seen as a motion [s].
STEP_PATIENCE = 0.5


@dataclass
class Steps:
    """Remembers where the last step leads to.

    The next one goes on from there if nothing has come in between. If something has, it begins
    where the platform is: it must not lead to where nobody wants it to go any more.

    Attributes:
        target: of the last step, None if it counts no more [m].
    """

    target: Vector3 | None = None
    _sent_at: float = -math.inf

    def drop(self) -> None:
        """Let the next step begin where the platform is."""
        self.target = None

    def look(self, state: OperatingState | None) -> None:
        """Drop the last step if the machine does something else by now."""
        if state not in (IDLE, MOVING):
            self.drop()

    def go_on(
        self,
        step: Vector3,
        place: Vector3 | None,
        state: OperatingState | None,
        *,
        is_on_way: bool,
        now: float,
    ) -> Vector3 | None:
        """Return the target of another step, None if it is not known where that begins [m].

        Args:
            step: by how much to go on [m].
            place: where the platform is commanded to be, None if that is not known [m].
            state: of the machine.
            is_on_way: whether the goal of the last step has not ended.
            now: time.monotonic() [s].
        """
        if not (is_on_way and (state is MOVING or now - self._sent_at < STEP_PATIENCE)):
            self.drop()
        start = self.target or place
        if start is not None:
            x, y, z = start
            self.target = (x + step[0], y + step[1], z + step[2])
            self._sent_at = now
        return self.target
