"""Plans on a straight line in slider space: the sliders move in proportion to one of them."""

from __future__ import annotations

import math
from bisect import bisect_right

from tri_glide_kinematics.motion.trajectory.cubic import AT_REST, CubicPlan, SliderState, new_state
from tri_glide_kinematics.motion.trajectory.phases import Phases
from tri_glide_kinematics.vectors import Vector3


class StraightPlan(CubicPlan):
    """From rest to rest; each slider moves by a constant ratio to a leading one.

    The pieces are those of any ``CubicPlan``, but a setpoint takes one cubic instead of three.

    Attributes:
        length: way of the leading slider [m].
    """

    __slots__ = ("_directions", "_heights", "length")

    def __init__(self, heights: Vector3, ratios: Vector3, phases: Phases) -> None:
        """Integrate the phases.

        Args:
            heights: of the sliders at the start [m].
            ratios: motion of each slider, divided by that of the leading one; its own is 1.
            phases: (duration [s], jerk [m/s^3]) of the leading slider, one after the other. The
                last of them leaves it at rest.
        """
        jerks = [[(duration, ratio * jerk) for duration, jerk in phases] for ratio in ratios]
        super().__init__(SliderState(heights, AT_REST, AT_REST), jerks)
        leading = ratios.index(1.0)
        way = self._final.heights[leading] - heights[leading]
        x, y, z = (math.copysign(1.0, way) * ratio for ratio in ratios)
        self._heights, self._directions = heights, (x, y, z)
        self.length = abs(way)
        leader = 4 * leading
        # ``state`` takes the leader's velocity, half its acceleration and three times its way,
        # which spares it all factors: they are in the ratios.
        doubles = (2.0 * ratio for ratio in ratios)
        thirds = (ratio / 3.0 for ratio in ratios)
        scales = (*thirds, *ratios, *doubles)
        rows: list[tuple[float, ...]] = []
        for start, end, *values in self._rows:
            _, v, a, j = values[leader : leader + 4]
            rows.append((start, end, v, 2.0 * v, 0.5 * a, 0.5 * j, *values[::4], *scales))
        self._rows = rows
        self._row = rows[0] if rows else (0.0,) * 18

    def at(self, distance: float) -> SliderState:
        """Return place and motion after ``distance`` [m] of the leading slider, at its 1 m/s."""
        (h1, h2, h3), (x, y, z) = self._heights, self._directions
        heights = (h1 + distance * x, h2 + distance * y, h3 + distance * z)
        return SliderState(heights, self._directions, AT_REST)

    def state(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        start, end, v0, w0, b0, j, h1, h2, h3, s1, s2, s3, k1, k2, k3, d1, d2, d3 = self._row
        if time < start or time >= end:
            if time >= self.duration:
                return self._final
            row = self._row = self._rows[bisect_right(self._starts, time) - 1]
            start, end, v0, w0, b0, j, h1, h2, h3, s1, s2, s3, k1, k2, k3, d1, d2, d3 = row
        # The cubic of ``constant_jerk.after``, unrolled for the leader.
        t = time - start
        b = b0 + t * j
        v = v0 + t * (b0 + b)
        s = t * (w0 + v + t * b0)
        return new_state(
            SliderState,
            (
                (h1 + s1 * s, h2 + s2 * s, h3 + s3 * s),
                (k1 * v, k2 * v, k3 * v),
                (d1 * b, d2 * b, d3 * b),
            ),
        )
