"""Frames as lines of text on a serial line (slcan, by Lawicel)."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from tri_glide_kinematics.drives.frames import Frame

REFUSED = b"\a"


def encoded(frames: Sequence[Frame]) -> bytes:
    """Return frames as lines."""
    return b"".join(
        b"t%03X%d%s\r" % (cob_id, len(data), data.hex().encode()) for cob_id, data in frames
    )


class LineReader:
    """Puts lines together that come in pieces.

    Attributes:
        refusals: how often the other end has refused something.
        is_open: whether the other end wants frames.
    """

    def __init__(self) -> None:
        """Have nothing yet."""
        self.refusals = 0
        self.is_open = False
        self._rest = b""

    def frames(self, data: bytes) -> list[Frame]:
        """Return the frames whose lines are complete with these ``data``; others are left out."""
        # A refusal is the end of a line, too.
        text = self._rest + data.replace(REFUSED, REFUSED + b"\r")
        *lines, self._rest = text.split(b"\r")
        self.refusals += data.count(REFUSED)
        found = []
        for line in lines:
            if line in (b"O", b"C"):
                self.is_open = line == b"O"
            # What has been sent may be answered by a letter.
            line = line.lstrip(b"zZ")
            with suppress(ValueError):
                if line[:1] == b"t" and len(line) == 5 + 2 * int(line[4:5]):
                    found.append((int(line[1:4], 16), bytes.fromhex(line[5:].decode())))
        return found
