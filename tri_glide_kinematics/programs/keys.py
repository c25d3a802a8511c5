"""The keys of one entry of a drive file."""

from __future__ import annotations

from tri_glide_kinematics import keys
from tri_glide_kinematics.programs.errors import DriveFileError


class Keys(keys.Keys):
    """The keys of one entry, each read by its name; a mistake is a ``DriveFileError``."""

    error_class = DriveFileError
