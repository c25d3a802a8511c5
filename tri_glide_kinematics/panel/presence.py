"""Whether a page is still there: one whose computer or network has failed says no goodbye."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.protocol import State

PING_PERIOD = 0.5  # s
# After so many periods without an answer, nobody is there.
SILENT_PERIODS = 5


async def close_when_silent(socket: ServerConnection) -> None:
    """Close a connection when pings are not answered any more; return when it is closed.

    Browsers answer by themselves, for a page that is hidden or busy as well. The pings that
    websockets sends wait until all that was sent before is on its way, which it never is where
    nobody reads. Periods are counted, not time: if it was us who were held up, the answers have
    come meanwhile.
    """
    answer = asyncio.ensure_future(_answer(socket))
    silent = 0
    while socket.state is State.OPEN:
        await asyncio.sleep(PING_PERIOD)
        if answer.done():
            silent = 0
            answer = asyncio.ensure_future(_answer(socket))
        elif (silent := silent + 1) >= SILENT_PERIODS:
            # To say goodbye would take an answer, too.
            socket.transport.abort()
            return


async def _answer(socket: ServerConnection) -> None:
    with suppress(ConnectionClosed):
        await (await socket.ping())
