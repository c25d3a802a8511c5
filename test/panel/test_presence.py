"""When a page that answers no more is taken for gone, on real connections."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tri_glide_kinematics.panel.presence import PING_PERIOD, SILENT_PERIODS, close_when_silent

SILENCE = PING_PERIOD * SILENT_PERIODS  # s
TIMEOUT = 20.0  # s
HANDSHAKE = (
    b"GET /%s HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)
# More than is kept on the way for one who does not read [bytes].
FLOOD = 32_000_000


class Server:
    """A server that watches its pages, and notes after how long each of them was gone [s]."""

    def __init__(self) -> None:
        self.gone: dict[str, float] = {}
        self.port = 0

    async def on_page(self, socket: ServerConnection) -> None:
        assert socket.request
        name, begin = socket.request.path[1:], time.monotonic()
        watch = asyncio.create_task(close_when_silent(socket))
        with suppress(ConnectionClosed):
            if name == "flooded":
                await socket.send(bytes(FLOOD))
            await socket.recv()
        self.gone[name] = time.monotonic() - begin
        await watch

    async def join_silently(self, name: str) -> asyncio.StreamWriter:
        """Connect as a page that reads nothing and never answers."""
        _, writer = await asyncio.open_connection("127.0.0.1", self.port, limit=1)
        writer.write(HANDSHAKE % name.encode())
        return writer

    async def join(self) -> ClientConnection:
        """Connect as a page that says nothing, but answers pings, as browsers do by themselves."""
        return await asyncio.to_thread(connect, f"ws://127.0.0.1:{self.port}/answering")


def run(test: Callable[[Server], Awaitable[None]]) -> None:
    async def served() -> None:
        mine = Server()
        async with serve(mine.on_page, "127.0.0.1", 0) as server:
            (socket,) = server.sockets
            mine.port = socket.getsockname()[1]
            await test(mine)

    asyncio.run(served())


def test_the_silent_are_gone_soon_and_those_who_answer_stay() -> None:
    async def test(server: Server) -> None:
        with await server.join():
            _silent = [await server.join_silently(name) for name in ("silent", "flooded")]
            end = time.monotonic() + TIMEOUT
            while len(server.gone) < 2 and time.monotonic() < end:
                await asyncio.sleep(0.01)
            assert sorted(server.gone) == ["flooded", "silent"]
            # Of a hiccup nobody is taken for gone.
            assert min(server.gone.values()) > SILENCE - PING_PERIOD

    run(test)


def test_who_was_held_up_itself_takes_nobody_for_gone() -> None:
    async def test(server: Server) -> None:
        with await server.join():
            await asyncio.sleep(0.1)
            # Meanwhile the server hears nobody.
            time.sleep(SILENCE + PING_PERIOD)
            await asyncio.sleep(2.0 * PING_PERIOD)
            assert not server.gone

    run(test)


def test_the_watch_ends_with_its_page() -> None:
    async def test(server: Server) -> None:
        (await server.join()).close()
        end = time.monotonic() + TIMEOUT
        while len(asyncio.all_tasks()) > 1 and time.monotonic() < end:
            await asyncio.sleep(0.01)
        assert list(server.gone) == ["answering"]
        assert len(asyncio.all_tasks()) == 1

    run(test)
