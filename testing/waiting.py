"""Waiting for a condition, with a bound, where no node has to be spun meanwhile."""

import time
from collections.abc import Callable
from typing import Any

TIMEOUT = 60.0  # s, for what takes a fraction of this unless the computer is very busy


def wait_until(
    condition: Callable[[], Any], what: str | Callable[[], str] = "it", nap: float = 0.001
) -> None:
    """Look at a ``condition`` until it holds, with a ``nap`` [s] between two looks.

    Raises:
        TimeoutError: if it does not hold in time; the text names ``what`` was waited for, or what
            it returns then.
    """
    end = time.monotonic() + TIMEOUT
    while not condition():
        if time.monotonic() > end:
            text = what() if callable(what) else what
            raise TimeoutError(f"waited {TIMEOUT:g} s in vain for {text}")
        time.sleep(nap)
