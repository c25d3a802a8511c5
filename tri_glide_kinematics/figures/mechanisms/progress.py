"""A progress bar for work that turns out to be long."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import TextIO

WIDTH = 24


class ProgressBar:
    """Shows how many steps are done, on stderr, and only once a second has gone by.

    On a terminal it stays on one line; elsewhere it writes a line for every tenth of the work.
    """

    def __init__(
        self,
        total: int,
        stream: TextIO | None = None,
        delay: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Start the clock.

        Args:
            total: number of steps; may be changed while the work goes on.
            stream: to write to; stderr if there is none.
            delay: time before anything is shown [s].
            clock: returns the time [s].
        """
        self.total = total
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._clock = clock
        self._show_from = clock() + delay
        self._begun = 0
        self._shown = -1

    def step(self, label: str) -> None:
        """Say what begins now; whatever began before it is done."""
        done = self._begun
        self._begun += 1
        if self._clock() >= self._show_from:
            self._show(done, label)

    def _show(self, done: int, label: str) -> None:
        """Write the state unless the same one stands there already."""
        parts = 100 if self._terminal else 10
        part = done * parts // self.total
        if part == self._shown:
            return
        self._shown = part
        filled = done * WIDTH // self.total
        bar = "#" * filled + "-" * (WIDTH - filled)
        text = f"[{bar}] {100 * done // self.total:3d} %  {label}"
        # The escape sequence erases the rest of a longer label before it.
        self._stream.write(f"\r{text}\x1b[K" if self._terminal else f"{text}\n")
        self._stream.flush()

    def __enter__(self) -> ProgressBar:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Complete the bar if the work is complete, and leave its line."""
        if self._shown >= 0:
            if kind is None:
                self._show(self.total, "done")
            if self._terminal:
                self._stream.write("\n")
