"""How long the pieces of a computation take that can be interrupted."""

from __future__ import annotations

import time
from typing import TypeVar

from tri_glide_kinematics.interruptible import Interruptible

Result = TypeVar("Result")


def median_piece(computation: Interruptible[Result]) -> tuple[Result, float]:
    """Return the result, and the median of the processor time of the pieces [s]."""
    pieces = []
    begin = time.process_time()
    while True:
        try:
            next(computation)
        except StopIteration as end:
            pieces.append(time.process_time() - begin)
            result: Result = end.value
            return result, sorted(pieces)[len(pieces) // 2]
        pieces.append(time.process_time() - begin)
        begin = time.process_time()
