"""Inputs whose values are the operator's: viser shares each of them among all pages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tri_glide_kinematics.panel.tabs.operator_requests import Desk, Event


class OperatorsInput:
    """An input that only the page with the controls changes; on the others it goes back.

    Attributes:
        value: that the operator, or the program, has set last.
    """

    def __init__(
        self, desk: Desk, handle: Any, on_change: Callable[[Any], None] | None = None
    ) -> None:
        """Take over an input.

        Args:
            desk: of the operator.
            handle: of viser's input.
            on_change: gets what the operator has set, where the node spins.
        """
        self.value = handle.value
        self._desk = desk
        self._handle = handle
        self._on_change = on_change
        handle.on_update(self._take)

    def set(self, value: Any) -> None:
        """Set it by the program."""
        self.value = value
        self._handle.value = value

    async def _take(self, event: Event) -> None:
        if event.client_id is None:
            return
        if not self._desk.may(event.client_id):
            self._handle.value = self.value
            return
        self.value = value = event.target.value
        on_change = self._on_change
        if on_change is not None:
            self._desk.wish(lambda: on_change(value))
