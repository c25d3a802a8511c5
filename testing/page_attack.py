"""Connections to the panel's page as nobody's browser makes them: all is sent at once."""

import base64
import math
import os
import random
import socket
import struct
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import msgspec

from testing.page_reader import CAMERA, PROTOCOL, connected, message, messages_in

# An answer takes a few milliseconds; a busy computer takes longer [s].
TIMEOUT = 10.0
# A page has got all that there is after this [s].
LISTENING = 2.0
TEXT, BINARY, CLOSE = 0x81, 0x82, 0x88
HANDLE = "/go_to"
CAMERA_VALUES = {name: value for name, value in CAMERA.items() if name != "type"}


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

    def drain(self) -> None:
        """Say no more, and read until the other side has ended it."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            while self._socket.recv(1 << 16):
                pass

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


def controls(address: str) -> list[str]:
    """Return the identities of all controls of the page at an ``address`` with its token."""
    found: set[str] = set()
    with connected(address) as page:
        end = time.monotonic() + LISTENING
        while time.monotonic() < end:
            for each in messages_in(page.recv(TIMEOUT)):
                found.update(filter(None, (each.get("uuid"), each.get("name"))))
    return sorted(found)


class PageFuzz:
    """Connections by chance: requests with all kinds of origins, hosts and tokens, and frames."""

    def __init__(self, port: int, token: str, seed: int) -> None:
        """Attack the page on a ``port`` whose ``token`` is known."""
        self._port = port
        self._here = f"127.0.0.1:{port}"
        self._token = token
        self._rng = random.Random(seed)

    def refused(self, frames: int = 4) -> tuple[int | None, bytes]:
        """Ask for a connection in a way that is wrong, and send ``frames`` at once.

        Returns:
            The number of the answer, None for none, and what was sent.
        """
        choose = self._rng.choice
        if self._rng.random() < 0.1:
            data = self._no_request()
        else:
            origins = [[("Origin", f"http://{self._here}")], [], *self._foreign_origins()]
            hosts = [[("Host", self._here)], *self._foreign_hosts()]
            tokens = [[self.cookie(self._token)], *self._wrong_tokens()]
            while True:
                origin, host, token = choose(origins), choose(hosts), choose(tokens)
                if origin not in origins[:2] or host != hosts[0] or token != tokens[0]:
                    break
            headers = [*host, *origin, *token]
            self._rng.shuffle(headers)
            path = choose(("/", "/?token=", f"/?token={'x' * 43}", "/../../etc/passwd", "/?" * 99))
            build = choose((upgrade, upgrade, upgrade, request))
            data = build(headers, path)
        data += b"".join(self.frame() for _ in range(frames))
        return answer(self._port, data), data

    def admitted(self, frames: int, identities: Sequence[str] = ()) -> int | None:
        """Connect as the page, and send frames to controls; return the number of the answer."""
        headers = [
            ("Host", self._here),
            ("Origin", f"http://{self._here}"),
            self.cookie(self._token),
        ]
        attack = Attack(self._port, upgrade(headers))
        status = attack.status()
        attack.send(frame(msgspec.msgpack.encode(CAMERA)))
        for _ in range(frames):
            attack.send(self.frame(identities))
        attack.send(frame(b"", CLOSE))
        attack.drain()
        attack.close()
        return status

    def cookie(self, token: str) -> tuple[str, str]:
        """Return the header with a ``token``."""
        return "Cookie", f"tri_glide_panel_{self._port}={token}"

    def frame(self, identities: Sequence[str] = ()) -> bytes:
        """Return a frame by chance: nonsense, or a message to one of the controls."""
        rng = self._rng
        kind = rng.randrange(8)
        if kind == 0:
            return frame(rng.randbytes(rng.randrange(200)))
        if kind == 1:
            return frame(rng.randbytes(rng.randrange(200)).hex().encode(), TEXT)
        if kind == 2:
            return frame(msgspec.msgpack.encode(self._value(3)))
        if kind == 3 and rng.random() < 0.1:
            return frame(bytes(1_000_000))
        if kind == 4 and rng.random() < 0.1:
            # It tells more than ever comes.
            return frame(b"", length=rng.choice((2**16, 2**31, 2**62)))
        if kind == 5 and rng.random() < 0.1:
            return frame(b"", rng.choice((0x80, 0x83, 0x89, 0x8A, 0xC2, 0x02)))
        if kind == 6 and not identities:
            return b"".join(map(frame, go_to((rng.uniform(-0.05, 0.05), 0.0, 0.3))))
        return frame(self._message(identities))

    def _message(self, identities: Sequence[str]) -> bytes:
        rng = self._rng
        name = rng.choice(identities or ("/go_to", "x"))
        camera = {**CAMERA_VALUES, rng.choice(list(CAMERA_VALUES)): self._value(1)}
        values: dict[str, dict[str, Any]] = {
            "GuiUpdateMessage": {"uuid": name, "updates": self._updates()},
            "GuiButtonHoldMessage": {"uuid": name, "frequency": self._value(0)},
            "TransformControlsUpdateMessage": {"name": name, "wxyz": 1, "position": self._value(1)},
            "TransformControlsDragStartMessage": {"name": self._value(1)},
            "ViewerCameraMessage": camera,
            "FileTransferStartUpload": {"source_component_uuid": name, "transfer_uuid": "x"},
            "RunJavascriptMessage": {"source": "alert(1)"},
            "GuiFormDirtyMessage": {"uuid": name},
            "ShareUrlRequest": {},
        }
        kind = rng.choice(list(values))
        return message(**{**values[kind], "kind": kind})

    def _updates(self) -> Any:
        if self._rng.random() < 0.2:
            return {"update_cb": [], "removed": True}
        return {"value": self._value(2)}

    def _value(self, depth: int) -> Any:
        """Return something that can be packed."""
        rng = self._rng
        if depth and rng.random() < 0.4:
            values = [self._value(depth - 1) for _ in range(rng.randrange(5))]
            return values if rng.random() < 0.7 else {str(v)[:9]: v for v in values}
        odd = (None, True, 0, -1, 2**63, math.nan, math.inf, 1e308, "", "x" * 5000, b"\0", "0.1")
        return rng.choice((*odd, rng.uniform(-1.0, 1.0)))

    def _foreign_origins(self) -> list[list[tuple[str, str]]]:
        texts = (
            "null",
            "",
            "http://elsewhere.example",
            "https://elsewhere.example:8080",
            f"http://{self._here}.elsewhere.example",
            f"http://elsewhere.example@{self._here}",
            f"http://{self._here}/",
            f"ws://{self._here}",
            "http://127.0.0.1:1",
            "http://[::1",
            "\xff" * 100,
            "http://" + "a" * 7000,
        )
        twice = [("Origin", f"http://{self._here}"), ("Origin", "http://elsewhere.example")]
        return [[("Origin", text)] for text in texts] + [twice]

    def _foreign_hosts(self) -> list[list[tuple[str, str]]]:
        texts = (
            "",
            "rebound.example",
            f"rebound.example:{self._port}",
            f"127.0.0.1.rebound.example:{self._port}",
            f"x@{self._here}",
            f"{self._here}/x",
            "127.1",
            "0x7f000001",
            "[::1",
            "127.0.0.1:99999",
            "localhost.",
            "\xe9\xff",
        )
        return [[], [("Host", self._here)] * 2, *([("Host", text)] for text in texts)]

    def _wrong_tokens(self) -> list[list[tuple[str, str]]]:
        own = self._token
        texts = ("", own[:-1], own + "x", own.swapcase(), "\xff" * 43, "x" * 5000, f"{own[:20]};")
        other = "Cookie", f"tri_glide_panel_{self._port + 1}={own}"
        return [[], [other], *([self.cookie(text)] for text in texts)]

    def _no_request(self) -> bytes:
        rng = self._rng
        lines = (
            rng.randbytes(rng.randrange(1, 300)),
            b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello",
            b"GET / HTTP/9.9",
            b"GET /" + b"a" * 20_000,
            b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 300,
            b"\x16\x03\x01\x02\x00\x01",
        )
        return rng.choice(lines) + b"\r\n\r\n"
