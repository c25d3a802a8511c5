"""Points in a table (CSV) as a program: straight lines from each point to the next, on one path.

    x [mm], y [mm], z [mm], tolerance [mm], speed [mm/s]
    0, 0, 250, 0.5, 100
    40, 0, 250, 0.5, 100

The last two columns may be missing, and so may a cell of theirs. They belong to the line that ends
at the point, the tolerance to its end. Points are positions in the frame of the machine.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.keys import UNITS
from tri_glide_kinematics.motion.path import LARGEST_PLACE as FAR
from tri_glide_kinematics.motion.path import (
    LARGEST_SPEED,
    LEAST_SPEED,
    SHORTEST,
    FlatPath,
    SegmentKind,
)
from tri_glide_kinematics.programs.dialects import MINUTE
from tri_glide_kinematics.programs.program import PathRun, Program, ProgramStop, StopKind
from tri_glide_kinematics.programs.settings import ProgramSettings
from tri_glide_kinematics.programs.words import ProgramError
from tri_glide_kinematics.tables import Head, Table, TableError, read_table
from tri_glide_kinematics.vectors import FloatArray, three

COLUMNS = ("x", "y", "z", "tolerance", "speed")
PLACE = 3  # columns of the position, the first ones

# Units of speeds in [m/s].
SPEED_UNITS = {f"{unit}/s": size for unit, size in UNITS.items()}
SPEED_UNITS |= {f"{unit}/min": size / MINUTE for unit, size in UNITS.items()}


def load_points(
    file: str | Path, settings: ProgramSettings | None = None, unit: str | None = None
) -> Program:
    """Read points and return the program that drives along them.

    Points less than a micrometre from the one before make no line of their own.

    Args:
        file: a table, as in the text of this module; without a head its columns are x, y, z and,
            if there are more, tolerance and speed.
        settings: tolerance, and speed, of the lines that have none; without a feed they are driven
            as fast as the sliders can.
        unit: of the lengths where no head has a unit: ``m`` or ``mm``; speeds are in this per
            second.

    Raises:
        ProgramError: if it cannot be read, or something in it has no meaning; with its line, and
            the number of the cell in it as the column.
    """
    settings = ProgramSettings() if settings is None else settings
    try:
        table = read_table(file)
        points, tolerances, speeds = _columns(table, settings, unit)
    except TableError as error:
        raise ProgramError(file, error.line, error.column, "", error.reason) from error
    kept = [0]
    for row in range(1, len(points)):
        if np.linalg.norm(points[row] - points[kept[-1]]) >= SHORTEST:
            kept.append(row)
    if len(kept) < 2:
        raise ProgramError(file, 0, 0, "", "has one place only; a path needs two")
    ends = np.array(kept[1:])
    kinds = np.full(len(ends), int(SegmentKind.LINE))
    try:
        segments = FlatPath.of(kinds, points[ends].ravel(), tolerances[ends], speeds[ends], 0.0)
    except KinematicsError as error:
        raise ProgramError(file, 0, 0, "", str(error)) from error
    lines = table.lines.astype(np.int32)
    run = PathRun(
        three(points[0].tolist()), segments, lines[ends], np.zeros(len(ends), dtype=np.bool_), ()
    )
    end = ProgramStop(StopKind.END, int(lines[-1]))
    data = Path(file).read_bytes()
    digest = hashlib.sha256(data).hexdigest()
    return Program(str(file), (run, end), (), int(lines[-1]), len(data), digest)


def _columns(
    table: Table, settings: ProgramSettings, unit: str | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points [m], tolerances [m] and speeds [m/s] of all rows."""
    count = table.numbers.shape[1]
    if table.heads is None:
        if not PLACE <= count <= len(COLUMNS):
            reason = f"has {count} columns; known are {', '.join(COLUMNS)}"
            raise TableError(table.file, int(table.lines[0]), 0, reason)
        heads = tuple(Head(name, None) for name in COLUMNS[:count])
    else:
        heads = table.heads
        for column, head in enumerate(heads, 1):
            if head.name not in COLUMNS:
                reason = f"{head.name} is no column of points; known are {', '.join(COLUMNS)}"
                raise TableError(table.file, table.head_line, column, reason)
    names = [head.name for head in heads]
    for name in COLUMNS[:PLACE]:
        if name not in names:
            raise TableError(table.file, table.head_line, 0, f"has no column {name}")
    units = [_unit(table, column, head, heads, unit) for column, head in enumerate(heads)]
    numbers = table.numbers * units
    for column, name in enumerate(names):
        values = numbers[:, column]
        for wrong, reason in _mistakes(name, values):
            if wrong.any():
                raise table.error(int(wrong.argmax()), column, f"{name} {reason}")

    def column_of(name: str, default: float) -> FloatArray:
        if name not in names:
            return np.full(len(numbers), default)
        values = numbers[:, names.index(name)]
        return np.asarray(np.where(np.isnan(values), default, values))

    points = np.stack([column_of(name, 0.0) for name in COLUMNS[:PLACE]], axis=1)
    speeds = column_of("speed", settings.feed or 0.0)
    return points, column_of("tolerance", settings.tolerance), speeds


def _mistakes(name: str, values: FloatArray) -> tuple[tuple[NDArray[np.bool_], str], ...]:
    """Return which values of a column have no meaning, and why."""
    if name in COLUMNS[:PLACE]:
        return (
            (np.isnan(values), "is empty"),
            (np.abs(values) > FAR, f"must be at most {FAR:g} m from zero"),
        )
    negative = (values < 0.0, "must be at least 0")
    if name == "speed":
        slow = (values > 0.0) & (values < LEAST_SPEED)
        fast = (values > LARGEST_SPEED, f"must be at most {LARGEST_SPEED:g} m/s")
        return (negative, (slow, f"must be 0, or at least {LEAST_SPEED:g} m/s"), fast)
    return (negative, (values > FAR, f"must be at most {FAR:g} m"))


def _unit(
    table: Table, column: int, head: Head, heads: tuple[Head, ...], unit: str | None
) -> float:
    """Return the unit of a column: its own, or that of the first length that has one."""
    is_speed = head.name == "speed"
    known = SPEED_UNITS if is_speed else UNITS
    given = head.unit
    if given is None:
        lengths = (other.unit for other in heads if other.name != "speed" and other.unit)
        given = unit or next(lengths, None)
        if given is None:
            reason = f"{head.name} has no unit: name it in a head, as in 'x [mm]', or by --unit"
            raise TableError(table.file, table.head_line, column + 1, reason)
        given = f"{given}/s" if is_speed else given
    if given not in known:
        reason = f"{given} is no unit of {head.name}; known are {', '.join(known)}"
        raise TableError(table.file, table.head_line, column + 1, reason)
    return known[given]
