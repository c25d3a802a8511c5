"""Pseudo-terminals with simulated drives behind them, which speak slcan as an adapter does."""

from __future__ import annotations

import os
import select
import time
import tty
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Protocol

from tri_glide_kinematics.drives.frames import CobId, Frame, LineReader, encoded

# Longest time between two looks at the drives behind a terminal [s].
LONGEST_WAIT = 0.005
# What one who does not read may leave unread [bytes].
MOST_UNREAD = 65536


class Member(Protocol):
    """Somebody on a bus who is told the time."""

    def advance(self, now: float) -> list[Frame]:
        """Go on to ``now`` [s]; return what he has sent meanwhile."""

    def receive(self, frame: Frame) -> None:
        """Take in a frame."""


class Terminals:
    """Pseudo-terminals, each as an adapter is that is plugged into the same bus.

    Attributes:
        paths: of the terminals.
    """

    def __init__(self, count: int = 1) -> None:
        """Open them."""
        self._pairs = [os.openpty() for _ in range(count)]
        for ours, theirs in self._pairs:
            os.set_blocking(ours, False)
            tty.setraw(theirs)
        self.paths = [os.ttyname(theirs) for _, theirs in self._pairs]
        self._readers = {ours: LineReader() for ours, _ in self._pairs}
        self._unread = {ours: b"" for ours, _ in self._pairs}

    def serve(self, members: Sequence[Member], look: Callable[[], bool]) -> None:
        """Carry frames between ``members`` and whoever opens the terminals.

        Args:
            members: of the bus behind them.
            look: called at least every ``LONGEST_WAIT``; false to end.
        """
        last = time.monotonic()
        for member in members:
            self._send(member.advance(last))
        while look():
            ready, _, _ = select.select(list(self._readers), [], [], LONGEST_WAIT)
            # What came while others had this computer did not come all at once.
            came = [(ours, frame) for ours in ready for frame in self._read(ours)]
            now, left = time.monotonic(), sum(frame[0] == CobId.SYNC for _, frame in came)
            for ours, frame in came:
                if frame[0] == CobId.SYNC:
                    last += (now - last) / left
                    left -= 1
                    self._advance(members, last)
                for member in members:
                    member.receive(frame)
                self._send([frame], but=ours)
            last = now
            self._advance(members, now)

    def close(self) -> None:
        """Unplug them."""
        for ours, theirs in self._pairs:
            os.close(ours)
            os.close(theirs)

    def _advance(self, members: Sequence[Member], now: float) -> None:
        self._send([frame for member in members for frame in member.advance(now)])

    def _read(self, ours: int) -> list[Frame]:
        try:
            return self._readers[ours].frames(os.read(ours, 65536))
        except OSError:
            return []

    def _send(self, frames: Sequence[Frame], but: int | None = None) -> None:
        for ours, unread in self._unread.items():
            if not self._readers[ours].is_open:
                # Who opens it finds nothing that is old.
                unread = b""
            elif ours != but and len(unread) < MOST_UNREAD:
                unread += encoded(frames)
            with suppress(BlockingIOError):
                unread = unread[os.write(ours, unread) :] if unread else unread
            self._unread[ours] = unread
