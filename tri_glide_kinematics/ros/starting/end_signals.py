"""SIGINT and SIGTERM: which of them have come, and what is done when one comes."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable


class EndSignals:
    """Handles both for a process, from its making on.

    Handlers of rclpy that are replaced while a node gets ready lose a signal that comes then. This
    one stays; those of rclpy are not installed at all, or later, and then call this one, too. While
    there is nothing to stop yet, a second signal ends the process at once.

    Attributes:
        came: numbers of those that have come, the first one first.
    """

    def __init__(self) -> None:
        """Handle them from now on."""
        self.came: list[int] = []
        self._stop: Callable[[], None] | None = None
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._handle)

    def call(self, stop: Callable[[], None]) -> None:
        """Let each of them call ``stop``, at once if one has come."""
        self._stop = stop
        if self.came:
            stop()

    def _handle(self, number: int, _: object) -> None:
        self.came.append(number)
        if self._stop is not None:
            self._stop()
        elif len(self.came) > 1:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
