"""Whether there is time for another piece of planning, by how long the last ones took."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

# A piece is taken to last as long as the longest before it, which counts for this much less after
# each: one that was interrupted by another process is soon forgotten.
FORGETTING = 0.8


class PlanningTime:
    """Ends planning before a piece that would last too long, not after it."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        """Expect short pieces; ``clock`` returns seconds."""
        self._clock = clock
        self._expected = 0.0

    def until(self, end: float) -> Callable[[], bool]:
        """Return what is asked after each piece, from now on, whether there is time for another.

        Args:
            end: by the clock [s].
        """
        begin = self._clock()

        def may_go_on() -> bool:
            nonlocal begin
            now = self._clock()
            self._expected = max(now - begin, FORGETTING * self._expected)
            begin = now
            return now + self._expected < end

        return may_go_on

    def is_short(self, end: float) -> bool:
        """Return whether a piece that begins now is likely to end before ``end`` [s]."""
        return self._clock() + self._expected < end
