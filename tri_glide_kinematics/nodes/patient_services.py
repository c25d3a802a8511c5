"""A service whose answers reach clients that the middleware discovers late.

A client sees a service as soon as its own half of the discovery is done, so a request may be
answered before the answer has anywhere to go. rmw_fastrtps then waits 100 ms and drops it with a
warning, and the client waits without end. Here such an answer is sent again.
"""

from __future__ import annotations

import time
import warnings
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.service import Service

RETRY_PERIOD = 0.2  # s
GIVE_UP_AFTER = 30.0  # s
MAX_WAITING = 100  # answers; beyond it the one that waited longest is given up


class _Answer(NamedTuple):
    """Something to send, and until when [s of time.monotonic] it is worth it."""

    service: str
    send: Callable[[Any, Any], None]
    response: Any
    header: Any
    deadline: float


class PatientServices:
    """Offers the services of a node, and keeps their answers until the clients can take them."""

    def __init__(self, node: Node, may_wait: Callable[[], bool] = lambda: True) -> None:
        """Offer nothing yet.

        Args:
            node: that offers the services.
            may_wait: whether 100 ms may pass now without anything else being done.
        """
        self._node = node
        self._may_wait = may_wait
        self._waiting: deque[_Answer] = deque()
        self._timer = node.create_timer(
            RETRY_PERIOD, self._send_again, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        self._timer.cancel()

    def create(self, kind: type, name: str, callback: Callable[[Any, Any], Any]) -> Service:
        """Offer a service, as `Node.create_service` does, and return it."""
        service = self._node.create_service(kind, name, callback)
        send = service.send_response

        def send_or_keep(response: Any, header: Any) -> None:
            if not _is_sent(send, response, header):
                deadline = time.monotonic() + GIVE_UP_AFTER
                self._keep(_Answer(name, send, response, header, deadline))

        # The executor sends what the callback returns by this method of the service.
        service.send_response = send_or_keep  # type: ignore[method-assign]
        return service

    def _keep(self, answer: _Answer) -> None:
        if len(self._waiting) == MAX_WAITING:
            self._give_up(self._waiting.popleft())
        self._waiting.append(answer)
        self._timer.reset()

    def _send_again(self) -> None:
        """Send until one fails: each failure takes 100 ms, in which nobody else is served."""
        if not self._may_wait():
            return
        for _ in range(len(self._waiting)):
            answer = self._waiting.popleft()
            if _is_sent(answer.send, answer.response, answer.header):
                continue
            if time.monotonic() < answer.deadline:
                self._waiting.append(answer)
            else:
                self._give_up(answer)
            break
        if not self._waiting:
            self._timer.cancel()

    def _give_up(self, answer: _Answer) -> None:
        self._node.get_logger().warning(
            f"{answer.service}: gave up an answer, as its client was never discovered"
        )


def _is_sent(send: Callable[[Any, Any], None], response: Any, header: Any) -> bool:
    """Send, and return whether the client's reader was known; rclpy says so by a warning only."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RuntimeWarning)
        send(response, header)
    return not any("failed to send response" in str(warning.message) for warning in caught)
