"""Whether a page is still there: one whose computer or network has failed says no goodbye."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Protocol

PING_PERIOD = 0.5  # s
# After so many periods without an answer, nobody is there.
SILENT_PERIODS = 5


class Socket(Protocol):
    """A connection of websockets, which comes with viser."""

    async def ping(self) -> Awaitable[float]:
        """Send a ping; what is returned is done when it is answered."""

    async def wait_closed(self) -> None:
        """Wait for the end of the connection."""


async def watch(socket: Socket, tell: Callable[[bool], None]) -> None:
    """Tell when pings are not answered any more, and when they are again.

    Browsers answer by themselves, for a page that is hidden as well. The pings that websockets
    sends wait until all that was sent before is on its way, which it never is where nobody reads.
    Periods are counted, not time: if it was us who were held up, the answers have come meanwhile.
    The connection stays: to a browser that is busy beyond measure, another one is more to do.

    Args:
        socket: of a page.
        tell: gets whether it is there, when that changes.
    """
    closed = asyncio.ensure_future(socket.wait_closed())
    answer = asyncio.ensure_future(_answer(socket))
    # A page that is being opened has much to read before.
    await asyncio.wait([answer])
    silent = 0
    while not closed.done():
        if answer.done():
            if silent >= SILENT_PERIODS:
                tell(True)
            silent = 0
            answer = asyncio.ensure_future(_answer(socket))
        await asyncio.wait([closed], timeout=PING_PERIOD)
        if not answer.done():
            silent += 1
            if silent == SILENT_PERIODS:
                tell(False)


async def _answer(socket: Socket) -> None:
    # Of a connection that is closed one hears in another way.
    with suppress(Exception):
        await (await socket.ping())
