"""Connections to the panel's page as nobody's browser makes them: all is sent at once."""

from __future__ import annotations

import base64
import os
import socket
import struct
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

import msgspec

from testing.page_reader import CAMERA, PROTOCOL

# An answer takes a few milliseconds; a busy computer takes longer [s].
TIMEOUT = 10.0
TEXT, BINARY, CLOSE = 0x81, 0x82, 0x88
HANDLE = "/go_to"


def message(kind: str, **values: Any) -> bytes:
    """Return a message of a page as viser reads it."""
    packed: bytes = msgspec.msgpack.encode({"type": kind, **values})
    return packed


def go_to(position: tuple[float, float, float]) -> list[bytes]:
    """Return the messages of a page whose handle is dragged to a ``position`` [m] and released."""
    place = {"wxyz": (1.0, 0.0, 0.0, 0.0), "position": position}
    return [
        bytes(msgspec.msgpack.encode(CAMERA)),
        message("TransformControlsDragStartMessage", name=HANDLE),
        message("TransformControlsUpdateMessage", name=HANDLE, **place),
        message("TransformControlsDragEndMessage", name=HANDLE),
    ]


def frame(payload: bytes, head: int = BINARY, length: int | None = None) -> bytes:
    """Return a frame, masked as of a browser; ``length`` is told in place of the true one."""
    told = len(payload) if length is None else length
    if told < 126:
        size = struct.pack("!B", 0x80 | told)
    elif told < 65536:
        size = struct.pack("!BH", 0x80 | 126, told)
    else:
        size = struct.pack("!BQ", 0x80 | 127, told)
    # A mask of zeros changes nothing.
    return bytes((head,)) + size + b"\0\0\0\0" + payload


def upgrade(headers: Iterable[tuple[str, str]], path: str = "/") -> bytes:
    """Return the request that asks for a connection, with more ``headers``."""
    fixed = (
        ("Upgrade", "websocket"),
        ("Connection", "Upgrade"),
        ("Sec-WebSocket-Key", base64.b64encode(os.urandom(16)).decode()),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Protocol", PROTOCOL),
    )
    return request((*headers, *fixed), path)


def request(headers: Iterable[tuple[str, str]], path: str = "/") -> bytes:
    """Return a request of a file."""
    lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers), "", ""]
    return "\r\n".join(lines).encode("latin-1")


class Attack:
    """A connection on which all was sent before anything was answered."""

    def __init__(self, port: int, data: bytes) -> None:
        """Connect to a ``port`` of this computer and send ``data``."""
        self._socket = socket.create_connection(("127.0.0.1", port), TIMEOUT)
        self.send(data)

    def send(self, data: bytes) -> None:
        """Send more, as far as the connection takes it."""
        with suppress(OSError):
            self._socket.sendall(data)

    def status(self) -> int | None:
        """Return the number of the answer, None if there is none."""
        head = b""
        with suppress(OSError):
            while b"\r\n" not in head and (more := self._socket.recv(4096)):
                head += more
        words = head.split(b"\r\n")[0].split()
        return int(words[1]) if len(words) > 1 else None

    def close(self) -> None:
        """End it."""
        self._socket.close()


def answer(port: int, data: bytes) -> int | None:
    """Send ``data`` and return the number of the answer, None if there is none."""
    attack = Attack(port, data)
    try:
        return attack.status()
    finally:
        attack.close()
