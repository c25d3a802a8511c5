"""What control refuses."""

from __future__ import annotations

from tri_glide_kinematics.errors import KinematicsError


class CommandRefusedError(KinematicsError):
    """A command that does not fit the present state."""
