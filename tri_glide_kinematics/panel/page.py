"""The page: viser's server on this machine alone, with a strip and Stop above all else.

Tests in a browser show that what ``viser_parts`` takes of viser for this works.
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any

import viser
from websockets.asyncio.server import ServerConnection

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.admission import QUERY, Admission, guarded_server
from tri_glide_kinematics.panel.machine_scene import light_plainly
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.operators import RENEWALS, Entry, MessageHistory
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.programs import PIECE
from tri_glide_kinematics.panel.status_strip import Strip
from tri_glide_kinematics.panel.viser_parts import Connections, messages, run_script, uuid_of

PING_PERIOD = 0.5  # s
# After so many periods without an answer, nobody is there.
SILENT_PERIODS = 5


async def watch(socket: ServerConnection, tell: Callable[[bool], None]) -> None:
    """Tell when pings are not answered any more, and when they are again.

    Browsers answer by themselves, for a page that is hidden as well. The pings that websockets
    sends wait until all that was sent before is on its way, which it never is where nobody reads.
    Periods are counted, not time: if it was us who were held up, the answers have come meanwhile.
    The connection stays: to a browser that is busy beyond measure, another one is more to do.
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


async def _answer(socket: ServerConnection) -> None:
    # Of a connection that is closed one hears in another way.
    with suppress(Exception):
        await (await socket.ping())


# After so long without a word from us, the page says so [ms].
SILENCE = 3000

# Time between two wakings of the pages that may have something to be sent [s].
WAKE_PERIOD = 0.5

Log = Callable[[str], object]


class PortTakenError(KinematicsError):
    """Somebody else listens where the page should be."""

    def __init__(self, host: str, port: int) -> None:
        """Keep the address."""
        self.host, self.port = host, port
        super().__init__(f"port {port} of {host} is in use: choose another one with -p port:=...")


def set_theme(gui: viser.GuiApi, *, is_dark: bool) -> None:
    """Show all that belongs to viser in dark or light colours."""
    gui.configure_theme(
        show_logo=False, show_share_button=False, control_width="medium", dark_mode=is_dark
    )


