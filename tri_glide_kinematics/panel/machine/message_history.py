"""The history of messages: what the page has told its operators, and when."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

# As many are kept, and of each so many characters.
KEPT = 100
LONGEST = 300


@dataclass(frozen=True)
class Entry:
    """A message.

    Attributes:
        time: when it was told last, by the clock of this computer [s].
        color: of the state, or ``refusal``.
        text: in the words of the page.
        log: what ``ik_node`` wrote about it, in metres; empty for nothing.
        count: how often it was told, one time after the other.
    """

    time: float
    color: str
    text: str
    log: str = ""
    count: int = 1

    @property
    def clock(self) -> str:
        """The time of day."""
        return time.strftime("%H:%M:%S", time.localtime(self.time))


class MessageHistory:
    """Keeps the last messages, the newest first. Any thread may add one.

    Attributes:
        changes: how often something was added.
    """

    def __init__(self) -> None:
        """Know of nothing."""
        self.changes = 0
        self._entries: deque[Entry] = deque(maxlen=KEPT)
        self._lock = threading.Lock()

    def __iter__(self) -> Iterator[Entry]:
        """Return all, the newest first."""
        with self._lock:
            return iter(tuple(self._entries))

    def add(self, color: str, text: str, log: str = "") -> None:
        """Add a message; one that is told again is counted."""
        entry = Entry(time.time(), color, text[:LONGEST], log[:LONGEST])
        with self._lock:
            newest = self._entries[0] if self._entries else None
            if newest is not None and (newest.color, newest.text) == (color, entry.text):
                self._entries.popleft()
                entry = replace(entry, count=newest.count + 1)
            self._entries.appendleft(entry)
            self.changes += 1
