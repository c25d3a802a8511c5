"""Requests and answers are read within the bytes that came, whatever these say.

A sequence begins with the number of its elements. Of a message on a topic, the generated C code
compares that with the bytes that follow. Of a request or an answer it means to do the same. But it
asks by ``Cdr::jump``, and rmw_fastrtps 8.4 reads both from a buffer that may grow, so the jump
makes room and succeeds. Then 12 bytes that tell of 16 million texts take 1 GB and more than a
second, in which nothing else of Python runs, and those that tell of more take all memory.

``rmw_deserialize`` reads from a buffer that cannot grow. So here the function that reads a kind of
request is replaced by one that calls ``rmw_deserialize``. It is a pointer in a table of the
generated code (rosidl_typesupport_fastrtps_cpp/message_type_support.h).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.type_support import check_for_type_support
from rclpy.utilities import get_rmw_implementation_identifier

from tri_glide_kinematics.ros.cdr.stamped_triples import PLAIN

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
