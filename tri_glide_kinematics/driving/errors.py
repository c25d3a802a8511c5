"""What can be wrong with a drive."""

from __future__ import annotations

from pathlib import Path

from tri_glide_kinematics.errors import KinematicsError


class DriveFileError(KinematicsError):
    """A file cannot be read, or something in it has no meaning.

    Attributes:
        file: that it is about.
        place: in it, for example ``step 2, segment 3``; empty if it is about all of it.
        reason: in words.
    """

    def __init__(self, file: str | Path, place: str, reason: str) -> None:
        """Store the ``file``, the ``place`` in it and the ``reason``."""
        super().__init__(": ".join(part for part in (str(file), place, reason) if part))
        self.file = file
        self.place = place
        self.reason = reason


class NoMachineError(Exception):
    """Nobody offers the actions; the text says what was looked for."""
