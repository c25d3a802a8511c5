"""How long the pieces of a computation take that can be interrupted."""

from __future__ import annotations

import time
from typing import TypeVar

from tri_glide_kinematics.interruptible import Interruptible

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
