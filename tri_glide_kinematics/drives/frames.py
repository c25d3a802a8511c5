"""Frames of CANopen, by the pre-defined connection set: what is sent in a cycle, what comes in."""

from __future__ import annotations

import struct
from collections.abc import Collection, Sequence

from tri_glide_kinematics.drives.bus import (
    Command,
    Emergency,
    Event,
    Foreign,
    Heartbeat,
    Status,
)

Frame = tuple[int, bytes]

NMT, SYNC, EMERGENCY, STATUS = 0x000, 0x080, 0x080, 0x180
TARGET, VELOCITY, ANSWER, REQUEST, HEARTBEAT = 0x200, 0x300, 0x580, 0x600, 0x700


def cycle_frames(commands: Sequence[Command]) -> list[Frame]:
    """Return the frames of all ``commands``, and behind them SYNC."""
    frames = []
    for node, word, position, velocity in commands:
        frames.append((TARGET + node, struct.pack("<Hi", word, position)))
        if velocity is not None:
            frames.append((VELOCITY + node, struct.pack("<i", velocity)))
    return [*frames, (SYNC, b"")]


def event_of(frame: Frame, now: float, nodes: Collection[int], own: int) -> Event | None:
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
    is_ours = kind in (TARGET, VELOCITY, REQUEST) and node in nodes
    if cob_id in (NMT, SYNC, HEARTBEAT + own) or is_ours:
        return Foreign(now, cob_id)
    if node in nodes:
        if kind == STATUS and len(data) >= 6:
            word, position = struct.unpack_from("<Hi", data)
            return Status(node, now, word, position)
        if kind == EMERGENCY and len(data) >= 3:
            code, register = struct.unpack_from("<HB", data)
            return Emergency(node, now, code, register)
        if kind == HEARTBEAT and len(data) == 1:
            return Heartbeat(node, now, data[0] & 0x7F)
    return None
