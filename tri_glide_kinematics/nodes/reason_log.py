"""Logs why something was refused, without letting a flood of refusals flood the log."""

from __future__ import annotations

from collections.abc import Callable


class ReasonLog:
    """Counts reasons and passes on the first ones of each second; the rest become one line.

    Attributes:
        total: reasons since the start.
        last: the latest reason, empty if there was none.
        recent: reasons since the last call of ``end_of_second``.
    """

    def __init__(self, write: Callable[[str], object], lines_per_second: int) -> None:
        """Use ``write`` for at most ``lines_per_second`` single reasons between two seconds."""
        self.total = 0
        self.recent = 0
        self.last = ""
        self._write = write
        self._allowed = lines_per_second

    def add(self, reason: str) -> None:
        """Count a reason, and log it unless there were too many."""
        self.total += 1
        self.recent += 1
        self.last = reason
        if self.recent <= self._allowed:
            self._write(reason)

    def end_of_second(self) -> int:
        """Log how many were left out, start a new second, and return how many there were."""
        count, self.recent = self.recent, 0
        if count > self._allowed:
            self._write(f"{count - self._allowed} more in the last second; the latest: {self.last}")
        return count
