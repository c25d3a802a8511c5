r"""Slider heights, and their derivatives, while the platform moves along a straight line.

The platform is at $p(s) = p_0 + s\,u$ with $|u| = 1$. With $c_i$ the horizontal vector from
anchor i to $p_0$ and $m = -|u_{xy}|^2$, arm i rises by

$$R_i(s) = \sqrt{L_i^2 - |c_i + s\,u_{xy}|^2}, \quad R_i R_i' = x_i(s) = m s - c_i \cdot u_{xy},$$

and the slider height is $h_i = p_{0z} + s\,u_z + R_i$. With $g = R' = x / R$ the higher
derivatives follow from differentiating $R g = x$ again and again:
$R g' = m - g^2$, $R g'' = -3 g g'$, $R g''' = -3 g'^2 - 4 g g''$.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tri_glide_kinematics.tri_glide import ArmTooShortError, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3


class StraightLine:
    """A segment in the platform's space, seen from the sliders.

    Attributes:
        start: where it begins. Shape (3,) [m].
        direction: unit vector. Shape (3,).
        length: [m].
        slope: vertical component of the direction.
        curvature: m of the module's formulas, common to all arms.
        arms: for each arm $R^2$ [m^2] and $x$ [m] at the start.
        start_heights: of the sliders. Shape (3,) [m].
        start_slopes: first derivatives of the heights at the start. Shape (3,).
        start_bends: second derivatives of the heights at the start. Shape (3,) [1/m].
    """

    __slots__ = (
        "_arm_lengths",
        "_rises",
        "_tilts",
        "arms",
        "curvature",
        "direction",
        "length",
        "slope",
        "start",
        "start_bends",
        "start_heights",
        "start_slopes",
    )

    def __init__(
        self,
        geometry: TriGlideGeometry,
        start: Sequence[float],
        direction: Sequence[float],
        length: float,
    ) -> None:
        """Prepare the segment of ``length`` [m] from ``start`` [m] along a unit ``direction``.

        Raises:
            ArmTooShortError: if an end of it, and so some of it, is out of reach of an arm.
        """
        x, y, z = (float(value) for value in start)
        ux, uy, uz = (float(value) for value in direction)
        self.start: Vector3 = (x, y, z)
        self.direction: Vector3 = (ux, uy, uz)
        self.length = length
        self.slope = uz
        self.curvature = m = -(ux * ux + uy * uy)
        arms, values = [], []
        for anchor, arm_length in zip(geometry.anchors, geometry.arm_lengths):
            cx, cy = x - anchor[0], y - anchor[1]
            arms.append((arm_length * arm_length - cx * cx - cy * cy, -(cx * ux + cy * uy)))
        self.arms = tuple(arms)
        self._arm_lengths = geometry.arm_lengths
        # Rises are concave along a line: if both ends are within reach, so is what is between.
        self.heights_at(length)
        for (square, tilt), height in zip(arms, self.heights_at(0.0)):
            rise = math.sqrt(square)
            rate = tilt / rise
            values.append((height, rate + uz, (m - rate * rate) / rise))
        self.start_heights, self.start_slopes, self.start_bends = zip(*values)
        self._rises, self._tilts = np.array(arms).T[..., np.newaxis]

    @classmethod
    def between(
        cls, geometry: TriGlideGeometry, start: Sequence[float], end: Sequence[float]
    ) -> StraightLine:
        """Return the segment between two different points [m]."""
        length = math.dist(start, end)
        x, y, z = ((b - a) / length for a, b in zip(start, end))
        return cls(geometry, start, (x, y, z), length)

    def point(self, way: float) -> Vector3:
        """Return the point at distance ``way`` [m] from the start."""
        (x, y, z), (ux, uy, uz) = self.start, self.direction
        return (x + way * ux, y + way * uy, z + way * uz)

    def heights_at(self, way: float) -> Vector3:
        """Return the slider heights at one distance [m].

        Raises:
            ArmTooShortError: if it is out of reach of an arm.
        """
        heights = []
        for arm, (square, tilt) in enumerate(self.arms):
            square += way * (2.0 * tilt + self.curvature * way)
            if not square > 0.0:
                length = self._arm_lengths[arm]
                distance = math.sqrt(length * length - square)
                raise ArmTooShortError(self.point(way), arm, distance, length)
            heights.append(self.start[2] + self.slope * way + math.sqrt(square))
        h1, h2, h3 = heights
        return h1, h2, h3

    def heights(self, ways: FloatArray) -> FloatArray:
        """Return the slider heights at many distances ``ways``, shape (n,) [m]. Shape (3, n)."""
        return np.asarray(self.start[2] + self.slope * ways + self._rise(ways)[1])

    def derivatives(
        self, ways: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return rise R, and first, second and third derivative of the heights at ``ways`` [m].

        Args:
            ways: Shape (n,) [m].

        Returns:
            Four arrays, each of the shape (3, n).
        """
        x, rise = self._rise(ways)
        first = x / rise
        second = (self.curvature - first * first) / rise
        third = -3.0 * first * second / rise
        return rise, first + self.slope, second, third

    def _rise(self, ways: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return x and R of the module's formulas. Each of the shape (3, n)."""
        x = self._tilts + self.curvature * ways
        return x, np.sqrt(self._rises + ways * (self._tilts + x))
