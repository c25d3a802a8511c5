"""The table of all figures as text."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from benchmarks.harness import Figure, Missing

HEAD = ("what", "ours", "reference", "ratio (5 to 95 %)", "to reach", "reached")
MARKS = {None: "-", True: "yes", False: "NO"}
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


class Row(NamedTuple):
    """What was measured, and what was to be reached.

    Attributes:
        what: in words.
        ours: in words.
        goal: in words; "-" of what is only told.
        is_reached: whether that is so; None without a goal.
    """

    what: str
    ours: str
    goal: str = "-"
    is_reached: bool | None = None

    @classmethod
    def at_most(cls, what: str, ours: float, most: float, form: str = ".3f", unit: str = "") -> Row:
        """Return the row of a number that is to be no larger than ``most``; both in a ``unit``."""
        return cls(what, f"{ours:{form}}{unit}", f"{most:g}{unit}", bool(ours <= most))

    @classmethod
    def in_percent(cls, what: str, part: float, goal: str, is_reached: bool) -> Row:
        """Return the row of a ``part``."""
        return cls(what, f"{100.0 * part:.1f} %", goal, bool(is_reached))


def print_rows(title: str, rows: Iterable[Row], goal: str = "to reach") -> bool:
    """Print a table, and tell of each row as soon as it is measured; it is always complete."""
    lines = [(title, "ours", goal, "reached")]
    for row in rows:
        lines.append((*row[:3], MARKS[row.is_reached]))
        print(f"{row.what}: {row.ours}", file=sys.stderr, flush=True)
    return print_lines(lines)


def print_lines(lines: Sequence[Sequence[str]]) -> bool:
    """Print lines of cells as a table; the first line is the head."""
    print(f"\n{aligned(lines)}", flush=True)
    return True


def in_seconds(time: float) -> str:
    """Return a time [s] as text with three digits and a unit that suits it."""
    size, unit = next((entry for entry in UNITS if time >= entry[0]), UNITS[-1])
    return f"{time / size:.3g} {unit}"


def cells(row: Figure | Missing) -> tuple[str, ...]:
    """Return the texts of one row."""
    if isinstance(row, Missing):
        return (row.what, "-", row.reason, "-", "-", "not measured")
    ratio = row.ratio
    goal = "-" if row.goal is None else f"{row.goal:g}"
    if row.more is not None:
        goal = f"{in_seconds(row.more)} more"
    return (
        row.what,
        in_seconds(row.ours),
        f"{in_seconds(row.theirs)} ({row.reference})",
        f"{ratio.median:.2f} ({ratio.low:.2f} to {ratio.high:.2f})",
        goal,
        MARKS[row.is_reached],
    )


def as_markdown(rows: Iterable[Figure | Missing]) -> str:
    """Return the whole table, readable as it is and as Markdown."""
    return aligned([HEAD, *map(cells, rows)])


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """Return lines of cells as a Markdown table; the first line is the head."""
    widths = [max(map(len, column)) for column in zip(*lines)]
    text = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths)) + " |"
        for line in lines
    ]
    text.insert(1, "|" + "|".join("-" * (width + 2) for width in widths) + "|")
    return "\n".join(text)
