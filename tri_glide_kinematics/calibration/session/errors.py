"""Why something cannot be measured, noted or written."""

from __future__ import annotations

from tri_glide_kinematics.errors import KinematicsError


class RecordingError(KinematicsError):
    """There is nothing, or nothing steady, that could be noted."""


class ProbingError(KinematicsError):
    """The platform cannot be sent down to a plate now."""


class SavingError(KinematicsError):
    """A file cannot be written."""
