"""Requests to mechanism_node of which only the newest counts; nothing waits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.task import Future

from tri_glide_interfaces.srv import SolveFMechanism, SolveFourBar, TraceFMechanism, TraceFourBar

PATIENCE = 5.0  # s, until an answer is given up

_NAMES: dict[type, str] = {
    SolveFourBar: "solve_four_bar",
    TraceFourBar: "trace_four_bar",
    SolveFMechanism: "solve_f_mechanism",
    TraceFMechanism: "trace_f_mechanism",
}


@dataclass(frozen=True)
class Wish:
    """A request, and what the one who asks needs to know when the answer comes."""

    request: Any
    about: Any


class NewestRequest:
    """One request on its way, and the newest wish beyond it.

    A wish that is not sent yet gives way to a newer one: whoever drags a slider sees the answers
    that the server has time for, and the last one for certain. All calls come from the thread that
    spins the node.

    Attributes:
        problem: why there is no answer, or nothing.
    """

    def __init__(self, client: Any) -> None:
        """Ask through a ``client`` of rclpy."""
        self._client = client
        self._wish: Wish | None = None
        self._sent: tuple[Wish, Future, float] | None = None
        self.problem = ""

    def ask(self, request: Any, about: Any = None) -> None:
        """Have a request sent when no other is on its way; ``about`` comes with its answer."""
        self._wish = Wish(request, about)

    def take(self, time: float) -> tuple[Wish, Any] | None:
        """Return what was asked with the answer that has come, if one has; send what waits.

        Args:
            time: of a steady clock [s].
        """
        answered = None
        if self._sent is not None:
            wish, future, sent_at = self._sent
            if future.done():
                answered, self._sent = (wish, future.result()), None
                self.problem = ""
            elif time - sent_at > PATIENCE:
                self._client.remove_pending_request(future)
                self._sent = None
                self._wish = self._wish or wish
                self.problem = f"mechanism_node has not answered for {PATIENCE:g} s"
        if self._sent is None and self._wish is not None:
            if self._client.service_is_ready():
                self._sent = self._wish, self._client.call_async(self._wish.request), time
                self._wish = None
            else:
                self.problem = "mechanism_node is not running"
        return answered


class MechanismRequests:
    """The clients of mechanism_node's services, made once and early.

    The first answer to a new client takes longer than those after it.
    """

    def __init__(self, node: Node, server: str = "mechanism_node") -> None:
        """Make clients on ``node`` of the node ``server``, by its name in the same namespace."""
        self._clients = {
            kind: node.create_client(kind, f"{server}/{name}") for kind, name in _NAMES.items()
        }

    def newest_of(self, kind: type) -> NewestRequest:
        """Return a way to ask a service of one kind."""
        return NewestRequest(self._clients[kind])
