"""Spins a node with a fast cycle, in which it looks only at what is urgent."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.timer import Timer

# How long what is not urgent waits at most, beside the callbacks that are due [s].
LONGEST_WAIT = 0.01


class CycleExecutor(SingleThreadedExecutor):
    """Looks at what is urgent always, and at all else every now and then.

    Each time that rclpy waits, it builds a list of all that it waits for, anew and in Python; at
    1 kHz each timer, service or event handler in it takes about 3 % of a core. A node has some
    twenty of them, most of which are rclpy's own and hardly ever ready.
    """

    def __init__(self, urgent: Iterable[Any], *, context: Context | None = None) -> None:
        """Look at the timers, subscriptions and services of ``urgent`` always."""
        super().__init__(context=context)
        self._urgent = frozenset(urgent)
        # A fast timer ends each wait anyway.
        timers = [entity for entity in self._urgent if isinstance(entity, Timer)]
        is_fast = any(timer.timer_period_ns <= 1e9 * LONGEST_WAIT for timer in timers)
        self._timeout = None if is_fast else LONGEST_WAIT
        self._next_look = 0.0
        self._is_looking = True

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Run one callback, or none if it is time to look at all else."""
        self._is_looking = time.monotonic() >= self._next_look
        # With another timeout than the time before, rclpy forgets what else was ready.
        super().spin_once(self._timeout if timeout_sec is None else timeout_sec)

    def can_execute(self, entity: Any) -> bool:
        """Tell whether to wait for ``entity`` now."""
        if entity not in self._urgent:
            if not self._is_looking:
                return False
            self._next_look = time.monotonic() + LONGEST_WAIT
        return super().can_execute(entity)
