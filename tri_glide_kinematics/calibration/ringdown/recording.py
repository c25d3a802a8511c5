"""Recordings of a swing, and the files that they come in.

A file is a table with a head: the time first, then one to three axes, each with its unit.

    time [s], x [mm], y [mm], z [mm]
    0.000, 0.1203, -0.0311, 0.0007
    0.002, 0.1168, -0.0302, 0.0009

Lines that begin with # are remarks. A line without a number for each column is a mistake, but for
empty cells: such a sample is missing.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from pathlib import Path

import numpy as np

from tri_glide_kinematics.checks import LARGEST, finite_array, member
from tri_glide_kinematics.errors import KinematicsError, WrongShapeError
from tri_glide_kinematics.files import replace_file
from tri_glide_kinematics.keys import FileError, shortened
from tri_glide_kinematics.vectors import FloatArray

MOST_AXES = 3
LEAST_SAMPLES = 2

# More would take longer than anybody waits: 200 s at 1 kHz.
MOST_SAMPLES = 200_000

STANDARD_GRAVITY = 9.80665


class Quantity(Enum):
    """What is measured: its unit in SI."""

    POSITION = "m"
    ACCELERATION = "m/s2"


# Units of times in [s], and of values in their unit in SI.
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
UNITS = {
    "m": (Quantity.POSITION, 1.0),
    "mm": (Quantity.POSITION, 1e-3),
    "um": (Quantity.POSITION, 1e-6),
    "µm": (Quantity.POSITION, 1e-6),
    "m/s2": (Quantity.ACCELERATION, 1.0),
    "m/s^2": (Quantity.ACCELERATION, 1.0),
    "mm/s2": (Quantity.ACCELERATION, 1e-3),
    "g": (Quantity.ACCELERATION, STANDARD_GRAVITY),
    "mg": (Quantity.ACCELERATION, 1e-3 * STANDARD_GRAVITY),
}

# A name, and a unit in square or round brackets.
_HEAD = re.compile(r"\s*(?P<name>[^\[\]()]*?)\s*(?:[\[(]\s*(?P<unit>[^\[\]()]*?)\s*[\])])?\s*")


class RecordingFileError(FileError):
    """A file of a recording cannot be read, or something in it has no meaning."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A swing as it was measured.

    Attributes:
        times: ascending; the intervals may differ. Shape (n,) [s].
        values: positions or accelerations along one to three axes. Shape (n, axes) [m or m/s^2].
        quantity: which of the two.
        names: of the axes. Shape (axes,).
    """

    times: FloatArray
    values: FloatArray
    quantity: Quantity = Quantity.POSITION
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            WrongShapeError: if the shapes do not fit together, or there are more than three axes.
            NotFiniteError: if a number is NaN or infinite.
            KinematicsError: if there are less than two samples or more than 200,000, or times do
                not ascend.
        """
        times = finite_array("times", self.times, (None,))
        values = finite_array("values", self.values, (None, None))
        if len(times) != len(values) or not 1 <= values.shape[1] <= MOST_AXES:
            expected = f"({len(times)}, 1 to {MOST_AXES})"
            raise WrongShapeError("values", values.shape, expected)
        if not LEAST_SAMPLES <= len(times) <= MOST_SAMPLES:
            bounds = f"{LEAST_SAMPLES} to {MOST_SAMPLES}"
            raise KinematicsError(f"{len(times)} samples: a recording has {bounds}")
        wrong = np.flatnonzero(np.diff(times) <= 0.0)
        if wrong.size:
            place = int(wrong[0]) + 1
            now, before = times[place], times[place - 1]
            raise KinematicsError(
                f"times[{place}] = {now:.9g} s must be greater than the one before, {before:.9g} s"
            )
        member("quantity", self.quantity, Quantity)
        names = self.names or tuple("xyz"[: values.shape[1]])
        if len(names) != values.shape[1]:
            raise WrongShapeError("names", (len(names),), f"({values.shape[1]},)")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "names", tuple(names))

    def between(self, first: float, last: float) -> Recording:
        """Return the part from one time to another [s].

        Raises:
            KinematicsError: if it has less than two samples.
        """
        kept = (self.times >= first) & (self.times <= last)
        if np.count_nonzero(kept) < LEAST_SAMPLES:
            start, end = self.times[0], self.times[-1]
            raise KinematicsError(
                f"from {first:.9g} to {last:.9g} s there are {np.count_nonzero(kept)} samples; the "
                f"recording is from {start:.9g} to {end:.9g} s"
            )
        return Recording(self.times[kept], self.values[kept], self.quantity, self.names)


def load_recording(file: str | Path, unit: str | None = None) -> Recording:
    """Read a file.

    Args:
        file: a table, as in the text of this module.
        unit: of all axes whose heads have none; one of ``UNITS``.

    Raises:
        RecordingFileError: if it cannot be read, or something in it has no meaning; the text names
            file, line, column and number.
    """
    try:
        text = Path(file).read_text(encoding="utf-8-sig")
    except OSError as error:
        reason = f"cannot be read: {error.strerror or error}"
        raise RecordingFileError(file, "", reason) from error
    except UnicodeDecodeError as error:
        raise RecordingFileError(file, "", f"is no text in UTF-8: {error.reason}") from error
    return _Table(file, text).recording(unit)


# The first line of a file that is written here: what begins so may be replaced.
WRITTEN = "# Swing of a machine behind a motion. The command ringdown reads it."


