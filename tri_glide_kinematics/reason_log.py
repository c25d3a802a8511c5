"""Logs why something was refused, without letting a flood of refusals flood the log."""

from __future__ import annotations

from collections.abc import Callable

from tri_glide_kinematics.errors import Refusal


class ReasonLog:
    """Counts reasons and passes on the first ones of each second; all others become one line.

    A reason that is given again and again is passed on once a second.

    Attributes:
        total: reasons since the start.
        last: the latest reason, empty if there was none.
    """

    def __init__(self, write: Callable[[str], object], lines_per_second: int) -> None:
        """Use ``write`` for at most ``lines_per_second`` single reasons between two seconds."""
        self.total = 0
        self.last = ""
        self._write = write
        self._allowed = lines_per_second
        self._count = 0
        self._lines = 0

    def add(self, reason: str) -> None:
        """Count a reason, and log it unless there were too many."""
        repeated = self._count > 0 and reason == self.last
        self.total += 1
        self._count += 1
        self.last = reason
        if self._lines < self._allowed and not repeated:
            self._lines += 1
            self._write(reason)

    def end_of_second(self) -> int:
        """Log how many were left out, start a new second, and return how many there were."""
        count, lines = self._count, self._lines
        self._count = self._lines = 0
        if count > lines:
            self._write(f"{count - lines} more in the last second; the latest: {self.last}")
        return count


class RefusalLog(ReasonLog):
    """Logs why commands were refused.

    Attributes:
        refusal: why the latest one was, for programs.
    """

    refusal = Refusal.NONE

    def refuse(self, text: str, refusal: Refusal) -> None:
        """Count a refusal, and log its ``text`` unless there were too many."""
        self.refusal = refusal
        self.add(text)
