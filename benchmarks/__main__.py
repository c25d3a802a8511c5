"""``python -m benchmarks [names...]``: measure, and print one table."""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module

from benchmarks.harness import Figure, Missing, NoAnswerError
from benchmarks.machine import description
from benchmarks.table import as_markdown

FIGURES = (
    "tri_glide",
    "mechanisms",
    "motion",
    "cycle",
    "latency",
    "services",
    "start",
    "transport",
    "drives",
)
TABLES = (
    "tracking",
    "smoothness",
    "calm",
    "stops",
    "moves",
    "paths",
    "forces",
    "goals",
    "streams",
    "panel",
    "pick",
)
CALLS = "cycle_calls"
GROWTH = "growth"
NAMES = (*FIGURES, *TABLES, CALLS, GROWTH)


def main() -> int:
    """Run the benchmarks that were asked for; what was measured before an error is printed too.

    Returns:
        Exit code: 1 if nodes did not answer, so that a row is missing.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=f"of {', '.join(NAMES)}; all")
    names = parser.parse_args().names or NAMES
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        parser.error(f"there is no {unknown[0]!r}: the names are {', '.join(NAMES)}")
    print(description(), flush=True)
    rows: list[Figure | Missing] = []
    try:
        measure([name for name in FIGURES if name in names], rows)
    finally:
        if rows:
            print(f"\n{as_markdown(rows)}", flush=True)
    missing = [row for row in rows if isinstance(row, Missing) and row.is_failure]
    for row in missing:
        print(f"\nno answer: {row.what}: {row.reason}", file=sys.stderr, flush=True)
    complete = not missing
    for name in names:
        if name not in FIGURES:
            complete = table(name) and complete
    return 0 if complete else 1


def table(name: str) -> bool:
    """Measure and print a table; return whether it is complete."""
    module = name if name in (CALLS, GROWTH) else f"bench_{name}"
    try:
        complete: bool = import_module(f"benchmarks.{module}").run()
    except (NoAnswerError, TimeoutError) as error:
        print(f"\nno answer: {name}: {error}", file=sys.stderr, flush=True)
        return False
    return complete


def measure(names: Sequence[str], rows: list[Figure | Missing]) -> None:
    """Append one row after the other, and tell of it, as this takes minutes."""
    begin = time.monotonic()
    for name in names:
        figures: Callable[[], Iterator[Figure | Missing]]
        figures = import_module(f"benchmarks.bench_{name}").figures
        for row in figures():
            rows.append(row)
            print(f"{time.monotonic() - begin:5.0f} s  {row.what}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
