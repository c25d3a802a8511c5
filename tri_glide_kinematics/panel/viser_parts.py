"""What the panel takes from inside viser, which does not offer it to its users: all of it is here.

viser is pinned; ``test/panel/test_viser_parts.py`` tells what another version of it lacks.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

import viser
from viser import _messages as messages

from tri_glide_kinematics.vectors import Vector3

Quaternion = tuple[float, float, float, float]

__all__ = (
    "Connections",
    "Quaternion",
    "messages",
    "place",
    "run_script",
    "show_value",
    "turn",
    "uuid_of",
)


def uuid_of(handle: Any) -> str:
    """Return by what a page calls a field or a button."""
    return str(handle._impl.uuid)


def show_value(handle: Any, value: Any) -> None:
    """Show a ``value`` in a field on all pages.

    viser does not send what a field has already: a page whose own, newer value has crossed an older
    one of the panel would go on to show that.
    """
    handle.value = value
    update = messages.GuiUpdateMessage(uuid_of(handle), {"value": handle.value})
    handle._impl.gui_api._websock_interface.queue_message(update)


def place(handle: Any, position: Vector3) -> None:
    """Move a part to a ``position`` [m] in the frame of what it belongs to."""
    handle._impl.position[:] = position
    handle._impl.api._queue_scene_message(messages.SetPositionMessage(handle.name, position))


def turn(handle: Any, wxyz: Quaternion) -> None:
    """Turn a part to a rotation in the frame of what it belongs to."""
    handle._impl.wxyz[:] = wxyz
    handle._impl.api._queue_scene_message(messages.SetOrientationMessage(handle.name, wxyz))


def run_script(client: viser.ClientHandle, script: str) -> None:
    """Run a ``script`` on one page; what is sent to all of them is kept for those that come."""
    client._websock_connection.queue_message(messages.RunJavascriptMessage(script))


class Connections:
    """The connections of a ``server`` with pages."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Look after them; none of them leads to a public address."""
        self._server = server._websock_server
        server.request_share_url = lambda *_, **__: None  # type: ignore[method-assign]

    def on_connect(self, call: Callable[[Any], Coroutine[Any, Any, None]]) -> None:
        """Have a new connection told before viser sends anything."""
        self._server._client_connect_cb.insert(0, call)

    def socket_of(self, page: int) -> Any:
        """Return the connection of websockets with a ``page``."""
        return self._server._live_connections[page]

    def page_of(self, socket: object) -> int | None:
        """Return the page at a connection; None if it has gone."""
        live = self._server._live_connections.items()
        return next((page for page, each in live if each is socket), None)

    def wake(self) -> None:
        """Send what waits to be sent.

        viser sets the event that something is to be sent in the thread that has it. Where this
        falls between the look at the event and the wait for it, the event is set, nobody is woken,
        and to set it again wakes nobody either.
        """
        states = tuple(self._server._client_state_from_id.values())
        for buffer in (self._server._broadcast_buffer, *(each.message_buffer for each in states)):
            buffer.message_event.clear()
            buffer.message_event.set()
