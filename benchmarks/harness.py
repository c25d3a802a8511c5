"""Measures work side by side with a reference: warmed up, interleaved, many rounds.

The computer's speed changes while a benchmark runs (clock rate, other processes). Two pieces of
work that alternate within milliseconds see the same computer, so their ratio can be trusted where
neither time can. Every round gives one ratio; what is told is their median and their spread. Calls
are timed by the processor time of this process, which leaves out what others take from its core.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from time import process_time
from timeit import Timer
from typing import TypeVar

import numpy as np

Value = TypeVar("Value")

ROUNDS = 41
ROUND_TIME = 0.02  # s that each side works in each round, unless one call takes longer
WARM_UP_ROUNDS = 3


@dataclass(frozen=True)
class Ratio:
    """Ours over the reference in many rounds.

    Attributes:
        median: of the rounds.
        low: 5th percentile of the rounds.
        high: 95th percentile of the rounds.
    """

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, ours: Sequence[float], reference: Sequence[float]) -> Ratio:
        """Return the ratio of what was measured in the same rounds."""
        rounds = np.divide(ours, reference)
        low, median, high = np.percentile(rounds, (5.0, 50.0, 95.0))
        return cls(float(median), float(low), float(high))


@dataclass(frozen=True)
class Figure:
    """One row of the table.

    Attributes:
        what: that is measured.
        reference: to which it is compared.
        ours: median of the rounds [s].
        theirs: median of the rounds [s].
        ratio: of the two.
        goal: largest ratio wanted; None for a row that is only told.
        more: largest difference wanted [s], where that is the goal and no ratio.
    """

    what: str
    reference: str
    ours: float
    theirs: float
    ratio: Ratio
    goal: float | None = None
    more: float | None = None

    @property
    def is_reached(self) -> bool | None:
        """Whether the medians are within the goal; None if there is no goal."""
        if self.more is not None:
            return self.ours - self.theirs <= self.more
        return None if self.goal is None else self.ratio.median <= self.goal


@dataclass(frozen=True)
class Missing:
    """A row of the table that could not be measured.

    Attributes:
        what: that was to be measured.
        reason: why it was not.
        is_failure: whether it should have been; false where something optional is not installed.
    """

    what: str
    reason: str
    is_failure: bool = False


class NoAnswerError(Exception):
    """Something that had to happen did not; the text says what, and how the nodes are."""


def attempt(what: str, measure: Callable[[], Value]) -> Value | Missing:
    """Return what is measured for the row ``what``, or why there was no answer."""
    try:
        return measure()
    except NoAnswerError as error:
        return Missing(what, str(error), is_failure=True)


class Work:
    """A call to be repeated, and how many items it deals with."""

    def __init__(self, call: Callable[..., object], *arguments: object, items: int = 1) -> None:
        """Prepare ``call(*arguments)``; times are told per item."""
        names = [f"a{index}" for index in range(len(arguments))]
        # A statement costs nothing beside the call itself, which a wrapping function would.
        self._timer = Timer(
            f"call({', '.join(names)})",
            timer=process_time,
            globals={"call": call, **dict(zip(names, arguments))},
        )
        self._items = items

    def calls_within(self, time: float) -> int:
        """Return how many calls take about ``time`` [s], at least one."""
        number = 1
        while (taken := self._timer.timeit(number)) < 0.25 * time:
            number *= 2
        return max(1, round(number * time / taken))

    def seconds_per_item(self, calls: int) -> float:
        """Do the work ``calls`` times; the collector of garbage is off meanwhile."""
        return self._timer.timeit(calls) / (calls * self._items)


def compare(
    what: str,
    reference: str,
    ours: Work,
    theirs: Work,
    goal: float | None = None,
    rounds: int = ROUNDS,
    round_time: float = ROUND_TIME,
) -> Figure:
    """Measure ``ours`` and ``theirs`` in turn."""
    one, other = (
        partial(work.seconds_per_item, work.calls_within(round_time)) for work in (ours, theirs)
    )
    return figure(what, reference, *in_turn(rounds, one, other, WARM_UP_ROUNDS), goal)


def in_turn(
    rounds: int, ours: Callable[[], Value], theirs: Callable[[], Value], warm_up: int = 1
) -> tuple[list[Value], list[Value]]:
    """Return what both measure in turn; who begins changes, and rounds to warm up do not count."""
    measured: tuple[list[Value], list[Value]] = ([], [])
    for index in range(-warm_up, rounds):
        for side in (0, 1) if index % 2 else (1, 0):
            value = (ours, theirs)[side]()
            if index >= 0:
                measured[side].append(value)
    return measured


def figure(
    what: str,
    reference: str,
    ours: Sequence[float],
    theirs: Sequence[float],
    goal: float | None = None,
) -> Figure:
    """Return the row of times [s] that were taken in the same rounds."""
    return Figure(
        *(what, reference),
        *(float(np.median(ours)), float(np.median(theirs))),
        *(Ratio.of(ours, theirs), goal),
    )


@contextmanager
def pinned_to_one_core() -> Iterator[int]:
    """Keep this process, and what it starts, on one core; that core is given."""
    before = os.sched_getaffinity(0)
    core = max(before)
    os.sched_setaffinity(0, {core})
    try:
        yield core
    finally:
        os.sched_setaffinity(0, before)
