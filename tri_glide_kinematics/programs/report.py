"""The output of a drive."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TextIO

from tri_glide_kinematics.programs.drive_file import MoveStep, PathStep, Step, WaitStep

MILLIMETRES = 1000.0
KINDS = {MoveStep: "move", PathStep: "path", WaitStep: "wait"}

# Back to the begin of the line, and nothing of what stood there.
ANEW = "\r\033[K"


@dataclass(frozen=True)
class StepReport:
    """The result of a step.

    Attributes:
        step: that it is about.
        result: in a word or two.
        is_good: whether the next step may begin.
        time: that it took [s]; None if it was not driven.
        length: of the way [m]; None if there is none, or it is not known.
        deviation: largest distance from the path as programmed [m]; None if there is none, or if
            nothing of it was driven.
        text: the whole reason of the result; empty if there is nothing to say.
    """

    step: Step
    result: str
    is_good: bool = False
    time: float | None = None
    length: float | None = None
    deviation: float | None = None
    text: str = ""


NOT_DRIVEN = "not driven"


class ProgressLine:
    """Says what is being done: on a terminal in one line, elsewhere in a line for each step."""

    def __init__(self, output: TextIO = sys.stdout) -> None:
        """Write to ``output``."""
        self._output = output
        self._is_terminal = output.isatty()
        self._is_open = False

    def say(self, text: str) -> None:
        """Write a line that stays."""
        self._write(f"{ANEW if self._is_open else ''}drive: {text}\n")
        self._is_open = False

    def show(self, text: str) -> None:
        """Write a line in place of the last one; nothing where that is not possible."""
        if self._is_terminal:
            self._write(f"{ANEW}drive: {text}")
            self._is_open = True

    def _write(self, text: str) -> None:
        self._output.write(text)
        self._output.flush()


def is_whole(reports: Sequence[StepReport]) -> bool:
    """Return whether all steps have been driven as they should."""
    return all(report.is_good for report in reports)


def table(reports: Sequence[StepReport]) -> str:
    """Return one line for each step."""
    head = ("step", "", "result", "time", "length", "mean speed", "largest deviation")
    rows = [head, *(_row(*numbered) for numbered in enumerate(reports, 1))]
    return "\n".join(
        f"{number:>4}  {kind:4}  {result:11}{time:>10}{length:>13}{speed:>14}{deviation:>19}"
        for number, kind, result, time, length, speed, deviation in rows
    )


def _row(number: int, report: StepReport) -> tuple[str, ...]:
    speed = report.length / report.time if report.length and report.time else None
    return (
        str(number),
        KINDS[type(report.step)],
        report.result,
        "-" if report.time is None else f"{report.time:.2f} s",
        in_millimetres(report.length, 1),
        in_millimetres(speed, 1, "mm/s"),
        in_millimetres(report.deviation, 3),
    )


def in_millimetres(value: float | None, digits: int, unit: str = "mm") -> str:
    """Return a length [m] or a speed [m/s] as text; a dash for none."""
    return "-" if value is None else f"{MILLIMETRES * value:.{digits}f} {unit}"
