"""Messages as bytes, written at once where a message of Python would take too long.

Messages that are sent all the time differ from the last one in their stamp and a few numbers, which
are exchanged in the bytes; points come straight out of arrays. Requests and answers are read within
the bytes that came.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Sequence
from struct import Struct, pack
from typing import Any, NamedTuple

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.type_support import check_for_type_support
from rclpy.utilities import get_rmw_implementation_identifier

from tri_glide_kinematics.vectors import FloatArray, Vector3

# Messages that differ from the last one in their stamp and a few numbers, exchanged in the bytes.
#
# To make bytes of a message, rclpy goes through all its parts in Python. In a process that was
# asleep a millisecond ago, half of the time that publishing takes is spent on that.

# Each has bytes of its own, and no message holds them by chance.
MARKS = tuple(1e-300 * (1.0 / 3.0 + number) for number in range(200))
FIRST, SECOND, THIRD, FOURTH = PLACES = MARKS[0:3], MARKS[3:6], MARKS[6:9], MARKS[9:12]

# Of the encoding: what kind it is, then the stamp, as the header is the first part.
KIND = slice(0, 4)
# The plain encodings, big and little endian: others place their numbers otherwise.
PLAIN = (b"\x00\x00", b"\x00\x01")
STAMP_OFFSET = 4
STAMP_END = 12


class NoSuchPlaceError(Exception):
    """Marks are not found in the bytes of a message, or more than once."""


class StampedTriples:
    """The bytes of a message with a header and with one to four places for three numbers."""

    def __init__(self, message: Any, places: int) -> None:
        """Write all of ``message`` once.

        Args:
            message: holds ``FIRST``, and those after it if there are more places.
            places: number of these.

        Raises:
            NoSuchPlaceError: if it does not.
        """
        written = serialize_message(message)
        self._bytes = bytearray(written)
        order = byte_order(written)
        self._stamp = Struct(f"{order}iI")
        self._triple = Struct(f"{order}3d")
        self._offsets = [offset_of(written, marks) for marks in PLACES[:places]]

    def at(self, seconds: int, nanoseconds: int, *triples: Sequence[float]) -> bytes:
        """Return the bytes with this stamp and these numbers, each of shape (3,)."""
        self._stamp.pack_into(self._bytes, STAMP_OFFSET, seconds, nanoseconds)
        for offset, triple in zip(self._offsets, triples):
            self._triple.pack_into(self._bytes, offset, *triple)
        return bytes(self._bytes)


def byte_order(written: bytes) -> str:
    """Return the order of bytes in a serialized message, in the words of ``struct``."""
    return "<" if written[1] & 1 else ">"


def offset_of(written: bytes, marks: Sequence[float]) -> int:
    """Return where ``marks`` stand in the bytes of a message.

    Raises:
        NoSuchPlaceError: if that is at no place, or at more than one.
    """
    pattern = Struct(f"{byte_order(written)}{len(marks)}d").pack(*marks)
    if written.count(pattern) != 1:
        raise NoSuchPlaceError(f"{len(marks)} marks are in {written.count(pattern)} places, not 1")
    return written.index(pattern)


# Messages with their points straight out of arrays.
#
# To make bytes of a message, rclpy goes through all its parts in Python: some thousand points of a
# marker, or the hundred points that a path in mid-motion brings for each of its parts, take longer
# than a control cycle. In the bytes they stand just as numpy has them. In the plain encoding (CDR,
# here little endian) each number begins at a multiple of its size.

# Plain encoding, little endian; places are counted from behind it.
LITTLE_ENDIAN = b"\x00\x01\x00\x00"


def aligned(offset: int, size: int) -> int:
    """Return the first place from ``offset`` on for a number of a ``size``."""
    return offset + (len(LITTLE_ENDIAN) - offset) % size


def begun() -> bytearray:
    """Return the bytes of a message without any part yet."""
    return bytearray(LITTLE_ENDIAN)


def align(written: bytearray, size: int) -> None:
    """Fill up to the next place for a number of a ``size``."""
    written += bytes(aligned(len(written), size) - len(written))


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
        _write_marker(written, shape, frame)
    return bytes(written)


def _write_marker(written: bytearray, shape: MarkerShape, frame: str) -> None:
    # Loaded when it is first used: most nodes show nothing.
    from visualization_msgs.msg import Marker

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


# Requests and answers are read within the bytes that came, whatever these say.
#
# A sequence begins with the number of its elements. Of a message on a topic, the generated C code
# compares that with the bytes that follow. Of a request or an answer it means to do the same. But
# it asks by ``Cdr::jump``, and rmw_fastrtps 8.4 reads both from a buffer that may grow, so the jump
# makes room and succeeds. Then 12 bytes that tell of 16 million texts take 1 GB and more than a
# second, in which nothing else of Python runs, and those that tell of more take all memory.
#
# ``rmw_deserialize`` reads from a buffer that cannot grow. So here the function that reads a kind
# of request is replaced by one that calls ``rmw_deserialize``. It is a pointer in a table of the
# generated code (rosidl_typesupport_fastrtps_cpp/message_type_support.h).

MIDDLEWARE = "rmw_fastrtps_cpp"
GENERATED = b"rosidl_typesupport_fastrtps_c"

UNKNOWN = (
    "this is not the middleware of ROS 2 Jazzy or Kilted: requests that claim to be longer than "
    "they are may take all memory"
)

# Of a fastcdr::Cdr, as a row of pointers: where its bytes begin, and where they end.
BEGIN, END = 22, 23

_Read = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.c_void_p)


class _Functions(ctypes.Structure):
    """message_type_support_callbacks_t."""

    _fields_ = (
        ("namespace", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("write", ctypes.c_void_p),
        ("read", ctypes.c_void_p),
        ("size", ctypes.c_void_p),
        ("largest_size", ctypes.c_void_p),
        ("key", ctypes.c_void_p),
    )


class _Support(ctypes.Structure):
    """rosidl_message_type_support_t."""

    _fields_ = (
        ("identifier", ctypes.c_void_p),
        ("functions", ctypes.POINTER(_Functions)),
        ("others", ctypes.c_void_p * 4),
    )


class _Bytes(ctypes.Structure):
    """rmw_serialized_message_t; its allocator is not used for reading."""

    _fields_ = (
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", ctypes.c_void_p * 5),
    )


# The substitute for the function of each kind, and what it needs: kept as long as the process
# lives.
_replaced: dict[Any, tuple[Any, ...]] = {}


def read_within_bytes(node: Node) -> None:
    """Read requests to the services of ``node`` within their bytes, and what its clients get.

    With another middleware than that of Jazzy or Kilted nothing is changed, and the node says so.
    """
    services: list[Any] = [service.srv_type for service in node.services]
    clients: list[Any] = [client.srv_type for client in node.clients]
    kinds = (*(kind.Request for kind in services), *(kind.Response for kind in clients))
    if not read_kinds_within_bytes(kinds):
        node.get_logger().warning(UNKNOWN)


def read_kinds_within_bytes(kinds: Iterable[Any]) -> bool:
    """Read these kinds of requests and answers within their bytes, and return whether it works."""
    if get_rmw_implementation_identifier() != MIDDLEWARE or not _is_as_expected():
        return False
    for kind in kinds:
        if kind not in _replaced:
            _replaced[kind] = _replace(kind, lambda address, length: None)
    return True


def _is_as_expected() -> bool:
    """Tell whether a reader of bytes is laid out as it is in the library of Jazzy and Kilted."""
    probe = GetParameters.Request
    if probe not in _replaced:
        seen: list[bytes] = []
        functions, before, *_kept = _replace(
            probe, lambda address, length: seen.append(ctypes.string_at(address, length))
        )
        data = bytes(serialize_message(probe(names=["as expected"])))
        try:
            deserialize_message(data, probe)
        finally:
            functions.read = before
        if seen != [data]:
            return False
        _replaced[probe] = _replace(probe, lambda address, length: None)
    return True


def _replace(kind: Any, look: Callable[[int, int], object]) -> tuple[Any, ...]:
    """Replace what reads a ``kind``; return its table and what was in it, and what is to be kept.

    ``look`` gets the address of the bytes and their number.
    """
    check_for_type_support(kind)
    support = _support(kind)
    functions = support.functions.contents
    before = functions.read
    own = _Support.from_buffer_copy(support)
    table = _Functions.from_buffer_copy(functions)
    own.functions = ctypes.pointer(table)
    rmw, rcutils = ctypes.CDLL(f"lib{MIDDLEWARE}.so"), ctypes.CDLL("librcutils.so")
    decode = rmw.rmw_deserialize
    decode.argtypes = (ctypes.POINTER(_Bytes), ctypes.POINTER(_Support), ctypes.c_void_p)
    reset_error = rcutils.rcutils_reset_error

    def read(reader: int, message: int) -> bool:
        row = (ctypes.c_size_t * (END + 1)).from_address(reader)
        begin, length = row[BEGIN], row[END] - row[BEGIN]
        look(begin, length)
        if ctypes.string_at(begin, min(length, 2)) not in PLAIN:
            return False
        data = _Bytes(buffer=begin, length=length, capacity=length)
        # An error that is left there is written to the standard error beside the next one.
        reset_error()
        is_read = decode(ctypes.byref(data), ctypes.byref(own), message) == 0
        reset_error()
        return is_read

    call = _Read(read)
    functions.read = ctypes.cast(call, ctypes.c_void_p)
    return functions, before, call, own, table


def _support(kind: Any) -> _Support:
    """Return how rmw_fastrtps reads and writes a ``kind`` of message."""
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)
    find = ctypes.CDLL("librosidl_runtime_c.so").get_message_typesupport_handle
    find.restype, find.argtypes = ctypes.POINTER(_Support), (ctypes.c_void_p, ctypes.c_char_p)
    found = find(get(kind._TYPE_SUPPORT, None), GENERATED)
    support: _Support = found.contents
    return support
