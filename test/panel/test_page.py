"""The page's server: whom it lets in, and what it refuses."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from tri_glide_kinematics.panel.errors import PortTakenError
from tri_glide_kinematics.panel.page import Page, is_loopback, is_own_page

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
TIMEOUT = 20.0  # s
# {"type": "ShareUrlRequest"} in MessagePack.
SHARE_REQUEST = b"\x81\xa4type\xafShareUrlRequest"


@pytest.fixture
def log() -> list[str]:
    return []


@pytest.fixture
def page(log: list[str]) -> Iterator[Page]:
    page = Page("127.0.0.1", 0, log.append)
    yield page
    page.server.stop()


def connected(page: Page, origin: str | None = None) -> ClientConnection:
    address = page.address.replace("http", "ws", 1)
    return connect(address, origin=origin and Origin(origin), subprotocols=[PROTOCOL])


def wait_for(condition: Callable[[], object]) -> None:
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_request_to_share_is_refused(page: Page, log: list[str]) -> None:
    with connected(page, page.address) as socket:
        socket.send(SHARE_REQUEST)
        wait_for(lambda: log)
    assert "refused to share" in log[0]
    assert page.server._share_tunnel is None
    assert page.server.request_share_url() is None
    assert page.server._share_tunnel is None


def test_the_page_itself_is_let_in_and_others_are_not(page: Page, log: list[str]) -> None:
    with connected(page, page.address) as socket:
        assert socket.recv(TIMEOUT)
    assert not log
    for origin in ("http://elsewhere.example", page.address + "1", "null"):
        with connected(page, origin) as socket, pytest.raises(ConnectionClosed):
            while True:
                socket.recv(TIMEOUT)
    assert len(log) == 3
    assert "http://elsewhere.example" in log[0]


@pytest.mark.parametrize(
    ("origin", "host", "is_own"),
    [
        (None, "127.0.0.1:8080", True),
        ("http://127.0.0.1:8080", "127.0.0.1:8080", True),
        ("http://localhost:8080", "localhost:8080", True),
        ("http://[::1]:8080", "[::1]:8080", True),
        ("http://192.168.0.7:8080", "192.168.0.7:8080", True),
        ("http://127.0.0.1:8081", "127.0.0.1:8080", False),
        ("https://elsewhere.example", "127.0.0.1:8080", False),
        # A name that its owner has let lead to this machine.
        ("http://rebound.example:8080", "rebound.example:8080", False),
        ("null", "127.0.0.1:8080", False),
    ],
)
def test_whose_page_it_is(origin: str | None, host: str, is_own: bool) -> None:
    headers = {"Host": host, **({} if origin is None else {"Origin": origin})}
    assert is_own_page(headers, "127.0.0.1") is is_own


@pytest.mark.parametrize(
    ("host", "is_own"),
    [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("robot", False)],
)
def test_loopback(host: str, is_own: bool) -> None:
    assert is_loopback(host) is is_own


def test_a_port_that_is_taken_is_told(page: Page) -> None:
    port = page.server.get_port()
    with pytest.raises(PortTakenError, match=f"port {port} of 127.0.0.1 is in use"):
        Page("127.0.0.1", port, print)
