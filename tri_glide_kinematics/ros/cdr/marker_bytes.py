"""Markers of visualization_msgs as bytes, with their points straight out of arrays.

To make bytes of a message, rclpy goes through all its parts in Python: some thousand points take
longer than a control cycle. In the bytes they stand just as numpy has them.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import pack
from typing import NamedTuple

import numpy as np
from visualization_msgs.msg import Marker

from tri_glide_kinematics.ros.cdr.message_bytes import (
    align,
    begun,
    write_count,
    write_header,
    write_text,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3

NO_POINTS = np.empty((0, 3))
ORIGIN: Vector3 = (0.0, 0.0, 0.0)
NO_ROTATION = (0.0, 0.0, 0.0, 1.0)

# Behind its points, a marker has nothing: no colours, no texture (resource, stamp, frame, format,
# data) with coordinates, no text, no mesh (resource, name, data), and no materials.
NOTHING, NO_TEXT = pack("<I", 0), pack("<I4s", 1, b"")
REST = b"".join(
    (NOTHING, NO_TEXT, *2 * (NOTHING,), *2 * (NO_TEXT,), *2 * (NOTHING,), *3 * (NO_TEXT,), NOTHING)
) + pack("<?", False)


class MarkerShape(NamedTuple):
    """The contents of one marker.

    Attributes:
        name: its namespace; it has the number 0 there.
        kind: of ``Marker``: its type.
        sizes: as its type takes them. Shape (3,) [m].
        colour: red, green, blue and opacity, each from 0 to 1.
        points: Shape (n, 3) [m].
        position: Shape (3,) [m].
        is_deleted: whether it is to be shown no more.
    """

    name: str
    kind: int
    sizes: Vector3
    colour: tuple[float, float, float, float]
    points: FloatArray = NO_POINTS
    position: Vector3 = ORIGIN
    is_deleted: bool = False


def marker_array(shapes: Sequence[MarkerShape], frame: str) -> bytes:
    """Return a serialized MarkerArray.

    The stamp of all markers is 0: they hold at any time.

    Args:
        shapes: of the markers.
        frame: of all places.
    """
    written = begun()
    write_count(written, len(shapes))
    for shape in shapes:
        _write(written, shape, frame)
    return bytes(written)


def _write(written: bytearray, shape: MarkerShape, frame: str) -> None:
    write_header(written, frame)
    write_text(written, shape.name)
    action = Marker.DELETE if shape.is_deleted else Marker.ADD
    align(written, 4)
    written += pack("<iii", 0, shape.kind, action)
    align(written, 8)
    written += pack("<10d4f", *shape.position, *NO_ROTATION, *shape.sizes, *shape.colour)
    # It stays for ever, and is not tied to its frame anew all the time.
    written += pack("<iI?", 0, 0, False)
    write_count(written, len(shape.points))
    if len(shape.points):
        align(written, 8)
        written += np.ascontiguousarray(shape.points, "<f8").data.cast("B")
    written += REST
