"""Files by the ends of their names: G-code, points, steps in YAML; and texts that are no files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tri_glide_kinematics.programs.drive_files import load_drive
from tri_glide_kinematics.programs.gcode import read_program
from tri_glide_kinematics.programs.points import load_points
from tri_glide_kinematics.programs.program import Program, Work
from tri_glide_kinematics.programs.settings import ProgramSettings
from tri_glide_kinematics.programs.words import ProgramError, TellPart, tell_nobody
from tri_glide_kinematics.vectors import Vector3

# How the names of tables of points end, and those of all that becomes a ``Program``.
POINTS_ENDING = ".csv"
PROGRAM_ENDINGS = (".gcode", ".gco", ".g", ".nc", ".ngc", ".tap", ".txt", POINTS_ENDING)


def is_program(file: Path) -> bool:
    """Return whether a file is G-code or a table of points, by the end of its name."""
    return file.suffix.lower() in PROGRAM_ENDINGS


def load_program(
    file: str | Path,
    settings: ProgramSettings | None = None,
    unit: str | None = None,
    tell_part: TellPart = tell_nobody,
) -> Program:
    """Read points, or a program in G-code, and find out what it means.

    Args:
        file: of points, if its name ends in .csv.
        settings: what it does not say.
        unit: of points that name none; see ``load_points``.
        tell_part: gets which part of it is read, now and then.

    Raises:
        ProgramError: if it cannot be read, or something in it is not understood.
    """
    if Path(file).suffix.lower() == POINTS_ENDING:
        return load_points(file, settings, unit)
    try:
        data = Path(file).read_bytes()
    except OSError as error:
        raise ProgramError(file, 0, 0, "", f"cannot be read: {error.strerror or error}") from error
    return read_program(data, settings, file, tell_part)


def load_work(file: Path, settings: ProgramSettings | None = None, unit: str | None = None) -> Work:
    """Read a program, points or a drive file; the arguments are those of ``load_program``.

    Raises:
        FileError: if it cannot be read, or something in it has no meaning.
    """
    return load_program(file, settings, unit) if is_program(file) else load_drive(file)


# Of a program that stands in no file: no more characters, and no more segments, so that it is soon
# proved.
LONGEST_TEXT = 2000
MOST_SEGMENTS = 1000


def read_short(
    text: str, settings: ProgramSettings, place: Vector3, name: str = "typed"
) -> Program:
    """Return what a ``text`` means as a program of its own, from a ``place`` [m] on.

    All begins as in a file: millimetres, G90, G54, no F but that of the settings. Errors call it by
    its ``name``.

    Raises:
        ProgramError: if it is not understood, does nothing, or is not short.
    """
    if len(text) > LONGEST_TEXT:
        reason = f"it has {len(text)} characters, at most {LONGEST_TEXT}: make a file of it"
        raise ProgramError(name, 0, 0, "", reason)
    program = read_program(f"{text}\n", replace(settings, start=place), name)
    count = sum(len(run.lines) for step in program.steps for run in step.runs)
    if count > MOST_SEGMENTS:
        reason = f"it has {count} segments, at most {MOST_SEGMENTS}: make a file of it"
        raise ProgramError(name, 1, 0, "", reason)
    return program
