"""When something that is not done in each frame is due again."""

import math
from time import monotonic


class Pace:
    """Tells at most once in a period that something is due."""

    def __init__(self, period: float) -> None:
        """Let it be due at once, and again after each ``period`` [s]."""
        self._period = period
        self._next = -math.inf

    def is_due(self, now: float | None = None) -> bool:
        """Return whether it is due by a steady clock [s]; a clock that goes back begins anew."""
        now = monotonic() if now is None else now
        if self._next - self._period <= now < self._next:
            return False
        self._next = now + self._period
        return True

    def hurry(self) -> None:
        """Let it be due at once."""
        self._next = -math.inf
