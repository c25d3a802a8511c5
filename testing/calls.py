"""Which functions are called: work that is the same on each computer, unlike a time."""

import sys
from collections import Counter
from collections.abc import Callable
from types import FrameType
from typing import Any, TypeVar

from tri_glide_kinematics.interruptible import Interruptible

Result = TypeVar("Result")


def calls(function: Callable[..., Any], *arguments: Any) -> Counter[str]:
    """Return how often each function of Python and C is called in one call of a ``function``."""
    found: Counter[str] = Counter()

    def note(frame: FrameType, event: str, argument: Any) -> None:
        if event == "call":
            found[frame.f_code.co_name] += 1
        elif event == "c_call":
            found[argument.__name__] += 1

    sys.setprofile(note)
    try:
        function(*arguments)
    finally:
        sys.setprofile(None)
    return found


def most_calls_of_a_piece(computation: Interruptible[Result]) -> tuple[Result, int]:
    """Return the result of a computation, and how many calls its largest piece takes."""
    ended: list[Result] = []

    def go_on() -> None:
        try:
            next(computation)
        except StopIteration as end:
            ended.append(end.value)

    most = 0
    while not ended:
        most = max(most, calls(go_on).total())
    return ended[0], most
