"""Forces that setpoints ask of the sliders, and what they ask over a while. No ROS in here."""

from __future__ import annotations

import math
from collections import deque

from tri_glide_kinematics.dynamics import SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.vectors import Vector3

# The window is moved on by this part of it.
PARTS = 100


class FeedForward:
    """The forces of each setpoint, and their root mean square over a window.

    The root mean square is the continuous force: it warms the motors up, and it is what the sheet
    of a motor names beside its peak force.

    Attributes:
        forces: of the machine; None as long as its masses are not known.
    """

    def __init__(self, period: float, window: float) -> None:
        """Know no masses yet.

        Args:
            period: time between two setpoints [s].
            window: of the continuous force [s].
        """
        self.forces: SliderForces | None = None
        self._size = max(1, round(window / (PARTS * period)))
        # For each part of the window: the sums of the squares, and how many there are.
        self._parts: deque[tuple[float, float, float, int]] = deque(maxlen=PARTS)
        self._newest = (0.0, 0.0, 0.0, 0)

    def of(self, setpoint: SliderState) -> Vector3 | None:
        """Return the forces of a ``setpoint``, which counts for the continuous force.

        Returns:
            Shape (3,) [N]; None without masses, or where the platform cannot be held.
        """
        if self.forces is None:
            return None
        try:
            forces = self.forces.forces(*setpoint)
        except KinematicsError:
            # It was at a singular place when it was switched on; a motion never leads there.
            return None
        f1, f2, f3 = forces
        s1, s2, s3, count = self._newest
        newest = (s1 + f1 * f1, s2 + f2 * f2, s3 + f3 * f3, count + 1)
        if newest[3] == self._size:
            self._parts.append(newest)
            newest = (0.0, 0.0, 0.0, 0)
        self._newest = newest
        return forces

    @property
    def continuous(self) -> Vector3 | None:
        """Root mean square of the forces over the window, or since the first setpoint in it.

        Shape (3,) [N]; None without any.
        """
        s1, s2, s3, count = map(sum, zip(*self._parts, self._newest))
        if not count:
            return None
        return math.sqrt(s1 / count), math.sqrt(s2 / count), math.sqrt(s3 / count)
