"""One target of the demonstration and what became of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.vectors import Vector3


@dataclass(frozen=True)
class Leg:
    """One target and what became of it.

    Attributes:
        name: of the target.
        target: position to be reached [m]; None for a jog, which has none.
        reached: measured position at the end [m].
        duration: from the command to the end [s].
        first: its first row in the stream of commands.
        end: the row after its last.
        deviation: largest measured distance from its path; 0 for a leg without one [m].
        tolerance: of that path [m].
    """

    name: str
    target: Vector3 | None
    reached: Vector3
    duration: float
    first: int
    end: int
    deviation: float = 0.0
    tolerance: float = 0.0

    @property
    def error(self) -> float:
        """Distance between target and measured position [m]; zero for a jog."""
        if self.target is None:
            return 0.0
        return float(np.linalg.norm(np.subtract(self.target, self.reached)))
