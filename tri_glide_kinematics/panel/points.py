"""Points that an operator has taught, and the file that keeps them as a path."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import yaml

from tri_glide_kinematics.files import replace_file
from tri_glide_kinematics.panel.errors import PanelError
from tri_glide_kinematics.programs import PathStep, load_drive
from tri_glide_kinematics.vectors import Vector3

# Of a file that is written here: no other is overwritten.
FIRST_LINE = "# Points taught at the panel. Drive them: ros2 run tri_glide_kinematics drive FILE"

# Decimals of a millimetre in the file.
DIGITS = 4


class PointsFileError(PanelError):
    """A file of points cannot be written, or is none."""


def points_text(points: Sequence[Vector3], tolerance: float, speed: float) -> str:
    """Return a drive file with one path through the points, from where the platform is.

    Args:
        points: Shape (n, 3) [m].
        tolerance: at its corners [m].
        speed: of the platform, 0 for what the sliders can do [m/s].
    """
    bounds = f"{{tolerance: {_number(1000.0 * tolerance)}, speed: {_number(1000.0 * speed)}}}"
    rows = ",\n".join(f"  {{line: {{to: [{_in_millimetres(point)}]}}}}" for point in points)
    # In braces, so that a file that is cut off is no YAML.
    return (
        f"{FIRST_LINE}\n"
        f"{{unit: mm,\ndefaults: {bounds},\nsteps: [{{path: {{segments: [\n{rows}\n]}}}}]}}\n"
    )


def save_points(file: Path, points: Sequence[Vector3], tolerance: float, speed: float) -> None:
    """Write the points as a drive file; an older one is kept as ``NAME.bak``.

    Raises:
        PointsFileError: if there is no point, or the file cannot be written.
    """
    if not points:
        raise PointsFileError("there is no point to save, at least 1")
    try:
        replace_file(file, points_text(points, tolerance, speed))
    except OSError as error:
        raise PointsFileError(f"{file} cannot be written: {error.strerror or error}") from error


def load_points(file: Path) -> list[Vector3]:
    """Read the points of a drive file that holds one path of lines [m].

    Raises:
        DriveFileError: if it is no drive file.
        PointsFileError: if it holds something else than one path of lines.
    """
    steps = load_drive(file).steps
    if len(steps) != 1 or not isinstance(steps[0], PathStep) or steps[0].segments.kinds.any():
        raise PointsFileError(f"{file} holds more than one path of lines")
    rows = steps[0].segments.numbers.reshape(-1, 3).tolist()
    return [(x, y, z) for x, y, z in rows]


def _in_millimetres(point: Vector3) -> str:
    return ", ".join(_number(1000.0 * part) for part in point)


def _number(value: float) -> str:
    return str(yaml.safe_load(f"{round(value, DIGITS) + 0.0:f}"))