class Page:
    """viser's server, and what lies above its page.

    Attributes:
        server: of viser.
        on_presence: gets the number of a page, and whether it answers, when that changes.
        on_file: gets the number of a page, and what it says of a file that it sends.
        open_tabs: which tab each page has open, by its number: empty while the page is hidden. A
            page is in it once all that lies above it is there.
    """

    def __init__(self, host: str, port: int, token: str, log: Log) -> None:
        """Listen on ``host`` and ``port``, 0 for any; who connects has to know the ``token``.

        ``log`` gets one line a second, at most two, with what somebody should know.

        Raises:
            PortTakenError: if the port is in use.
            UnguardedPageError: if connections could not be refused.
        """
        self._token = token
        self.server = server = guarded_server(
            host, port, Admission(host, token), log, self._take_file
        )
        # viser looks for another port by itself: the page would not be where it is looked for.
        if port and server.get_port() != port:
            server.stop()
            raise PortTakenError(host, port)
        # ``guard`` drops what pages say of a public address.
        self._connections = Connections(server)
        self._settings = ""
        self._host = host
        self.on_presence: Callable[[int, bool], None] = lambda *_: None
        self.on_file: Callable[[int, messages.Message], object] = lambda *_: None
        self._watches: set[asyncio.Task[None]] = set()
        self.open_tabs: dict[int, str] = {}
        self._connections.on_connect(self._watch)
        self._loop = server.get_event_loop()
        self._loop.call_soon_threadsafe(self._wake)
        light_plainly(server.scene)
        set_theme(server.gui, is_dark=False)

    @property
    def address(self) -> str:
        """The address to be opened in a browser: with the token."""
        return f"{self.origin}/?{QUERY}={self._token}"

    @property
    def origin(self) -> str:
        """The address of the page, without the token."""
        host = "127.0.0.1" if self._host in ("", "0.0.0.0", "::") else self._host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.server.get_port()}"

    def put_above(self, requests: OperatorRequests) -> None:
        """Put the strip and Stop above the page of all that connect from now on.

        They press buttons that no one sees, for the ``requests``. A held button that is let go
        presses ``release``; a page that is left presses ``leave``, as its browser may keep its
        connection.
        """
        room = files(__package__)
        gui = self.server.gui

        def button(on_click: Callable[[Any], Any]) -> str:
            made = gui.add_button("unseen", visible=False)
            made.on_click(on_click)
            return uuid_of(made)

        def theme(is_dark: bool) -> str:
            async def show(event: Any) -> None:
                # Of the page alone that asks for it.
                if event.client is not None:
                    set_theme(event.client.gui, is_dark=is_dark)

            return button(show)

        # viser tells of a text only if it has changed: pages put a number before the tab.
        tab = gui.add_text("tab", "", visible=False)

        async def open_tab(event: Any) -> None:
            self.open_tabs[event.client_id] = event.target.value.partition(" ")[2]

        async def forget(client: viser.ClientHandle) -> None:
            self.open_tabs.pop(client.client_id, None)

        tab.on_update(open_tab)
        self.server.on_client_disconnect(forget)
        settings = {
            "css": room.joinpath("page.css").read_text(encoding="utf-8"),
            "stop": button(requests.stop),
            "tab": uuid_of(tab),
            "release": button(requests.release),
            "leave": button(requests.leave),
            "dark": theme(is_dark=True),
            "light": theme(is_dark=False),
            "renewals": RENEWALS,
            "silence": SILENCE,
            "piece": PIECE,
        }
        script = room.joinpath("page.js").read_text(encoding="utf-8")
        self._settings = script.replace("SETTINGS", json.dumps(settings), 1)

    def greet(self, client: viser.ClientHandle) -> None:
        """Put all that lies above the page there."""
        run_script(client, self._settings)

    def show(self, client: viser.ClientHandle, strip: Strip | None) -> None:
        """Show a ``strip`` on one page; None is a sign of life, for one that has not changed."""
        run_script(client, f"window.triGlide?.show({json.dumps(asdict(strip)) if strip else ''})")

    def shows(self, tab: str) -> bool:
        """Tell whether any page has this ``tab`` open."""
        return tab in tuple(self.open_tabs.values())

    def ask_for_pieces(self, page: int, key: str, count: int) -> None:
        """Ask a ``page`` for the first so many pieces of a file, by its ``key``."""
        client = self.server.get_clients().get(page)
        if client is not None:
            run_script(client, f"window.triGlide?.sendPieces({json.dumps(key)}, {count})")

    def _take_file(self, connection: Any, message: messages.Message) -> None:
        """Pass on what the page of a ``connection`` says of a file."""
        page = self._connections.page_of(connection)
        if page is not None:
            self.on_file(page, message)

    def show_history(self, client: viser.ClientHandle, history: Sequence[Entry]) -> None:
        """Show on one page what was told, the newest first."""
        rows = [{**asdict(entry), "time": entry.clock} for entry in history]
        run_script(client, f"window.triGlide?.history({json.dumps(rows)})")

    def _wake(self) -> None:
        """Send what waits to be sent, again and again."""
        self._connections.wake()
        self._loop.call_later(WAKE_PERIOD, self._wake)

    async def _watch(self, connection: Any) -> None:
        """Watch a page that was let in."""
        page = connection.client_id
        socket = self._connections.socket_of(page)
        watching = asyncio.create_task(
            watch(socket, lambda is_there: self.on_presence(page, is_there))
        )
        # asyncio forgets a task that nobody keeps.
        self._watches.add(watching)
        watching.add_done_callback(self._watches.discard)


TELL_PERIOD = 0.1  # s between two looks at what pages are told
HISTORY_PERIOD = 0.5  # s between two lists of what was told
SIGN_PERIOD = 1.0  # s after which a page is told that nothing has changed


@dataclass
class _Told:
    """What a page was told.

    Attributes:
        news: its strip, and the tab that it had open: one that has begun anew knows nothing.
        at: when it was told something [s].
        history: how much of the history it has.
    """

    news: tuple[Strip, str] | None = None
    at: float = -math.inf
    history: int = -1


class PagesNews:
    """Tells each page what stands above it, and the history, if that is new."""

    def __init__(self, page: Page) -> None:
        """Tell by a ``page``."""
        self._page = page
        self._told: dict[int, _Told] = {}
        self._pace, self._history_pace = Pace(TELL_PERIOD), Pace(HISTORY_PERIOD)

    def tell(
        self,
        clients: Mapping[int, viser.ClientHandle],
        strip_of: Callable[[int], Strip],
        history: MessageHistory,
    ) -> None:
        """Tell ``clients``, by their numbers, if it is time to; ``strip_of`` one is asked for."""
        now = time.monotonic()
        if not self._pace.is_due(now):
            return
        for number in self._told.keys() - clients.keys():
            del self._told[number]
        for number, tab in tuple(self._page.open_tabs.items()):
            if (client := clients.get(number)) is None:
                continue
            told, news = self._told.setdefault(number, _Told()), (strip_of(number), tab)
            if news != told.news or now - told.at > SIGN_PERIOD:
                self._page.show(client, news[0] if news != told.news else None)
                told.news, told.at = news, now
        changes = history.changes
        behind = [number for number, told in self._told.items() if told.history != changes]
        if behind and self._history_pace.is_due(now):
            for number in behind:
                self._told[number].history = changes
                self._page.show_history(clients[number], tuple(history))
