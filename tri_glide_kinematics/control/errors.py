"""What control refuses."""

from __future__ import annotations

import os
import traceback

from tri_glide_kinematics.errors import KinematicsError, Refusal


class CommandRefusedError(KinematicsError):
    """A command that does not fit the present state."""

    def __init__(self, text: str, refusal: Refusal) -> None:
        """Store why, in words and for programs."""
        super().__init__(text)
        self.refusal = refusal


class BrokenError(KinematicsError):
    """Something in the program is wrong, so that it cannot go on."""

    refusal = Refusal.FAULT

    def __init__(self, cause: Exception) -> None:
        """Tell the ``cause``, and where it was raised."""
        places = traceback.extract_tb(cause.__traceback__)
        where = "".join(
            f" in {place.name} ({os.path.basename(place.filename)}, line {place.lineno})"
            for place in places[-1:]
        )
        super().__init__(f"the control cycle failed{where}: {type(cause).__name__}: {cause}")
        self.cause = cause
