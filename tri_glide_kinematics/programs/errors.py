"""What can be wrong with a drive file."""

from __future__ import annotations

from tri_glide_kinematics.keys import FileError


class DriveFileError(FileError):
    """A file of moves, paths and waits cannot be read, or something in it has no meaning."""
