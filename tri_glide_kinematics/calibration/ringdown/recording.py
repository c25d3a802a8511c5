"""Recordings of a swing, and the files that they come in.

A file is a table with a head: the time first, then one to three axes, each with its unit.

    time [s], x [mm], y [mm], z [mm]
    0.000, 0.1203, -0.0311, 0.0007
    0.002, 0.1168, -0.0302, 0.0009

Lines that begin with # are remarks (``tables.py``). A sample with an empty cell is missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from tri_glide_kinematics.checks import finite_array, member
from tri_glide_kinematics.errors import KinematicsError, WrongShapeError
from tri_glide_kinematics.files import replace_file
from tri_glide_kinematics.keys import FileError
from tri_glide_kinematics.tables import Table, TableError, read_table
from tri_glide_kinematics.vectors import FloatArray

MOST_AXES = 3  # columns of values beside the time
# Samples that a recording has at least.
LEAST_SAMPLES = 2

# More would take longer than anybody waits: 200 s at 1 kHz.
MOST_SAMPLES = 200_000

STANDARD_GRAVITY = 9.80665  # m/s^2


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
        return _recording(read_table(file, must_be_ended=False), unit)
    except TableError as error:
        raise RecordingFileError(file, error.place, error.reason) from error


def _recording(table: Table, unit: str | None) -> Recording:
    """Return what a table says.

    Raises:
        TableError: if something in it has no meaning.
    """
    heads, columns = table.heads, table.numbers.shape[1]
    if heads is None or not 2 <= columns <= 1 + MOST_AXES:
        found = f"{columns} columns" if heads else "no head"
        reason = f"{found}; there must be a time and 1 to {MOST_AXES} axes, as in 't [s], x [mm]'"
        raise TableError(table.file, table.head_line or int(table.lines[0]), 0, reason)
    units = [heads[0].unit or "s", *(head.unit or unit for head in heads[1:])]
    choices = (tuple(TIME_UNITS), *[tuple(UNITS)] * MOST_AXES)
    for column, (known, given) in enumerate(zip(choices, units), 1):
        if given not in known:
            choice = f"it must be one of: {', '.join(known)}"
            what = "has no unit, as in 'x [mm]'" if given is None else f"{given!r} is no unit"
            raise TableError(table.file, table.head_line, column, f"{what}; {choice}")
    axes = [UNITS[given] for given in units[1:] if given]
    quantities = {quantity for quantity, _ in axes}
    if len(quantities) > 1:
        reason = "positions and accelerations in one file"
        raise TableError(table.file, table.head_line, 0, reason)
    rows = np.flatnonzero(np.isfinite(table.numbers).all(axis=1))
    numbers = table.numbers[rows]
    times = numbers[:, 0]
    for place in np.flatnonzero(np.diff(times) <= 0.0)[:1] + 1:
        reason = f"{times[place]:.9g} must be greater than the one before, {times[place - 1]:.9g}"
        raise table.error(rows[place], 0, reason)
    if not LEAST_SAMPLES <= len(rows) <= MOST_SAMPLES:
        reason = f"{len(rows)} samples; there must be {LEAST_SAMPLES} to {MOST_SAMPLES}"
        raise TableError(table.file, 0, 0, reason)
    numbers = numbers * [TIME_UNITS[str(units[0])], *(scale for _, scale in axes)]
    names = tuple(head.name for head in heads[1:])
    return Recording(numbers[:, 0], numbers[:, 1:], quantities.pop(), names)


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
    with RecordingFileError.of_writing(file):
        replace_file(file, "\n".join(lines) + "\n")
