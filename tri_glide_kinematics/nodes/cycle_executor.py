"""Spins a node that does the same many times a second, and does not look at the rest each time."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.timer import Timer

# How long what is not urgent waits at most, beside one period of an urgent timer [s].
LONGEST_WAIT = 0.01


class CycleExecutor(SingleThreadedExecutor):
    """Looks at what is urgent always, and at the rest every now and then.

    Each time that rclpy waits, it builds a list of all that it waits for, anew and in Python; at
    1 kHz each timer, service or event handler in it takes about 3 % of a core. A node has some
    twenty of them, most of which are rclpy's own and hardly ever ready.
    """

    def __init__(self, urgent: Iterable[Any], *, context: Context | None = None) -> None:
        """Look at the timers, subscriptions and services of ``urgent`` always."""
        super().__init__(context=context)
        self._urgent = frozenset(urgent)
        # A timer ends each wait anyway, and so do others if all are waited for.
        has_timer = any(isinstance(entity, Timer) for entity in self._urgent)
        self._timeout = None if has_timer else LONGEST_WAIT
        self._next_look = 0.0
        self._is_looking = True

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Run one callback; return without one when it is time to look at the rest."""
        self._is_looking = time.monotonic() >= self._next_look
        if timeout_sec is None and not self._is_looking:
            timeout_sec = self._timeout
        super().spin_once(timeout_sec)

    def can_execute(self, entity: Any) -> bool:
        """Tell whether to wait for ``entity`` now."""
        if entity not in self._urgent:
            if not self._is_looking:
                return False
            self._next_look = time.monotonic() + LONGEST_WAIT
        return super().can_execute(entity)
