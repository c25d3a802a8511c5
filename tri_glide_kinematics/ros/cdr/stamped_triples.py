"""Messages that differ from the last one in their stamp and a few numbers, exchanged in the bytes.

To make bytes of a message, rclpy goes through all its parts in Python. In a process that was asleep
a millisecond ago, half of the time that publishing takes is spent on that.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct
from typing import Any

from rclpy.serialization import serialize_message

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