def save_recording(file: Path, recording: Recording, remark: str = "") -> None:
    """Write a recording, with times from its first sample on; an older file becomes ``NAME.bak``.

    Args:
        file: where.
        recording: what was measured.
        remark: a line about it; empty for none.

    Raises:
        RecordingFileError: if it cannot be written, or one is there that was not written so.
    """
    unit = recording.quantity.value
    heads = ["time [s]", *(f"{name} [{unit}]" for name in recording.names)]
    rows = np.column_stack((recording.times - recording.times[0], recording.values))
    lines = [
        WRITTEN,
        *([f"# {remark}"] if remark else []),
        ", ".join(heads),
        *(", ".join([f"{row[0]:.7f}", *(f"{value:.9g}" for value in row[1:])]) for row in rows),
    ]
    try:
        replace_file(file, "\n".join(lines) + "\n")
    except OSError as error:
        reason = f"cannot be written: {error.strerror or error}"
        raise RecordingFileError(file, "", reason) from error


class _Table:
    """The lines of one file."""

    def __init__(self, file: str | Path, text: str) -> None:
        self._file = file
        lines = [
            (number, line)
            for number, line in enumerate(text.splitlines(), 1)
            if line.strip() and not line.lstrip().startswith("#")
        ]
        if not lines:
            raise RecordingFileError(file, "", "is empty")
        self._numbers = [number for number, _ in lines]
        # Of a semicolon the comma is the decimal separator of a language: it is not guessed.
        delimiter = next((sign for sign in ",;\t" if sign in lines[0][1]), ",")
        try:
            self._rows = list(csv.reader((line for _, line in lines), delimiter=delimiter))
        except csv.Error as error:
            # A cell that is too long; before Python 3.11, a NUL, too.
            raise RecordingFileError(file, "", f"is no table: {error}") from error

    def recording(self, unit: str | None) -> Recording:
        heads = [self._head(column, text) for column, text in enumerate(self._rows[0])]
        if not 2 <= len(heads) <= 1 + MOST_AXES:
            reason = f"{len(heads)} columns; there must be a time and 1 to {MOST_AXES} axes"
            raise self._error(0, None, reason)
        self._names = [name for name, _ in heads]
        second = self._time_unit(heads[0][1])
        units = [self._unit(column, given or unit) for column, (_, given) in enumerate(heads[1:])]
        quantities = {quantity for quantity, _ in units}
        if len(quantities) > 1:
            raise self._error(0, None, "positions and accelerations in one file")
        rows = [self._sample(place) for place in range(1, len(self._rows))]
        kept = [(place, row) for place, row in enumerate(rows, 1) if row is not None]
        for (_, before), (place, row) in pairwise(kept):
            if row[0] <= before[0]:
                reason = f"{row[0]:.9g} must be greater than the one before, {before[0]:.9g}"
                raise self._error(place, 0, reason)
        if not LEAST_SAMPLES <= len(kept) <= MOST_SAMPLES:
            reason = f"{len(kept)} samples; there must be {LEAST_SAMPLES} to {MOST_SAMPLES}"
            raise RecordingFileError(self._file, "", reason)
        table = np.array([row for _, row in kept]) * [second, *(scale for _, scale in units)]
        return Recording(table[:, 0], table[:, 1:], quantities.pop(), tuple(self._names[1:]))

    def _head(self, column: int, text: str) -> tuple[str, str | None]:
        match = _HEAD.fullmatch(text)
        if match is None or not match["name"]:
            raise self._error(0, None, f"column {column + 1}: {shortened(text)} is no head")
        if _is_number(match["name"]):
            reason = f"column {column + 1}: {shortened(text)} is a number, where a head must be"
            raise self._error(0, None, reason)
        return match["name"], match["unit"]

    def _time_unit(self, unit: str | None) -> float:
        if unit not in (None, *TIME_UNITS):
            raise self._unknown(0, unit, TIME_UNITS)
        return 1.0 if unit is None else TIME_UNITS[unit]

    def _unit(self, axis: int, unit: str | None) -> tuple[Quantity, float]:
        if unit is None:
            reason = f"has no unit, as in 'x [mm]'; it is one of: {', '.join(UNITS)}"
            raise self._error(0, axis + 1, reason)
        if unit not in UNITS:
            raise self._unknown(axis + 1, unit, UNITS)
        return UNITS[unit]

    def _unknown(self, column: int, unit: str | None, known: Iterable[str]) -> RecordingFileError:
        reason = f"{shortened(unit)} is no unit; it must be one of: {', '.join(known)}"
        return self._error(0, column, reason)

    def _sample(self, place: int) -> list[float] | None:
        """Return the numbers of a line; None if a cell is empty."""
        cells = [cell.strip() for cell in self._rows[place]]
        if len(cells) != len(self._names):
            reason = f"{len(cells)} cells, but the head has {len(self._names)}"
            raise self._error(place, None, reason)
        for column, cell in enumerate(cells):
            if cell and not _is_number(cell):
                raise self._error(place, column, f"{shortened(cell)} is not a number")
            if cell and not abs(float(cell)) <= LARGEST:
                raise self._error(place, column, f"{cell} is not a finite number")
        return [float(cell) for cell in cells] if all(cells) else None

    def _error(self, place: int, column: int | None, reason: str) -> RecordingFileError:
        where = f"line {self._numbers[place]}"
        if column is not None:
            where += f", column {shortened(self._names[column])}"
        return RecordingFileError(self._file, where, reason)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
