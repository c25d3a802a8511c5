"""Reads what the panel sends to a page, as a browser on another computer does, and draws nothing.

Run it as ``python -m testing.page_reader ADDRESS``; it ends with the connection.
"""

import sys
from typing import Any

import msgspec
import zstandard
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

PROTOCOL = "viser-v1.1.1"
# A page is there once it has told where its camera is.
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 1.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 720,
    "image_width": 1280,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


def message(kind: str, **values: Any) -> bytes:
    """Return a message of a page as viser reads it."""
    packed: bytes = msgspec.msgpack.encode({"type": kind, **values})
    return packed


def connected(address: str) -> ClientConnection:
    """Return a connection to the panel with this ``address``, and be a page that is there."""
    page = connect(
        address.replace("http", "ws", 1),
        subprotocols=[Subprotocol(PROTOCOL)],
        max_size=None,
        # Behind messages that nobody reads, no goodbye of the panel is ever heard.
        close_timeout=0.1,
    )
    page.send(msgspec.msgpack.encode(CAMERA))
    return page


def messages_in(data: str | bytes) -> list[dict[str, Any]]:
    """Return the messages that the panel has sent at once."""
    assert isinstance(data, bytes)
    # Two lengths, compressed messages, and what they refer to.
    length = int.from_bytes(data[8:16], "little")
    inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + length])
    found: list[dict[str, Any]] = msgspec.msgpack.decode(inner)["messages"]
    return found


def main() -> None:
    """Read until nothing more comes."""
    with connected(sys.argv[1]) as page:
        for _ in page:
            pass


if __name__ == "__main__":
    main()
