"""Bytes of any kind, sent over DDS to all that running nodes listen to.

What they listen to is looked up in the graph of ROS: each topic, each service with those of
parameters, the three services of each action, and the answers that they wait for as clients.
"""

import math
import random
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from importlib import import_module
from itertools import chain
from struct import pack
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message

from testing.client import NO_PUBLISHER_EVENTS, Client
from testing.raw_writer import RawWriter, answers, requests

# Any subscription takes what is published so.
KEPT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# A plain encoding, those that ROS does not use, and what is none.
KINDS = (0, 1, 2, 3, 6, 7, 8, 9, 10, 11, 127, 128, 255)
HEADERS = tuple(bytes((first, second)) for first in (0, 1, 255) for second in KINDS)
ODD = (0, 1, 2, 4, 0x7F, 0x80, 0xFF)
# Each input gets so many a second: a node takes one request in a turn, and keeps ten of each.
RATE = 60.0
# So many elements are said to follow, in so many places at most.
MANY, MOST_CLAIMS = 16_000_000, 16
# A frame that nobody has, so that what is valid by chance asks for nothing.
NOBODY = "nobody"
# Where a frame becomes empty by chance, which is valid, the numbers are none.
GEOMETRY = "geometry_msgs"


class Input:
    """A topic or service that a node listens to.

    Attributes:
        name: of it.
        send: sends some bytes.
    """

    def __init__(self, name: str, kind: Any, send: Callable[[bytes], None]) -> None:
        """Send bytes that resemble those of a ``kind`` of message, or do not.

        Args:
            name: of it.
            kind: of message that is expected.
            send: sends some bytes.
        """
        self.name = name
        self.send = send
        self._valid = [_valid(kind, some) for some in (False, True)]
        self._source = random.Random(name.rpartition("/")[2])
        self._ordered = chain(self._all_claims(), self._all_cuts())

    def next(self) -> bytes:
        """Return the next bytes: many elements, all headers with cut bodies, then random ones."""
        return next(self._ordered, None) or self._random()

    def _all_claims(self) -> Iterator[bytes]:
        whole = self._valid[0]
        for place in range(4, len(whole) - 3, 4)[:MOST_CLAIMS]:
            yield whole[:place] + pack("<I", MANY) + whole[place + 4 :]

    def _all_cuts(self) -> Iterator[bytes]:
        whole = self._valid[1]
        for header in HEADERS:
            for end in (4, 5, 8, 12, len(whole) // 2 + 2, len(whole)):
                yield header + whole[2:end]

    def _random(self) -> bytes:
        source = self._source
        if source.random() < 0.2:
            return source.choice(HEADERS) + source.randbytes(source.randrange(200))
        data = bytearray(source.choice(self._valid))
        for _ in range(source.randint(1, 5)):
            # The kind of the encoding stays, mostly: else nobody looks at the rest.
            place = source.randrange(
                min(4, len(data) - 1) if source.random() < 0.9 else 0, len(data)
            )
            data[place] = source.choice((*ODD, source.randrange(256)))
        if source.random() < 0.2:
            del data[source.randrange(len(data)) :]
        return bytes(data)


def _valid(kind: Any, has_some: bool) -> bytes:
    """Return the bytes of a message; ``has_some`` tells whether its sequences have an element."""
    message = kind()
    _fill(message, has_some)
    return bytes(serialize_message(message))


def _fill(message: Any, has_some: bool) -> None:
    for field, kind in message.get_fields_and_field_types().items():
        value = getattr(message, field)
        if isinstance(value, str):
            setattr(message, field, NOBODY)
        elif isinstance(value, float) and type(message).__module__.startswith(GEOMETRY):
            setattr(message, field, math.nan)
        elif hasattr(value, "get_fields_and_field_types"):
            _fill(value, has_some)
        elif has_some and kind.startswith("sequence<"):
            inner = kind[len("sequence<") : -1].partition(",")[0]
            if inner == "string":
                setattr(message, field, [NOBODY])
            elif "/" in inner:
                package, name = inner.split("/")
                part = getattr(import_module(f"{package}.msg"), name)()
                _fill(part, has_some=False)
                setattr(message, field, [part])
            elif inner != "boolean":
                setattr(message, field, [1.0 if inner in ("double", "float") else 1])


class Fuzzer:
    """All inputs of some nodes, and a participant that sends to them."""

    def __init__(self, client: Client, nodes: Sequence[str], but: Sequence[str] = ()) -> None:
        """Find what ``nodes`` of the namespace of the ``client`` listen to, ``but`` some topics."""
        self._node: Node = client.node
        self._namespace = client.namespace
        self._writers: list[RawWriter] = []
        self._publishers: list[Any] = []
        self.inputs: list[Input] = []
        for node in nodes:
            # The graph comes to be known piece by piece.
            client.wait_for(partial(self._offers_all, node), f"the services of {node}")
            for name, (kind, *_) in self._topics(node):
                if name not in [f"{client.namespace}/{each}" for each in but]:
                    self._add_topic(name, kind)
            for name, (kind, *_) in self._services(node):
                self._add(name, _class_of(kind).Request, requests(name))
            for name, (kind, *_) in self._clients(node):
                self._add(name, _class_of(kind).Response, answers(name))
        client.wait_for(self._all_are_heard, "all nodes to listen")

    def run(self, client: Client, count: int) -> int:
        """Send so many bytes at least, in turns; return how many were sent."""
        sent = 0
        while sent < count:
            begin = time.monotonic()
            for each in self.inputs:
                # A writer of a bounded type sends nothing that is longer than this may be.
                with suppress(RuntimeError):
                    each.send(each.next())
                    sent += 1
            client.spin_for(max(1.0 / RATE - (time.monotonic() - begin), 0.0))
        return sent

    def close(self) -> None:
        """Leave the graph."""
        for writer in self._writers:
            writer.close()
        for publisher in self._publishers:
            self._node.destroy_publisher(publisher)

    def _add(self, name: str, kind: Any, topic: str) -> None:
        writer = RawWriter(self._node, kind, topic)
        self._writers.append(writer)
        self.inputs.append(Input(name, kind, writer.publish))

    def _add_topic(self, name: str, kind: str) -> None:
        of_python = _class_of(kind)
        publisher = self._node.create_publisher(
            of_python, name, KEPT, event_callbacks=NO_PUBLISHER_EVENTS
        )
        self._publishers.append(publisher)
        self.inputs.append(Input(name, of_python, publisher.publish))

    def _topics(self, node: str) -> list[tuple[str, list[str]]]:
        return list(self._node.get_subscriber_names_and_types_by_node(node, self._namespace))

    def _services(self, node: str) -> list[tuple[str, list[str]]]:
        with suppress(Exception):
            return list(self._node.get_service_names_and_types_by_node(node, self._namespace))
        return []

    def _offers_all(self, node: str) -> bool:
        """Return whether a node is known with the services that each node has."""
        names = {name.rpartition("/")[2] for name, _ in self._services(node)}
        return {"set_parameters", "list_parameters", "get_parameters"} <= names

    def _clients(self, node: str) -> list[tuple[str, list[str]]]:
        return list(self._node.get_client_names_and_types_by_node(node, self._namespace))

    def _all_are_heard(self) -> bool:
        all_of_them = (*self._writers, *self._publishers)
        return all(each.get_subscription_count() for each in all_of_them)


def _class_of(kind: str) -> Any:
    """Return the class of a message or service by its name in the graph, also of an action."""
    package, folder, name = kind.split("/")
    if folder != "action":
        return getattr(import_module(f"{package}.{folder}"), name)
    action, _, part = name.partition("_")
    made_of = getattr(import_module(f"{package}.action"), action).Impl
    return getattr(made_of, part if part == "FeedbackMessage" else f"{part}Service")
