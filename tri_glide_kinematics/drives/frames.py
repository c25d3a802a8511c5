"""Frames of CANopen, by the pre-defined connection set, and as lines of text on a serial line."""

from __future__ import annotations

import struct
from collections.abc import Collection, Sequence
from contextlib import suppress
from enum import IntEnum

from tri_glide_kinematics.drives import bus

Frame = tuple[int, bytes]


class CobId(IntEnum):
    """Identifiers of frames; but for the first two, the node of the drive is added."""

    NMT = 0x000
    SYNC = 0x080
    EMERGENCY = 0x080
    STATUS = 0x180
    TARGET = 0x200
    VELOCITY = 0x300
    ANSWER = 0x580
    REQUEST = 0x600
    HEARTBEAT = 0x700


def cycle_frames(commands: Sequence[bus.Command]) -> list[Frame]:
    """Return the frames of all ``commands``, and behind them SYNC."""
    frames: list[Frame] = []
    for node, word, position, velocity in commands:
        frames.append((0x200 + node, struct.pack("<Hi", word, position)))
        if velocity is not None:
            frames.append((0x300 + node, struct.pack("<i", velocity)))
    return [*frames, (0x080, b"")]


def event_of(frame: Frame, now: float, nodes: Collection[int], own: int) -> bus.Event | None:
    """Return what a frame tells that came in at ``now`` [s].

    Args:
        frame: that somebody else has sent.
        now: time of now [s].
        nodes: of the drives.
        own: node of this computer: nobody else may send what belongs to it.

    Returns:
        The event; None where it is of no interest here.
    """
    cob_id, data = frame
    kind, node = cob_id & 0x780, cob_id & 0x7F
    if cob_id in (CobId.NMT, CobId.SYNC, CobId.HEARTBEAT + own):
        return bus.Foreign(now, cob_id)
    if node in nodes:
        if kind == CobId.STATUS and len(data) >= 6:
            return bus.Status(node, now, *struct.unpack_from("<Hi", data))
        if kind == CobId.EMERGENCY and len(data) >= 2:
            return bus.Emergency(node, now, *struct.unpack_from("<H", data))
        if kind == CobId.HEARTBEAT and len(data) == 1:
            return bus.Heartbeat(node, now, data[0] & 0x7F)
        if kind in (CobId.TARGET, CobId.VELOCITY, CobId.REQUEST):
            return bus.Foreign(now, cob_id)
    return None


# Frames as lines of text on a serial line (slcan, by Lawicel).

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
