"""Recordings of a swing, and the files that they come in.

A file is a table with a head: the time first, then one to three axes, each with its unit.

    time [s], x [mm], y [mm], z [mm]
    0.000, 0.1203, -0.0311, 0.0007
    0.002, 0.1168, -0.0302, 0.0009

Lines that begin with # are remarks (``tables.py``). A sample with an empty cell is missing.

So are read what two firmwares write of an accelerometer. Klipper (``klippy/extras/adxl345.py``)
has a head that looks like a remark, times in s and values in mm/s^2; RepRapFirmware
(``Accelerometers.cpp``) has numbers of samples, values in g, and the rate in the last line:

    #time,accel_x,accel_y,accel_z          Sample,X,Y,Z
    218.354100,-127.5,83.1,9791.0          0,0.012,-0.008,0.998
                                           Rate 3200, overflows 0

Times may be dates of ISO 8601, and decimals may have commas where semicolons separate the cells.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from tri_glide_kinematics.checks import finite_array, member
from tri_glide_kinematics.errors import KinematicsError, WrongShapeError
from tri_glide_kinematics.files import replace_file
from tri_glide_kinematics.keys import FileError, shortened
from tri_glide_kinematics.tables import Head, Table, TableError, parse_table, table_text
from tri_glide_kinematics.vectors import FloatArray

MOST_AXES = 3  # columns of values beside the time
# Samples that a recording has at least.
LEAST_SAMPLES = 2

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

# The head of Klipper's raw data, and the head and the last line of RepRapFirmware's.
_KLIPPER = re.compile(r"\s*#\s*(time\s*(,\s*accel_[xyz]\s*){1,3})", re.IGNORECASE)
_REPRAP = re.compile(r"\s*sample\s*((?:,\s*[xyz]\s*){1,3})", re.IGNORECASE)
_REPRAP_END = re.compile(r"\s*rate\s+(\d+)\s*,\s*overflows\s+(\d+)\s*", re.IGNORECASE)

_ISO = re.compile(r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)([.,]\d+)?(Z|[+-]\d\d:?\d\d)?")

# Times without a unit are seconds. So many with longer intervals than this [s] would show no mode:
# then they are something else.
LEAST_TIMES = 10
LONGEST_INTERVAL = 0.05


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
        overflows: how often the sensor had more samples than were fetched: some are missing, it is
            not known where, and all later times are too early.
    """

    times: FloatArray
    values: FloatArray
    quantity: Quantity = Quantity.POSITION
    names: tuple[str, ...] = ()
    overflows: int = 0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            WrongShapeError: if the shapes do not fit together, or there are more than three axes.
            NotFiniteError: if a number is NaN or infinite.
            KinematicsError: if there are less than two samples, or times do not ascend.
        """
        times = finite_array("times", self.times, (None,))
        values = finite_array("values", self.values, (None, None))
        if len(times) != len(values) or not 1 <= values.shape[1] <= MOST_AXES:
            expected = f"({len(times)}, 1 to {MOST_AXES})"
            raise WrongShapeError("values", values.shape, expected)
        if len(times) < LEAST_SAMPLES:
            raise KinematicsError(f"{len(times)} samples: a recording has at least {LEAST_SAMPLES}")
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
        return replace(self, times=self.times[kept], values=self.values[kept])


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
        lines = table_text(file).splitlines()
        rate, overflows = _firmware(file, lines)
        _plain_cells(file, lines)
        table = parse_table(file, "\n".join(lines), must_be_ended=False)
        return replace(_recording(table, unit, rate), overflows=overflows)
    except TableError as error:
        raise RecordingFileError(file, error.place, error.reason) from error


def _firmware(file: str | Path, lines: list[str]) -> tuple[float, int]:
    """Give a file of a firmware the head of a table.

    Returns:
        What its times are to be divided by, and how often samples were lost.

    Raises:
        TableError: if it is no recording, or has no rate.
    """
    for place, line in enumerate(lines):
        klipper, reprap = _KLIPPER.fullmatch(line), _REPRAP.fullmatch(line)
        if klipper is not None:
            time, *axes = klipper[1].split(",")
            lines[place] = ",".join([f"{time} [s]", *(f"{axis} [mm/s2]" for axis in axes)])
        elif reprap is not None:
            axes = reprap[1].split(",")[1:]
            lines[place] = ",".join(["sample [s]", *(f"{axis} [g]" for axis in axes)])
            return _rate(file, lines)
        elif line.lstrip(' #"').lower().startswith("freq"):
            reason = "a spectrum over frequencies is no recording: give the raw data of the sensor"
            raise TableError(file, place + 1, 0, reason)
        elif not line.strip() or line.lstrip().startswith("#"):
            continue
        break
    return 1.0, 0


def _rate(file: str | Path, lines: list[str]) -> tuple[float, int]:
    """Take the last line of RepRapFirmware away; return its two numbers.

    Raises:
        TableError: if it is another one.
    """
    last = max(place for place, line in enumerate(lines) if line.strip())
    end = _REPRAP_END.fullmatch(lines[last])
    if end is None or int(end[1]) == 0:
        reason = f"is {shortened(lines[last])}; it must be as 'Rate 3200, overflows 0', or no times"
        raise TableError(file, last + 1, 0, f"{reason} are known: copy or record the file again")
    lines[last] = ""
    return float(end[1]), int(end[2])


def _plain_cells(file: str | Path, lines: list[str]) -> None:
    """Write decimals with a point, and dates as seconds since the first of them.

    Raises:
        TableError: if a comma may be something else, or a date is none.
    """
    rows = [i for i, line in enumerate(lines) if re.match(r'[ "]*[-+.,]?\d', line)]
    sign = next((sign for sign in ";\t," if rows and sign in lines[rows[0]]), None)
    with_comma = [i for i in rows if sign != "," and "," in lines[i]]
    if with_comma:
        cells = [cell.strip(' "') for i in rows for cell in lines[i].split(sign)]
        numbers = [cell for cell in cells if not _ISO.fullmatch(cell)]
        # A comma before three digits may stand between thousands.
        commas = [number for number in numbers if "," in number]
        may_group = all(re.fullmatch(r"[+-]?[1-9]\d*,\d{3}", number) for number in commas)
        if may_group or any("." in number or number.count(",") > 1 for number in numbers):
            seen = shortened(lines[with_comma[0]])
            reason = f"in {seen} a comma may stand between thousands: write decimals with a point"
            raise TableError(file, with_comma[0] + 1, 0, reason)
        for i in with_comma:
            lines[i] = lines[i].replace(",", ".")
    first = None
    for i in rows:
        time, mark, rest = lines[i].partition(sign or "\n")
        date = _ISO.fullmatch(time.strip(' "'))
        if date is None:
            continue
        try:
            now = np.datetime64(date[1] + (date[2] or "").replace(",", ".")[:7], "us")
        except ValueError:
            raise TableError(file, i + 1, 1, f"{shortened(time)} is no time") from None
        first = now if first is None else first
        lines[i] = f"{(now - first) / np.timedelta64(1, 's'):.6f}{mark}{rest}"


def _unit_of(head: Head, column: int) -> str | None:
    """Return the unit in brackets, or the one at the end of a name such as ``time_ms``."""
    _, line, end = head.name.rpartition("_")
    known = TIME_UNITS if column == 0 else UNITS
    return head.unit or (end if end in known and (line or column == 0) else None)


def _recording(table: Table, unit: str | None, rate: float) -> Recording:
    """Return what a table says; its times are divided by the ``rate``.

    Raises:
        TableError: if something in it has no meaning.
    """
    heads, columns = table.heads, table.numbers.shape[1]
    if heads is None or not 2 <= columns <= 1 + MOST_AXES:
        found = f"{columns} columns" if heads else "no head"
        reason = f"{found}; there must be a time and 1 to {MOST_AXES} axes, as in 't [s], x [mm]'"
        raise TableError(table.file, table.head_line or int(table.lines[0]), 0, reason)
    time_unit, *axis_units = map(_unit_of, heads, range(columns))
    units = [time_unit or "s", *(axis_unit or unit for axis_unit in axis_units)]
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
    if len(rows) < LEAST_SAMPLES:
        reason = f"{len(rows)} samples; there must be at least {LEAST_SAMPLES}"
        raise TableError(table.file, 0, 0, reason)
    interval = float(np.median(np.diff(times)))
    if time_unit is None and len(rows) >= LEAST_TIMES and interval > LONGEST_INTERVAL:
        reason = f"has no unit, and intervals of {interval:.5g} are no seconds of a swing"
        raise TableError(
            table.file, table.head_line, 1, f"{reason}: write the unit, as in 't [ms]'"
        )
    numbers = numbers * [TIME_UNITS[time_unit or "s"] / rate, *(scale for _, scale in axes)]
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
