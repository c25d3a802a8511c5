"""Saves a picture, all of it or nothing."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import write_file


class DrawingError(KinematicsError):
    """A picture was asked for that a mechanism does not have."""


def save_figure(figure: Figure, file: Path, resolution: float) -> None:
    """Save a ``figure`` as a PNG ``file``, with a ``resolution`` in pixels per inch.

    Raises:
        OSError: if it cannot be written.
    """
    picture = BytesIO()
    figure.savefig(picture, format="png", dpi=resolution)
    write_file(file, picture.getvalue())
