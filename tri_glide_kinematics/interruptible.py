"""Computations that can be interrupted: generators that yield wherever others may have a turn.

A search for a plan takes milliseconds, a control cycle has one. So everything that may take long
yields now and then: a control loop goes on with it while there is time left in the cycle, and
whoever has no cycle to keep has it done ``at_once``.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any, Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

# Number of rows of an array that are copied between two breaks.
ROWS = 10_000

# Number of rows of arrays that are worked on between two breaks: some 20 operations take 0.2 ms.
WORKED_ROWS = 4_000

Owner = TypeVar("Owner")
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


class Kept(Generic[Owner, Result]):
    """Attribute that is worked out once, and then kept.

    Whoever asks for it has it worked out at once; ``in_pieces`` works it out interruptibly. It
    decorates the method that returns the computation.
    """

    def __init__(self, computation: Callable[[Owner], Interruptible[Result]]) -> None:
        """Take what works it out."""
        self._computation = computation
        self._name = computation.__name__
        self.__doc__ = computation.__doc__

    @overload
    def __get__(self, owner: None, kind: type[Owner]) -> Kept[Owner, Result]: ...

    @overload
    def __get__(self, owner: Owner, kind: type[Owner]) -> Result: ...

    def __get__(self, owner: Owner | None, kind: type[Owner]) -> Kept[Owner, Result] | Result:
        """Return what is kept; only called as long as nothing is."""
        return self if owner is None else at_once(self.in_pieces(owner))

    def is_kept(self, owner: Owner) -> bool:
        """Return whether it has been worked out for ``owner``."""
        return self._name in vars(owner)

    def in_pieces(self, owner: Owner) -> Interruptible[Result]:
        """Return it, worked out interruptibly if it has not been yet."""
        kept = vars(owner)
        if self._name not in kept:
            kept[self._name] = yield from self._computation(owner)
        result: Result = kept[self._name]
        return result


def blocks(count: int, rows: int | None = None) -> Iterator[slice]:
    """Yield which of ``count`` rows are worked on together, one block after the other.

    Args:
        count: number of rows.
        rows: of a block; by default ``WORKED_ROWS``.
    """
    step = rows or WORKED_ROWS
    for first in range(0, count, step):
        yield slice(first, min(first + step, count))


def columns_of(
    count: int,
    work: Callable[[slice], Sequence[NDArray[Any]]],
    margin: int = 0,
    spare_zeros: bool = False,
    rows: int | None = None,
) -> Interruptible[list[NDArray[Any]]]:
    """Return columns of ``count`` rows each, worked out block by block.

    Args:
        count: number of rows.
        work: returns these rows of each column.
        margin: how many rows to both sides the result depends on; so many more are worked out with
            each block, and left out.
        spare_zeros: whether a column of zeros alone, of several blocks, is to take no memory; it
            can then not be written to.
        rows: of a block; by default ``WORKED_ROWS``.
    """
    if count <= (rows or WORKED_ROWS):
        columns = list(work(slice(0, count)))
        yield
        return columns
    made: dict[int, NDArray[Any]] = {}
    for some in blocks(count, rows):
        begin = max(some.start - margin, 0)
        parts = work(slice(begin, min(some.stop + margin, count)))
        inner = slice(some.start - begin, some.stop - begin)
        yield
        # One after the other: the system takes 0.3 ms to give 2 MB of fresh memory.
        for number, part in enumerate(parts):
            if number not in made:
                if spare_zeros and not part[inner].any():
                    continue
                made[number] = np.empty((count, *part.shape[1:]), part.dtype)
                for before in blocks(some.start):
                    made[number][before] = 0
                    yield
            made[number][some] = part[inner]
            yield
    zeros = (np.broadcast_to(part.dtype.type(0), (count, *part.shape[1:])) for part in parts)
    return [made.get(number, column) for number, column in enumerate(zeros)]


def column_of(
    count: int,
    work: Callable[[slice], NDArray[Any]],
    margin: int = 0,
    rows: int | None = None,
) -> Interruptible[NDArray[Any]]:
    """Return one column, as ``columns_of`` does."""
    return (yield from columns_of(count, lambda some: (work(some),), margin, rows=rows))[0]


def any_of(work: Callable[..., NDArray[np.bool_]], *arrays: NDArray[Any]) -> Interruptible[bool]:
    """Return whether ``work`` finds a true row in ``arrays`` of one length, block by block."""
    for some in blocks(len(arrays[0])):
        if work(*(array[some] for array in arrays)).any():
            return True
        yield
    return False


def accumulated(operation: np.ufunc, values: NDArray[Any]) -> Interruptible[NDArray[Any]]:
    """Return ``operation.accumulate(values)``. Shape (n,)."""
    made = np.empty_like(values)
    for some in blocks(len(values)):
        part = values[some]
        if some.start:
            part = part.copy()
            part[0] = operation(made[some.start - 1], part[0])
        operation.accumulate(part, out=made[some])
        yield
    return made


def indices_of(mask: NDArray[Any]) -> Interruptible[NDArray[np.intp]]:
    """Return the indices at which a ``mask`` is true or not 0, ascending. Shape (n,)."""
    made, count = np.empty(len(mask), dtype=np.intp), 0
    for some in blocks(len(mask)):
        found = np.flatnonzero(mask[some])
        made[count : count + len(found)] = found + some.start
        count += len(found)
        yield
    return made[:count]


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
    return (yield from column_of(len(indices), lambda some: array[indices[some]]))


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
