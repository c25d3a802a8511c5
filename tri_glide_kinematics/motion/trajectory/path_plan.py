"""Plans that lead the platform along a path: a time scaling of the sliders' heights on it."""

from __future__ import annotations

from bisect import bisect_right

from tri_glide_kinematics.motion.trajectory.cubic import SampledPlan, SliderState
from tri_glide_kinematics.motion.trajectory.path_heights import PathHeights
from tri_glide_kinematics.motion.trajectory.time_scaling import PathScaling, PathStart
from tri_glide_kinematics.vectors import FloatArray


class PathPlan:
    """A part of a path with a time scaling that ends at rest.

    Attributes:
        duration: time until the sliders rest [s].
        heights: of the sliders on the path.
        scaling: how far along the path the platform is at each time.
        continue_at: when the next part should begin; at the end of this one if that is a stop [s].
        ends_path: whether it leads to the end of the path.
    """

    __slots__ = (
        "_ends",
        "_row",
        "_starts",
        "_table",
        "continue_at",
        "duration",
        "ends_path",
        "heights",
        "scaling",
    )

    def __init__(self, heights: PathHeights, timed: PathScaling) -> None:
        """Prepare the plan of a part of the path that is ``timed``."""
        self.heights = heights
        self.scaling = scaling = timed.scaling
        self.duration = float(scaling.times[-1])
        self.ends_path = timed.ends_at >= heights.driven.length
        self.continue_at = min(timed.continue_at, self.duration)
        self._starts: list[float] = scaling.times[:-1].tolist()
        self._ends = [*self._starts[1:], self.duration]
        self._table = scaling.coefficients()
        # The piece that was asked for last: the next instant is nearly always in the same.
        self._row: tuple[float, ...] = (0.0, 0.0)

    def state(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        return self.heights.state(*self.at(time))

    def at(self, time: float) -> PathStart:
        """Return place, speed and acceleration along the path ``time`` seconds after the start."""
        row = self._row
        if not row[0] <= time < row[1]:
            if time >= self.duration:
                return PathStart(float(self.scaling.ways[-1]), 0.0, 0.0)
            index = max(bisect_right(self._starts, time) - 1, 0)
            piece = self._table[:, index].tolist()
            row = self._row = (self._starts[index], self._ends[index], *piece)
        start, _, s0, s1, s2, s3, s4, s5 = row
        t = time - start
        return PathStart(
            s0 + t * (s1 + t * (s2 + t * (s3 + t * (s4 + t * s5)))),
            s1 + t * (2.0 * s2 + t * (3.0 * s3 + t * (4.0 * s4 + t * (5.0 * s5)))),
            2.0 * s2 + t * (6.0 * s3 + t * (12.0 * s4 + t * (20.0 * s5))),
        )

    def place(self, time: float) -> float:
        """Return how far along the path the platform is at a ``time`` [m]."""
        return self.at(time).place

    def moved_to(self, heights: PathHeights, time: float) -> PathPlan:
        """Return what is left at a ``time`` [s], on a path that is the same as far as it leads."""
        left = self.scaling.since(time)
        shifted = left._replace(times=left.times - time)
        return PathPlan(heights, PathScaling(shifted, self.continue_at - time))

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        ways, speeds, accelerations = self.scaling.evaluate(times)
        height, first, second, _ = self.heights.derivatives(ways).heights
        return SampledPlan(
            times,
            height.T,
            (first * speeds).T,
            (first * accelerations + second * speeds * speeds).T,
        )
