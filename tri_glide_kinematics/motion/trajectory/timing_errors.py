"""Why there is no motion along a path."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.path.driven_path import DrivenPath
from tri_glide_kinematics.motion.trajectory.errors import PlanningError


class PathTimingError(PlanningError):
    """No motion along a path was found."""

    def __init__(self, segment: int, place: float, reason: str) -> None:
        """Store the index of the ``segment``, the ``place`` [m] and the ``reason`` in words."""
        super().__init__(f"segment {segment + 1} of the path, {place:.6g} m along it: {reason}")
        self.segment = segment
        self.place = place

    @classmethod
    def at(cls, driven: DrivenPath, place: float, reason: str) -> PathTimingError:
        """Return the error for a ``place`` on a path [m]."""
        return cls(int(driven.segment_of(np.array([place]))[0]), place, reason)
