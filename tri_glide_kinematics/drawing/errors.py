"""Why a picture cannot be drawn."""

from __future__ import annotations

from tri_glide_kinematics.errors import KinematicsError


class DrawingError(KinematicsError):
    """A picture was asked for that a mechanism does not have."""
