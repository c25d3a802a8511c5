"""Linear moves that begin in mid-motion, against three references; moves_in_motion has more."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import thread_time

import numpy as np

from benchmarks.moves_in_motion import (
    LARGEST_MEDIAN,
    LARGEST_MOST,
    bent,
    best_of_random_ways,
    planned,
    planned_over_optimum,
    random_turns,
)
from benchmarks.table import print_lines

SEED = 1
TURNS = 250
# Random ways take two milliseconds each, so fewer turns have them.
TURNS_WITH_WAYS = 40
WAYS = 300

HEAD = ("a linear move begun in motion", "median", "90 %", "99 %", "largest", "to reach", "reached")
GOAL = f"{LARGEST_MEDIAN:g} in the median, {LARGEST_MOST:g} at 99 %"


def rows() -> Iterator[tuple[str, ...]]:
    """Yield one line of the table after the other."""
    turns = list(random_turns(TURNS, SEED))
    begin = thread_time()
    durations = np.array([planned(turn) for turn in turns])
    cost = (thread_time() - begin) / len(turns)
    yield (f"processor time of its plan, {TURNS}", f"mean {1e3 * cost:.1f} ms", *["-"] * 5)
    yield _row(
        f"time over ruckig's bent way, {TURNS}",
        durations / np.array([bent(turn) for turn in turns]),
        has_goal=False,
    )
    optimal = [ratio for turn in turns if (ratio := planned_over_optimum(turn)) is not None]
    if optimal:
        yield _row(f"time along the new line over copp-py's TOPP3, {len(optimal)}", optimal)
    rng = np.random.default_rng(SEED)
    few = turns[:TURNS_WITH_WAYS]
    best = np.array([best_of_random_ways(turn, WAYS, rng) for turn in few])
    name = f"time over the best of {WAYS} random ways, {len(few)}"
    yield _row(name, durations[: len(few)] / best)


def _row(name: str, ratios: Sequence[float], *, has_goal: bool = True) -> tuple[str, ...]:
    """Return one line of the table."""
    quantiles = np.quantile(ratios, (0.5, 0.9, 0.99, 1.0)).tolist()
    reached = quantiles[0] <= LARGEST_MEDIAN and quantiles[2] <= LARGEST_MOST
    judged = (GOAL, "yes" if reached else "NO") if has_goal else ("-", "-")
    return (name, *(f"{value:.3f}" for value in quantiles), *judged)


def run() -> bool:
    """Measure and print the table; it is always complete."""
    return print_lines([HEAD, *rows()])


if __name__ == "__main__":
    run()
