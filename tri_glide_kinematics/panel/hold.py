"""A jog that lasts for as long as somebody holds a button."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.vectors import Vector3

# How often the page says that the button is held [1/s].
RENEWALS = 30.0

# A renewal that comes later than this after the one before it does not renew anything [s].
LONGEST_GAP = 0.25

Hold = tuple[int, Vector3]


@dataclass
class HeldJog:
    """Tells which of the messages of held buttons move the machine.

    The first one never does: a button that is held sends the next one at once. A page that nobody
    sees is given a turn once a second, so what it sends then, for a button that was never released,
    does not move anything.

    Attributes:
        held: the page and the direction of the newest message, None if nothing is held.
    """

    held: Hold | None = None
    _time: float = 0.0

    def renew(self, page: int, direction: Vector3, now: float) -> bool:
        """Take a message of a held button; return whether the machine may move by it.

        Args:
            page: that sends it.
            direction: of the button.
            now: time.monotonic() [s].
        """
        goes_on = self.held == (page, direction) and now - self._time <= LONGEST_GAP
        self.held, self._time = (page, direction), now
        return goes_on

    def release(self, page: int | None = None) -> bool:
        """End what a ``page`` holds, or what any does; return whether there was something."""
        if self.held is None or (page is not None and self.held[0] != page):
            return False
        self.held = None
        return True
