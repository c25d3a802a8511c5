"""Clients that call one service at the same moment."""

from __future__ import annotations

from types import TracebackType
from typing import Any

from testing.client import Probe

PATIENCE = 30.0  # s, for what takes three at most


class Crowd:
    """Clients of one service in one node, with rclpy's own settings."""

    def __init__(self, probe: Probe, kind: type, service: str, count: int) -> None:
        """Make ``count`` clients that know the ``service``."""
        self._probe = probe
        self._service = service
        self._clients = [probe.node.create_client(kind, service) for _ in range(count)]
        self._futures: list[Any] = []
        for client in self._clients:
            probe.wait_for(client.service_is_ready, service)

    def call(self, request: Any, times: int = 1) -> None:
        """Call by each client ``times`` times, before any answer is looked at."""
        for client in self._clients:
            self._futures += [client.call_async(request) for _ in range(times)]

    def wait(self) -> None:
        """Wait until each call is answered.

        Raises:
            TimeoutError: if one is not.
        """
        what = f"{len(self._futures)} answers of {self._service}"
        self._probe.wait_for(lambda: self.missing == 0, what, PATIENCE)

    @property
    def missing(self) -> int:
        """How many calls are not answered."""
        return sum(not future.done() for future in self._futures)

    def __enter__(self) -> Crowd:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Be no clients any more."""
        for client in self._clients:
            self._probe.node.destroy_client(client)
