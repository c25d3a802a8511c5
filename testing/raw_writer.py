"""Writes any bytes to any topic of DDS, those of services and actions among them.

rclpy sends bytes on topics of ROS only. The requests of a service are a topic, too, whose name does
not begin as those of ROS do: what makes it is called here as rcl does (rmw/rmw.h).
"""

import ctypes
from typing import Any

from rclpy.node import Node
from rclpy.type_support import check_for_type_support

KEEP_LAST, RELIABLE, VOLATILE, AUTOMATIC = 1, 1, 2, 1


def requests(service: str) -> str:
    """Return the topic of DDS on which the requests of a ``service`` come in, by its full name."""
    return f"rq{service}Request"


def answers(service: str) -> str:
    """Return the topic of DDS on which the answers of a ``service`` go out, by its full name."""
    return f"rr{service}Reply"


class _Time(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_uint64), ("nanoseconds", ctypes.c_uint64))


class _Quality(ctypes.Structure):
    """rmw_qos_profile_t."""

    _fields_ = (
        ("history", ctypes.c_int),
        ("depth", ctypes.c_size_t),
        ("reliability", ctypes.c_int),
        ("durability", ctypes.c_int),
        ("deadline", _Time),
        ("lifespan", _Time),
        ("liveliness", ctypes.c_int),
        ("lease", _Time),
        ("avoid_ros_namespace_conventions", ctypes.c_bool),
    )


class _Options(ctypes.Structure):
    """rmw_publisher_options_t."""

    _fields_ = (("payload", ctypes.c_void_p), ("unique_endpoints", ctypes.c_int))


class _Bytes(ctypes.Structure):
    """rmw_serialized_message_t; its five functions of an allocator are not used for writing."""

    _fields_ = (
        ("buffer", ctypes.c_char_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", ctypes.c_void_p * 5),
    )


class RawWriter:
    """Writes to a topic of DDS, whatever its name."""

    def __init__(self, node: Node, kind: Any, topic: str) -> None:
        """Write as a part of ``node``.

        Args:
            node: whose participant writes.
            kind: of message that is expected there.
            topic: its name in DDS, as of ``requests`` or ``answers``.
        """
        check_for_type_support(kind)
        get = ctypes.pythonapi.PyCapsule_GetPointer
        get.restype, get.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)
        support = get(kind._TYPE_SUPPORT, None)
        rcl, self._rmw = ctypes.CDLL("librcl.so"), ctypes.CDLL("librmw_fastrtps_cpp.so")
        rcl.rcl_node_get_rmw_handle.restype = ctypes.c_void_p
        rcl.rcl_node_get_rmw_handle.argtypes = (ctypes.c_void_p,)
        with node.handle:
            self._node = rcl.rcl_node_get_rmw_handle(node.handle.pointer)
        create = self._rmw.rmw_create_publisher
        create.restype = ctypes.c_void_p
        create.argtypes = (
            ctypes.c_void_p,
            ctypes.c_void_p,
            ctypes.c_char_p,
            ctypes.POINTER(_Quality),
            ctypes.POINTER(_Options),
        )
        quality = _Quality(
            history=KEEP_LAST,
            depth=1000,
            reliability=RELIABLE,
            durability=VOLATILE,
            liveliness=AUTOMATIC,
            avoid_ros_namespace_conventions=True,
        )
        self._publisher = create(
            self._node, support, topic.encode(), ctypes.byref(quality), ctypes.byref(_Options())
        )
        if not self._publisher:
            raise RuntimeError(f"no writer of {topic}")
        self._publish = self._rmw.rmw_publish_serialized_message
        self._publish.argtypes = (ctypes.c_void_p, ctypes.POINTER(_Bytes), ctypes.c_void_p)
        self._count = self._rmw.rmw_publisher_count_matched_subscriptions
        self._count.argtypes = (ctypes.c_void_p, ctypes.POINTER(ctypes.c_size_t))

    def publish(self, data: bytes) -> None:
        """Write some bytes, whatever they are."""
        message = _Bytes(buffer=data, length=len(data), capacity=len(data))
        if self._publish(self._publisher, ctypes.byref(message), None):
            raise RuntimeError(f"{len(data)} bytes were not written")

    def get_subscription_count(self) -> int:
        """Return how many read."""
        count = ctypes.c_size_t()
        self._count(self._publisher, ctypes.byref(count))
        return count.value

    def close(self) -> None:
        """Leave the graph."""
        destroy = self._rmw.rmw_destroy_publisher
        destroy.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
        destroy(self._node, self._publisher)
