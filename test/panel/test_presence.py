"""When a page that answers no more is taken for gone, on real connections."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect as connect_thread

from tri_glide_kinematics.panel.page import SILENT_PERIODS, watch

PING_PERIOD = 0.1  # s
SILENCE = PING_PERIOD * SILENT_PERIODS  # s
TIMEOUT = 20.0  # s
# Much to read at once, for one who does not read [bytes].
FLOOD = 32_000_000


@pytest.fixture(autouse=True)
def short_periods(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tri_glide_kinematics.panel.page.PING_PERIOD", PING_PERIOD)


class Server:
    """A server that watches its pages.

    Attributes:
        sockets: of pages that have answered, by their names.
        gone: pages that answer no more.
        back: pages that answer again.
        ended: pages of which nobody is watched any more.
    """

    def __init__(self) -> None:
        self.sockets: dict[str, ServerConnection] = {}
        self.gone: list[str] = []
        self.back: list[str] = []
        self.ended: list[str] = []
        self._port = 0

    async def run(self, test: Callable[[Server], Awaitable[None]]) -> None:
        async with serve(self._on_page, "127.0.0.1", 0) as server:
            (socket,) = server.sockets
            self._port = socket.getsockname()[1]
            await test(self)

    async def _on_page(self, socket: ServerConnection) -> None:
        assert socket.request
        name = socket.request.path[1:]

        def tell(is_there: bool) -> None:
            (self.back if is_there else self.gone).append(name)

        watching = asyncio.create_task(watch(socket, tell))
        # With the second answer, that to the first ping of the watch has come, too.
        for _ in range(2):
            await (await socket.ping())
        self.sockets[name] = socket
        with suppress(ConnectionClosed):
            await socket.recv()
        await watching
        self.ended.append(name)

    def address(self, name: str) -> str:
        return f"ws://127.0.0.1:{self._port}/{name}"

    async def join(self, name: str) -> ClientConnection:
        """Connect as a page that says nothing, but answers pings, as browsers do by themselves."""
        page = await connect(self.address(name), max_size=None, ping_interval=None)
        await until(lambda: name in self.sockets)
        return page


async def until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end
        await asyncio.sleep(0.01)


def test_the_silent_are_gone_soon_and_come_back_when_they_answer() -> None:
    async def test(server: Server) -> None:
        answering = await server.join("answering")
        silent, flooded = [await server.join(name) for name in ("silent", "flooded")]
        for page in (silent, flooded):
            page.transport.pause_reading()
        begin = time.monotonic()
        sending = asyncio.create_task(server.sockets["flooded"].send(bytes(FLOOD)))
        await until(lambda: len(server.gone) == 2)
        assert set(server.gone) == {"silent", "flooded"}
        assert time.monotonic() - begin > SILENCE - PING_PERIOD, "it was a hiccup only"
        assert not server.back
        for page in (silent, flooded):
            page.transport.resume_reading()
        await until(lambda: len(server.back) == 2)
        await sending
        for page in (answering, silent, flooded):
            await page.close()
        await until(lambda: len(server.ended) == 3)
        assert len(server.gone) == len(server.back) == 2

    asyncio.run(Server().run(test))


def test_who_was_held_up_itself_takes_nobody_for_gone() -> None:
    async def test(server: Server) -> None:
        # Its answers come from a thread of its own.
        page = await asyncio.to_thread(connect_thread, server.address("answering"))
        await until(lambda: server.sockets)
        # Meanwhile the server hears nobody.
        time.sleep(SILENCE + PING_PERIOD)
        await asyncio.sleep(2.0 * PING_PERIOD)
        assert not server.gone
        await asyncio.to_thread(page.close)

    asyncio.run(Server().run(test))
