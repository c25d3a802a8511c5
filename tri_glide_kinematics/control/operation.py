"""Whether a machine can be led from where it is measured."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tri_glide_kinematics.control.errors import CommandRefusedError
from tri_glide_kinematics.control.reason import Reason
from tri_glide_kinematics.control.supervision import Supervisor
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text

# Encoders of sliders at their end stops may read a little beyond the travel [m].
TRAVEL_TOLERANCE = 1e-3


class StartingPlace:
    """The latest measured heights, and what keeps the machine from being led from there.

    Attributes:
        obstacle: reason from outside to lead no machine; None if there is none.
        heights: latest ones that are finite. Shape (3,) [m]; None before the first.
    """

    def __init__(
        self, supervisor: Supervisor, travel: tuple[Sequence[float], Sequence[float]]
    ) -> None:
        """Know no place yet.

        Args:
            supervisor: of the measured heights.
            travel: lower and upper ends of the sliders' travel, each of shape (3,) [m].
        """
        self.obstacle: Reason | None = None
        self._supervisor = supervisor
        self._travel = travel
        self.heights: Vector3 | None = None

    def measured(self, heights: Vector3) -> None:
        """Take in measured ``heights`` [m]."""
        self.heights = heights if all(map(math.isfinite, heights)) else None

    def checked(self, now: float) -> Vector3:
        """Return the heights from which the machine can be led ``now`` [s]. Shape (3,) [m].

        Raises:
            CommandRefusedError: if there is no such place, or an obstacle.
        """
        if self.heights is None or not self._supervisor.is_fresh(now):
            text = "there are no measured slider heights to start from"
            raise CommandRefusedError(text, Refusal.NO_MEASUREMENT)
        if self.obstacle is not None:
            raise CommandRefusedError(self.obstacle.text, Refusal.OTHER_PUBLISHER)
        for slider, (lower, height, upper) in enumerate(
            zip(self._travel[0], self.heights, self._travel[1])
        ):
            if not lower - TRAVEL_TOLERANCE <= height <= upper + TRAVEL_TOLERANCE:
                raise CommandRefusedError(
                    f"slider {slider + 1} is measured at {number_text(height, 6)} m, outside its "
                    f"travel from {number_text(lower, 6)} to {number_text(upper, 6)} m",
                    Refusal.OUTSIDE_TRAVEL,
                )
        return self.heights
