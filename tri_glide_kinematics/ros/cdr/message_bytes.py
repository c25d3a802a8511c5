"""Writes messages as bytes, part by part, where rclpy would take too long.

In the plain encoding (CDR, here little endian) each number begins at a multiple of its size.
"""

from __future__ import annotations

from struct import pack

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
