"""The operators: which page has the controls, what its held buttons do, and what all were told."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from tri_glide_kinematics.vectors import Vector3

# Jogs by buttons that are held.

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


# The history of messages: what the page has told its operators, and when.

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
        press: the button that shows what it is about; empty for none.
    """

    time: float
    color: str
    text: str
    log: str = ""
    count: int = 1
    press: str = ""

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

    def add(self, color: str, text: str, log: str = "", press: str = "") -> None:
        """Add a message; one that is told again is counted."""
        entry = Entry(time.time(), color, text[:LONGEST], log[:LONGEST], press=press)
        with self._lock:
            newest = self._entries[0] if self._entries else None
            told = newest and (newest.color, newest.text, newest.press)
            if newest is not None and told == (color, entry.text, press):
                self._entries.popleft()
                entry = replace(entry, count=newest.count + 1)
            self._entries.appendleft(entry)
            self.changes += 1


@dataclass
class Controls:
    """The page that has the controls, and the one that asks for them.

    The first page has them until it gives them up or vanishes. Then the page that asks gets them.
    If none does, a page has to take them: nobody who only looks on is made the operator.

    Attributes:
        holder: number of the page that has them, None if nobody does.
        asking: pages that ask the holder for them, the first one first.
        pages: all that are open, the oldest first.
    """

    holder: int | None = None
    asking: list[int] = field(default_factory=list)
    pages: list[int] = field(default_factory=list)

    def opened(self, page: int) -> None:
        """Note that a ``page`` is there; alone, it gets the controls."""
        if page in self.pages:
            return
        self.pages.append(page)
        if len(self.pages) == 1:
            self.holder = page

    def closed(self, page: int) -> None:
        """Note that a ``page`` has vanished: if it had the controls, whoever asks gets them."""
        self._forget(page)
        if page in self.pages:
            self.pages.remove(page)
        self.give(page)

    def ask(self, page: int) -> bool:
        """Take the controls if nobody has them, or ask for them; return whether they are taken."""
        if page not in self.pages:
            return False
        if self.holder is None:
            self.holder = page
            self._forget(page)
        elif self.holder != page and page not in self.asking:
            self.asking.append(page)
        return self.holder == page

    def give(self, page: int) -> None:
        """Give the controls of a ``page`` to the first that asks, or to nobody."""
        if self.holder == page:
            self.holder = self.asking.pop(0) if self.asking else None

    def _forget(self, page: int) -> None:
        if page in self.asking:
            self.asking.remove(page)


def name_of(page: int) -> str:
    """Return what a page is called on all of them."""
    return f"page {page + 1}"
