"""SIGINT and SIGTERM: which of them have come, and what is done when one comes."""

from __future__ import annotations

import signal
from collections.abc import Callable


class EndSignals:
    """Handles both for a process, from its making on.

    Handlers of rclpy that are replaced while a node gets ready lose a signal that comes then. This
    one stays, and rclpy's are not installed at all, or call it beside what they do themselves.

    Attributes:
        came: numbers of those that have come, the first one first.
    """

    def __init__(self) -> None:
        """Handle them from now on."""
        self.came: list[int] = []
        self._stop: Callable[[], None] = lambda: None
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._handle)

    def call(self, stop: Callable[[], None]) -> None:
        """Let each of them call ``stop``, at once if one has come."""
        self._stop = stop
        if self.came:
            stop()

    def _handle(self, number: int, _: object) -> None:
        self.came.append(number)
        self._stop()
