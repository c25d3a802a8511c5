"""The page: viser's server on this machine alone, with a strip and Stop above all else.

This module and ``placing`` use what viser does not offer to its users: to refuse connections, to
have something above its page, to switch off its share link, and to move parts cheaply. viser is
pinned, and tests in a browser show that each of these works.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from dataclasses import asdict, dataclass
from importlib.resources import files
from io import StringIO
from ipaddress import ip_address
from typing import Any
from urllib.parse import urlsplit

import viser
from viser import _messages as messages

from tri_glide_kinematics.panel.errors import PortTakenError
from tri_glide_kinematics.panel.hold import RENEWALS
from tri_glide_kinematics.panel.presence import watch
from tri_glide_kinematics.panel.scene import light_plainly

# After so long without a word from us, the page says so [ms].
SILENCE = 3000
POLICY_VIOLATION = 1008

Log = Callable[[str], object]


@dataclass(frozen=True)
class Strip:
    """What stands above the page.

    Attributes:
        color: ready, motion, warning or fault.
        state: in a word.
        reason: of the state.
        refusal: what was refused last, and why; empty for nothing.
        pages: who has the controls.
        stop: what stands below Stop.
    """

    color: str
    state: str
    reason: str
    refusal: str = ""
    pages: str = ""
    stop: str = ""


class Page:
    """viser's server, and what lies above its page.

    Attributes:
        server: of viser.
        on_presence: gets the number of a page, and whether it answers, when that changes.
    """

    def __init__(self, host: str, port: int, log: Log) -> None:
        """Listen on ``host`` and ``port``; ``log`` gets what somebody should know.

        Raises:
            PortTakenError: if the port is in use.
        """
        self._log = log
        # viser prints a frame with addresses, of which one is not for people.
        with redirect_stdout(StringIO()):
            self.server = server = viser.ViserServer(host=host, port=port, verbose=False)
        # viser looks for another port by itself: the page would not be where it is looked for.
        if port and server.get_port() != port:
            server.stop()
            raise PortTakenError(host, port)
        self._socket = server._websock_server
        self._settings = ""
        self._host = host
        self._refuse_sharing()
        self.on_presence: Callable[[int, bool], None] = lambda *_: None
        self._watches: set[asyncio.Task[None]] = set()
        self._socket._client_connect_cb.insert(0, self._check)
        light_plainly(server.scene)
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        host = "127.0.0.1" if self._host in ("", "0.0.0.0", "::") else self._host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.server.get_port()}"

    def put_above(self, stop: viser.GuiButtonHandle, release: viser.GuiButtonHandle) -> None:
        """Put the strip and Stop above the page of all that connect from now on.

        Args:
            stop: is pressed by Stop.
            release: is pressed when a held button is let go.
        """
        room = files(__package__)
        settings = {
            "css": room.joinpath("page.css").read_text(encoding="utf-8"),
            "stop": stop._impl.uuid,
            "release": release._impl.uuid,
            "renewals": RENEWALS,
            "silence": SILENCE,
        }
        script = room.joinpath("page.js").read_text(encoding="utf-8")
        self._settings = script.replace("SETTINGS", json.dumps(settings), 1)

    def greet(self, client: viser.ClientHandle) -> None:
        """Put all that lies above the page there."""
        self._run(client, self._settings)

    def show(self, client: viser.ClientHandle, strip: Strip) -> None:
        """Show a ``strip`` on one page."""
        self._run(client, f"window.triGlide?.show({json.dumps(asdict(strip))})")

    def _run(self, client: viser.ClientHandle, script: str) -> None:
        # To one page at a time: what is sent to all of them is kept for those that come later.
        client._websock_connection.queue_message(messages.RunJavascriptMessage(script))

    def _refuse_sharing(self) -> None:
        """Have no request of a page lead to a public address."""

        def refuse(*_: Any, **__: Any) -> None:
            self._log("refused to share the page: it is for this network only")

        for kind in (messages.ShareUrlRequest, messages.ShareUrlDisconnect):
            self._socket.unregister_handler(kind)
            self._socket.register_handler(kind, refuse)
        self.server.request_share_url = refuse  # type: ignore[method-assign]

    async def _check(self, connection: Any) -> None:
        """Close a connection of another page than ours, and watch that of ours."""
        socket = self._socket._live_connections[connection.client_id]
        headers = socket.request.headers if socket.request else {}
        if not is_own_page(headers, self._host):
            self._log(f"refused a connection from the page {headers.get('Origin')}: it is not ours")
            await socket.close(POLICY_VIOLATION, "not from this page")
            return
        page = connection.client_id
        watching = asyncio.create_task(
            watch(socket, lambda is_there: self.on_presence(page, is_there))
        )
        # asyncio forgets a task that nobody keeps.
        self._watches.add(watching)
        watching.add_done_callback(self._watches.discard)


def is_own_page(headers: Mapping[str, str], host: str) -> bool:
    """Tell whether a connection comes from the page that this server has sent.

    A browser lets any page of the world connect to this machine, and says which one it is. A name
    that leads here but is not ours may be one of a page that was told to lead here.

    Args:
        headers: of the request; without an origin it comes from no page at all.
        host: on which the server listens.
    """
    origin, here = headers.get("Origin"), headers.get("Host", "")
    if origin is None:
        return True
    if urlsplit(origin).netloc != here:
        return False
    name = urlsplit(f"//{here}").hostname or ""
    return name in ("localhost", host) or _is_address(name)


def is_loopback(host: str) -> bool:
    """Tell whether only this machine can reach a ``host``."""
    return host == "localhost" or (_is_address(host) and ip_address(host).is_loopback)


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
