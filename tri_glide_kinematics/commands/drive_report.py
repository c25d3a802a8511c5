"""What the command ``drive`` prints: its progress, and a table of what became of each step."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TextIO

from tri_glide_kinematics.programs import StepReport, in_millimetres

# Back to the start of the line, and nothing of what stood there.
ANEW = "\r\033[K"


class ProgressLine:
    """Says what is being done: on a terminal in one line, elsewhere in a line for each step."""

    def __init__(self, output: TextIO | None = None) -> None:
        """Write to ``output``; by default to what is the standard output then."""
        self._output = output or sys.stdout
        self._is_terminal = self._output.isatty()
        self._is_open = False

    def say(self, text: str) -> None:
        """Write a line that stays."""
        self._write(f"{ANEW if self._is_open else ''}drive: {text}\n")
        self._is_open = False

    def clear(self) -> None:
        """Remove the line that does not stay."""
        if self._is_open:
            self._write(ANEW)
            self._is_open = False

    def show(self, text: str) -> None:
        """Write a line in place of the last one; nothing where that is not possible."""
        if self._is_terminal:
            self._write(f"{ANEW}drive: {text}")
            self._is_open = True

    def _write(self, text: str) -> None:
        self._output.write(text)
        self._output.flush()


def table(reports: Sequence[StepReport]) -> str:
    """Return one line for each step: its number, or for one of a program the line that says it."""
    lines = [report.step.line_at() for report in reports]
    head = ("line" if any(lines) else "step", "", "result", "time", "length", "mean speed")
    numbers = [line or number for number, line in enumerate(lines, 1)]
    rows = [(*head, "largest deviation"), *map(_row, numbers, reports)]
    return "\n".join(
        f"{number:>4}  {kind:6}  {result:11}{time:>10}{length:>13}{speed:>14}{deviation:>19}"
        for number, kind, result, time, length, speed, deviation in rows
    )


def _row(number: int, report: StepReport) -> tuple[str, ...]:
    speed = report.length / report.time if report.length and report.time else None
    return (
        str(number),
        report.step.word,
        report.result,
        "-" if report.time is None else f"{report.time:.2f} s",
        in_millimetres(report.length, 1),
        in_millimetres(speed, 1, "mm/s"),
        in_millimetres(report.deviation, 3),
    )
