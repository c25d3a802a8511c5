"""How long the pieces of a computation take that can be interrupted."""

from __future__ import annotations

import time
from typing import TypeVar

from tri_glide_kinematics.interruptible import Interruptible, at_once

Result = TypeVar("Result")


def timed(computation: Interruptible[Result], pieces: list[float]) -> Interruptible[Result]:
    """Return what a ``computation`` does; its ``pieces`` get the processor time of each [s]."""
    while True:
        begin = time.thread_time()
        try:
            next(computation)
        except StopIteration as end:
            result: Result = end.value
            return result
        finally:
            pieces.append(time.thread_time() - begin)
        yield


def median_piece(computation: Interruptible[Result]) -> tuple[Result, float]:
    """Return the result, and the median of the processor time of the pieces [s]."""
    pieces: list[float] = []
    result = at_once(timed(computation, pieces))
    return result, sorted(pieces)[len(pieces) // 2]
