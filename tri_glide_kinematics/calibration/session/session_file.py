"""Keeps the measurements of a session on the disk while they are made."""

from __future__ import annotations

from datetime import datetime
from itertools import count
from pathlib import Path

from tri_glide_kinematics.calibration.fit.measurement_file import MeasurementFile, measurement_text
from tri_glide_kinematics.calibration.session.errors import SavingError
from tri_glide_kinematics.files import write_file


def new_session_file(folder: Path) -> Path:
    """Return a name in a folder that no file has yet: that of the session that begins now."""
    name = f"session_{datetime.now():%Y-%m-%d_%H-%M-%S}"
    files = (folder / f"{name}{f'_{number}' if number else ''}.yaml" for number in count())
    return next(file for file in files if not file.exists())


def keep_measurements(file: Path, content: MeasurementFile) -> None:
    """Write the measurements made so far in place of those before; they are on the disk then.

    Raises:
        SavingError: if that is not possible.
    """
    try:
        write_file(file, measurement_text(content))
    except OSError as error:
        reason = error.strerror or error
        raise SavingError(f"not noted, as {file} cannot be written: {reason}") from error
