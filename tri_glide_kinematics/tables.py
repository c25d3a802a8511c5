"""Tables of numbers in text files: one row a line, and a head that may name columns and units.

    x [mm], y [mm], z [mm]
    10.0, 0.0, 250.0
    20.0, 0.0, 250.0

Cells are separated by commas, semicolons, tabs or spaces. Lines that begin with # are remarks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.checks import LARGEST
from tri_glide_kinematics.keys import FileError, load_text, shortened
from tri_glide_kinematics.vectors import FloatArray

NOT_FINITE = "is not a finite number"

# A name, and a unit in square or round brackets.
_HEAD = re.compile(r"\s*(?P<name>[^\[\]()]*?)\s*(?:[\[(]\s*(?P<unit>[^\[\]()]*?)\s*[\])])?\s*")


class TableError(FileError):
    """A table cannot be read, or a cell of it has no meaning.

    Attributes:
        line: its number, from 1; 0 if it is about the whole file.
        column: number of the column, from 1; 0 if it is about the whole line.
    """

    def __init__(self, file: str | Path, line: int, column: int, reason: str) -> None:
        """Store where it is and the ``reason``, which says what would help."""
        counted = (("line", line), ("column", column))
        place = ", ".join(f"{name} {number}" for name, number in counted if number)
        super().__init__(file, place, reason)
        self.line = line
        self.column = column


class Head(NamedTuple):
    """The head of a column.

    Attributes:
        name: in small letters.
        unit: as it is written; None without one.
    """

    name: str
    unit: str | None


@dataclass(frozen=True, eq=False)
class Table:
    """The numbers of a file.

    Attributes:
        file: where it is from.
        heads: of the columns; None if the file has none.
        head_line: the line that they stand on; 0 without.
        lines: of the rows, from 1. Shape (n,).
        numbers: NaN where a cell is empty. Shape (n, columns).
        steps: what the last digit of the numbers stands for, by column. Shape (columns,).
    """

    file: str
    heads: tuple[Head, ...] | None
    head_line: int
    lines: NDArray[np.int64]
    numbers: FloatArray
    steps: FloatArray

    def error(self, row: int, column: int, reason: str) -> TableError:
        """Return the error about a cell."""
        return TableError(self.file, int(self.lines[row]), column + 1, reason)


def read_table(
    file: str | Path, *, may_be_endless: bool = False, must_be_ended: bool = True
) -> Table:
    """Read a table.

    Args:
        file: its path.
        may_be_endless: whether cells may be NaN or infinite, as numbers that were recorded.
        must_be_ended: whether the last line must have an end, without which it may be cut off.

    Raises:
        TableError: if it cannot be read, has no row, or its last row no end; or a cell is no
            number, or is NaN or infinite and may not be.
    """
    return parse_table(
        file, table_text(file), may_be_endless=may_be_endless, must_be_ended=must_be_ended
    )


def table_text(file: str | Path) -> str:
    """Return the text of a file, in whichever encoding.

    Raises:
        TableError: if it cannot be read.
    """
    return load_text(file, lambda file, _, reason: TableError(file, 0, 0, reason))


def parse_table(
    file: str | Path, text: str, *, may_be_endless: bool = False, must_be_ended: bool = True
) -> Table:
    """Read the ``text`` of a ``file`` as ``read_table`` does."""
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise TableError(file, 0, 0, "is empty")
    is_ended = lines[-1][0] < len(text.splitlines()) or text.endswith("\n")
    if must_be_ended and not is_ended:
        reason = "this last line has no end, so it may be cut off: if it is whole, end the line"
        raise TableError(file, lines[-1][0], 0, reason)
    delimiter = next((sign for sign in ";,\t" if sign in lines[0][1]), None)
    first = _cells(lines[0][1], delimiter)
    heads, head_line = None, 0
    if not any(map(_is_number, first)):
        heads, head_line = _heads(file, lines[0][0], first), lines[0][0]
        del lines[0]
    if not lines:
        raise TableError(file, 0, 0, "has a head and no row")
    digits = [0] * len(first)
    rows = []
    for number, line in lines:
        cells = _cells(line, delimiter)
        if len(cells) != len(first):
            reason = f"has {len(cells)} cells, and the first line has {len(first)}"
            raise TableError(file, number, 0, reason)
        rows.append(_numbers(file, number, cells, may_be_endless))
        digits = list(map(max, digits, map(_digits, cells)))
    steps = np.array([10.0**-count for count in digits])
    return Table(
        str(file),
        heads,
        head_line,
        np.array([number for number, _ in lines]),
        np.array(rows),
        steps,
    )


def _cells(line: str, delimiter: str | None) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def _heads(file: str | Path, line: int, cells: Sequence[str]) -> tuple[Head, ...]:
    heads = []
    for column, cell in enumerate(cells, 1):
        match = _HEAD.fullmatch(cell)
        if match is None or not match["name"]:
            reason = f"{shortened(cell)} is no head; one is for instance 'x [mm]'"
            raise TableError(file, line, column, reason)
        heads.append(Head(match["name"].lower(), match["unit"]))
        if heads[-1].name in (head.name for head in heads[:-1]):
            raise TableError(file, line, column, f"{heads[-1].name} stands twice in the head")
    return tuple(heads)


def _numbers(
    file: str | Path, line: int, cells: Sequence[str], may_be_endless: bool
) -> list[float]:
    numbers = []
    for column, cell in enumerate(cells, 1):
        try:
            number = float(cell) if cell else math.nan
        except ValueError:
            help_text = "; write decimals with a point" if "," in cell else ""
            reason = f"{shortened(cell)} is not a number{help_text}"
            raise TableError(file, line, column, reason) from None
        if cell and not may_be_endless and not abs(number) <= LARGEST:
            is_known = math.isfinite(number)
            reason = f"must be at most {LARGEST:g} in absolute value" if is_known else NOT_FINITE
            raise TableError(file, line, column, f"{shortened(float(cell))} {reason}")
        numbers.append(number)
    return numbers


def _digits(cell: str) -> int:
    """Return how many digits behind the decimal point a number has."""
    _, point, rest = cell.partition(".")
    if point and rest.isdecimal():
        return len(rest)
    exponent = Decimal(cell).as_tuple().exponent if cell else 0
    return -exponent if isinstance(exponent, int) else 0


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
