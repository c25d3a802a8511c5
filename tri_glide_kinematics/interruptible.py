"""Computations that can be interrupted: generators that yield wherever others may have a turn.

A search for a plan takes milliseconds, a control cycle has one. So everything that may take long
yields now and then: a control loop goes on with it while there is time left in the cycle, and
whoever has no cycle to keep has it done ``at_once``.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

Result = TypeVar("Result")

Interruptible = Generator[None, None, Result]


def at_once(computation: Interruptible[Result]) -> Result:
    """Return the result of a ``computation``, without a break; its errors are raised."""
    while True:
        try:
            next(computation)
        except StopIteration as end:
            result: Result = end.value
            return result
