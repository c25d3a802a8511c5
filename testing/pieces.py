"""How long the pieces of a computation take that can be interrupted."""

import time
from typing import TypeVar

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible

Result = TypeVar("Result")


def timed(computation: Interruptible[Result], pieces: list[float]) -> Interruptible[Result]:
    """Return what a ``computation`` does; its ``pieces`` get the processor time of each [s].

    An error that is thrown into it, as where it is given up, reaches the ``computation``.
    """
    thrown: KinematicsError | None = None
    while True:
        begin = time.thread_time()
        try:
            next(computation) if thrown is None else computation.throw(thrown)
        except StopIteration as end:
            result: Result = end.value
            return result
        finally:
            pieces.append(time.thread_time() - begin)
        thrown = None
        try:
            yield
        except KinematicsError as error:
            thrown = error
