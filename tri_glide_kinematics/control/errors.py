"""What control refuses."""

from __future__ import annotations

from tri_glide_kinematics.errors import KinematicsError, Refusal


class CommandRefusedError(KinematicsError):
    """A command that does not fit the present state."""

    def __init__(self, text: str, refusal: Refusal) -> None:
        """Store why, in words and for programs."""
        super().__init__(text)
        self.refusal = refusal
