"""The table of all figures as text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from benchmarks.harness import Figure, Missing

HEAD = ("what", "ours", "reference", "ratio (5 to 95 %)", "to reach", "reached")
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


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
        {None: "-", True: "yes", False: "NO"}[row.is_reached],
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
