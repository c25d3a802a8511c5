"""When a page that answers no more is taken for gone, on real connections."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator

import pytest
from websockets.asyncio.client import ClientConnection, connect

from testing.page_reader import PROTOCOL, connected
from testing.waiting import wait_until
from tri_glide_kinematics.panel.page import SILENT_PERIODS, Page

PING_PERIOD = 0.1  # s
SILENCE = PING_PERIOD * SILENT_PERIODS  # s
TIMEOUT = 20.0  # s
# Much to read at once, for one who does not read [bytes].
FLOOD = 32_000_000

Told = list[tuple[int, bool]]


@pytest.fixture
def told() -> Told:
    """Return pages, and whether they answer, as it is told."""
    return []


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, told: Told) -> Iterator[Page]:
    monkeypatch.setattr("tri_glide_kinematics.panel.page.PING_PERIOD", PING_PERIOD)
    page = Page("127.0.0.1", 0, "Ab_" * 14, print)
    page.on_presence = lambda *what: told.append(what)
    yield page
    page.server.stop()


def sockets(page: Page) -> dict[int, object]:
    return page.server._websock_server._live_connections


async def until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end
        await asyncio.sleep(0.01)


async def join(page: Page) -> ClientConnection:
    """Connect as a page that says nothing, but answers pings, as browsers do by themselves."""
    address, count = page.address.replace("http", "ws", 1), len(sockets(page))
    client = await connect(address, subprotocols=[PROTOCOL], max_size=None, ping_interval=None)
    await until(lambda: len(sockets(page)) > count)
    # A page that is being opened has much to read before it is watched.
    await asyncio.sleep(2.0 * PING_PERIOD)
    return client


def test_the_silent_are_gone_soon_and_come_back_when_they_answer(page: Page, told: Told) -> None:
    async def test() -> None:
        answering, silent, flooded = [await join(page) for _ in range(3)]
        for client in (silent, flooded):
            client.transport.pause_reading()
        begin = time.monotonic()
        flood = sockets(page)[2].send(bytes(FLOOD))
        sending = asyncio.run_coroutine_threadsafe(flood, page.server.get_event_loop())
        await until(lambda: len(told) == 2)
        assert sorted(told) == [(1, False), (2, False)]
        assert time.monotonic() - begin > SILENCE - PING_PERIOD, "it was a hiccup only"
        for client in (silent, flooded):
            client.transport.resume_reading()
        await until(lambda: len(told) == 4)
        assert sorted(told[2:]) == [(1, True), (2, True)]
        await asyncio.wrap_future(sending)
        for client in (answering, silent, flooded):
            await client.close()
        await until(lambda: not page._watches)
        assert len(told) == 4

    asyncio.run(test())


def test_who_was_held_up_itself_takes_nobody_for_gone(page: Page, told: Told) -> None:
    # Its answers come from a thread of its own.
    with connected(page.address):
        wait_until(page.server.get_clients, "the page")
        time.sleep(2.0 * PING_PERIOD)
        # Meanwhile the server hears nobody.
        page.server.get_event_loop().call_soon_threadsafe(time.sleep, SILENCE + PING_PERIOD)
        time.sleep(SILENCE + 3.0 * PING_PERIOD)
        assert not told
