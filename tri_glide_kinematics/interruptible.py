"""Computations that can be interrupted: generators that yield wherever others may have a turn.

A search for a plan takes milliseconds, a control cycle has one. So everything that may take long
yields now and then: a control loop goes on with it while there is time left in the cycle, and
whoever has no cycle to keep has it done ``at_once``.
"""

from __future__ import annotations

import itertools
from collections.abc import Generator, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

# So many rows of an array are copied between two breaks.
ROWS = 10_000

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


def concatenated(arrays: Sequence[NDArray[Any]]) -> Interruptible[NDArray[Any]]:
    """Return arrays one after the other, as numpy does; all have the type of the first one."""
    made = np.empty((sum(map(len, arrays)), *arrays[0].shape[1:]), arrays[0].dtype)
    done, since = 0, 0
    for array in arrays:
        for first in range(0, len(array), ROWS):
            some = array[first : first + ROWS]
            made[done : done + len(some)] = some
            done += len(some)
            since += len(some)
            if since >= ROWS:
                since = 0
                yield
    return made


def picked(array: NDArray[Any], indices: NDArray[np.intp]) -> Interruptible[NDArray[Any]]:
    """Return the rows of an ``array`` with these ``indices``. Shape of them and of a row."""
    made = np.empty((len(indices), *array.shape[1:]), array.dtype)
    for first in range(0, len(indices), ROWS):
        made[first : first + ROWS] = array[indices[first : first + ROWS]]
        yield
    return made


def sorting(values: NDArray[Any], bounds: NDArray[Any]) -> Interruptible[NDArray[np.intp]]:
    """Return the indices that sort ``values``, equal ones in their order; as numpy's argsort.

    Args:
        values: Shape (n,).
        bounds: ascending; of the values from one to the next, as many as ``ROWS`` at best.
    """
    part = np.empty(len(values), dtype=np.intp)
    ends = np.zeros(len(bounds) + 2, dtype=np.intp)
    for first in range(0, len(values), ROWS):
        some = part[first : first + ROWS]
        some[:] = np.searchsorted(bounds, values[first : first + ROWS], "right")
        ends[1:] += np.bincount(some, minlength=len(bounds) + 1)
        yield
    ends = np.cumsum(ends)
    order = np.empty(len(values), dtype=np.intp)
    filled = ends[:-1].copy()
    for first in range(0, len(values), ROWS):
        some = part[first : first + ROWS]
        together = np.argsort(some, kind="stable")
        counts = np.bincount(some, minlength=len(filled))
        # The place of each is that of the first of its part, and how many of the part are before.
        heads = filled - (np.cumsum(counts) - counts)
        order[heads[some[together]] + np.arange(len(some))] = first + together
        filled += counts
        yield
    for begin, end in itertools.pairwise(ends.tolist()):
        some = order[begin:end]
        some[:] = some[np.argsort(values[some], kind="stable")]
        yield
    return order
