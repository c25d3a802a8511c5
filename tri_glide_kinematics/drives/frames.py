"""Frames of CANopen, by the pre-defined connection set: what is sent in a cycle, what comes in."""

from __future__ import annotations

import struct
from collections.abc import Collection, Sequence
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
