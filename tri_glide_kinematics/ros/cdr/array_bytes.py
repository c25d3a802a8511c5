"""Messages as bytes, with their points straight out of arrays.

To make bytes of a message, rclpy goes through all its parts in Python: some thousand points of a
marker, or the hundred points that a path in mid-motion brings for each of its parts, take longer
than a control cycle. In the bytes they stand just as numpy has them. In the plain encoding (CDR,
here little endian) each number begins at a multiple of its size.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import pack
from typing import NamedTuple

import numpy as np
from visualization_msgs.msg import Marker

from tri_glide_kinematics.vectors import FloatArray, Vector3

# Plain encoding, little endian; places are counted from behind it.
KIND = b"\x00\x01\x00\x00"


def begun() -> bytearray:
    """Return the bytes of a message without any part yet."""
    return bytearray(KIND)


def align(written: bytearray, size: int) -> None:
    """Fill up to the next place for a number of a ``size``."""
    written += bytes((len(KIND) - len(written)) % size)


def write_count(written: bytearray, count: int) -> None:
    """Write how many parts a sequence has."""
    align(written, 4)
    written += pack("<I", count)


def write_text(written: bytearray, text: str) -> None:
    """Write a text."""
    data = text.encode() + b"\0"
    write_count(written, len(data))
    written += data


def write_header(written: bytearray, frame: str) -> None:
    """Write a header with the stamp 0."""
    align(written, 4)
    written += bytes(8)
    write_text(written, frame)


NO_POINTS = np.empty((0, 3))
ORIGIN: Vector3 = (0.0, 0.0, 0.0)
NO_ROTATION = (0.0, 0.0, 0.0, 1.0)  # quaternion: x, y, z, w

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
    """Return a serialized MarkerArray with all places in ``frame``; its stamp 0 is any time."""
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


SLIDERS = 3

# A point, from its first position to what stands before the first position of the next one. Each
# list of numbers is led by its count; efforts are none.
POINT = np.dtype(
    {
        "names": [
            *("positions", "velocity_count", "velocities", "acceleration_count", "accelerations"),
            *("effort_count", "seconds", "nanoseconds", "next_count"),
        ],
        "formats": ["3<f8", "<u4", "3<f8", "<u4", "3<f8", "<u4", "<i4", "<u4", "<u4"],
        "offsets": [0, 24, 32, 56, 64, 88, 92, 96, 100],
        "itemsize": 104,
    }
)


def joint_trajectory(
    names: Sequence[str],
    frame: str,
    times: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    accelerations: FloatArray,
) -> bytes:
    """Return a serialized JointTrajectory with the stamp 0.

    Args:
        names: of the joints.
        frame: of the header.
        times: of the points, one at least. Shape (n,) [s].
        positions: Shape (n, 3) [m].
        velocities: Shape (n, 3) [m/s].
        accelerations: Shape (n, 3) [m/s^2].
    """
    written = begun()
    write_header(written, frame)
    write_count(written, len(names))
    for name in names:
        write_text(written, name)
    points = np.zeros(len(times), POINT)
    points["positions"], points["velocities"] = positions, velocities
    points["accelerations"] = accelerations
    for count in ("velocity_count", "acceleration_count", "next_count"):
        points[count] = SLIDERS
    whole = np.rint(1e9 * times).astype(np.int64)
    points["seconds"], points["nanoseconds"] = np.divmod(whole, 1_000_000_000)
    write_count(written, len(times))
    write_count(written, SLIDERS)
    align(written, 8)
    # Behind the last point there is none.
    written += points.tobytes()[: -POINT["next_count"].itemsize]
    return bytes(written)
