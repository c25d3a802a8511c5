"""Requests of the operator, jogs by buttons among them, and why some are not fulfilled.

The node fulfils the requests of the page that has the controls.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import viser

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.link import MachineLink
from tri_glide_kinematics.vectors import Vector3, scaled

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


# Requests of the operator: the node fulfils those of the page that has the controls.


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


# A refusal is shown for so long [s].
REFUSAL_SHOWN = 12.0

Wish = Callable[[], None]
Event = Any


def no_choice(handle: Any, value: object) -> str:
    """Return why a list or a group of buttons has no such choice; empty if it has.

    viser takes any text for a choice.
    """
    if value in getattr(handle, "options", (value,)):
        return ""
    return f"nothing done: there is no choice {str(value)[:20]!r}"


class OperatorRequests:
    """The requests of the operator, and who has the controls.

    Stop and the renewals of a held jog go to the machine straight from the thread that hears the
    page. Everything else is a wish, which the node's own thread fulfils. Stop drops all wishes that
    are older than itself, but not the changes of inputs: they move nothing, and are shown already.

    Attributes:
        server: of the page.
        gui: of the page, to whose open container all that the operator uses is added.
        controls: who has them.
        link: to the machine.
        refusal: what was refused last, and why; empty after a while.
        history: of what all pages were told.
        on_stop: ends, where the node spins, what is still on its way.
    """

    def __init__(self, link: MachineLink, server: viser.ViserServer) -> None:
        """Send by ``link``, whose refusals are shown on the pages of a ``server``."""
        self.server, self.gui = server, server.gui
        self.controls = Controls()
        self.link = link
        link.on_refusal = self.refuse
        self.refusal = ""
        self.history = MessageHistory()
        self.on_stop: list[Wish] = []
        self._refused_at = 0.0
        self._hold = HeldJog()
        # With whether they outlast Stop.
        self._wishes: deque[tuple[Wish, bool]] = deque()
        self._wishes_lock = threading.Lock()

    def refuse(self, reason: str, log: str = "") -> None:
        """Show why something is not done; ``log`` is what ``ik_node`` has written about it."""
        self.refusal, self._refused_at = reason, time.monotonic()
        self.history.add("refusal", reason, log)

    def may(self, page: int) -> bool:
        """Tell whether a ``page`` may act, and say who may if it may not."""
        holder = self.controls.holder
        if holder == page:
            return True
        who = "nobody: take them first" if holder is None else name_of(holder)
        self.refuse(f"{name_of(page)}: nothing done, as the controls are with {who}")
        return False

    def wish(self, wish: Wish, *, outlasts_stop: bool = False) -> None:
        """Have something done where the node spins; what ``outlasts_stop`` moves nothing."""
        with self._wishes_lock:
            self._wishes.append((wish, outlasts_stop))

    def on(self, wish: Callable[[Any], None]) -> Callable[[Event], Any]:
        """Return a callback of viser that fulfils a wish, if its page has the controls.

        The ``wish`` gets the value of what was pressed.
        """

        async def call(event: Event) -> None:
            if event.client_id is None:
                return
            if self.may(event.client_id):
                value = getattr(event.target, "value", None)
                if refusal := no_choice(event.target, value):
                    self.refuse(refusal)
                    return
                self.wish(lambda: wish(value))

        return call

    def fulfil(self) -> None:
        """Do what is wished; called where the node spins."""
        while (wish := self._next()) is not None:
            try:
                wish()
            except KinematicsError as error:
                self.refuse(str(error))
        if self.refusal and time.monotonic() - self._refused_at > REFUSAL_SHOWN:
            self.refusal = ""

    async def stop(self, _: Event) -> None:
        """Stop the machine: any page may, at any time."""
        self.link.stop()
        self._hold.end()
        with self._wishes_lock:
            self._wishes = deque(each for each in self._wishes if each[1])
        # A wish that is being fulfilled at this moment comes to its end before this.
        self.wish(self._end_what_is_on_its_way)

    def _end_what_is_on_its_way(self) -> None:
        for end in self.on_stop:
            end()

    async def release(self, event: Event) -> None:
        """End the jog of a page at once."""
        self._end_hold(event.client_id)

    def hold(self, event: Event, direction: Vector3, speed: Callable[[], float]) -> None:
        """Jog at a ``speed`` [m/s] while a button is held: called again and again."""
        page, velocity = event.client_id, None
        try:
            velocity = scaled(direction, speed()) if self.may(page) else None
        except KinematicsError as error:
            self.refuse(str(error))
        if velocity is None:
            self._end_hold(page)
            # Should it get the controls now, or show a number, it has to press again.
            self._hold.bar(page)
        elif self._hold.renew(page, direction, time.monotonic()):
            self.link.jog(velocity)

    def end_hold(self) -> None:
        """Let a button that is held move nothing before it was released."""
        self._hold.end()

    def follow_twist_timeout(self, timeout: float) -> None:
        """End a hold before ``ik_node`` does, which then takes the next twist as a new jog [s]."""
        self._hold.longest_gap = min(LONGEST_GAP, 0.9 * timeout)

    def give(self, page: int) -> None:
        """Give up the controls of a page, and end what it did."""
        if self._end_hold(page):
            self._hold.bar(page)
        self.controls.give(page)

    async def leave(self, event: Event) -> None:
        """Give up the controls of a page that shows another address now."""
        self.give(event.client_id)

    async def opened(self, client: viser.ClientHandle) -> None:
        """Note that a page is there."""
        self.controls.opened(client.client_id)

    async def closed(self, client: viser.ClientHandle) -> None:
        """Note that a page has vanished, and end what it did."""
        self._end_hold(client.client_id)
        self.controls.closed(client.client_id)

    def answers(self, page: int, is_there: bool) -> None:
        """Take a page that does not answer for one that has vanished, until it does again."""
        if is_there:
            self.controls.opened(page)
            return
        self._end_hold(page)
        # When it comes back, it has to press again.
        self._hold.bar(page)
        self.controls.closed(page)

    def _next(self) -> Wish | None:
        with self._wishes_lock:
            return self._wishes.popleft()[0] if self._wishes else None

    def _end_hold(self, page: int) -> bool:
        is_jog = self._hold.release(page)
        if is_jog:
            self.link.jog()
        return is_jog
