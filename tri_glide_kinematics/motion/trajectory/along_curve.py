"""Plans along a line or a path: a time scaling of the sliders' heights on it, and their bounds."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from math import hypot, sqrt

import numpy as np

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import check_place
from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan
from tri_glide_kinematics.motion.trajectory.curve_bounds import (
    check_line_bounds,
    check_path_limits,
    derivative_bounds,
)
from tri_glide_kinematics.motion.trajectory.curves import PathHeights, StraightLine
from tri_glide_kinematics.motion.trajectory.limits import SliderLimits
from tri_glide_kinematics.motion.trajectory.time_scaling import PathScaling, PathStart, TimeScaling
from tri_glide_kinematics.motion.trajectory.trajectory import (
    AT_REST,
    SampledPlan,
    SliderState,
    Trajectory,
    new_state,
)
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Traced, Workspace

# A line that leads less far over the ground than this, per metre, is not told from a vertical one.
STEEPEST = 1e-12


class LinePlan(Trajectory):
    """A straight line with a time scaling, with or without a blend.

    Attributes:
        duration: time until all sliders rest [s].
        line: where the platform moves.
        scaling: how far along it is at each time.
        blend: slider offsets that lead from the motion before onto the line, or None.
    """

    __slots__ = (
        "_arms",
        "_ends",
        "_final",
        "_row",
        "_starts",
        "_ways",
        "blend",
        "duration",
        "line",
        "scaling",
    )

    def __init__(
        self, line: StraightLine, scaling: TimeScaling, blend: CubicPlan | None = None
    ) -> None:
        """Prepare the plan; the time scaling ends at rest, the blend at zero.

        Raises:
            ArmTooShortError: if the end is out of reach of an arm.
        """
        self.line = line
        self.scaling = scaling
        self.blend = blend
        self.duration = max(float(scaling.times[-1]), blend.duration if blend else 0.0)
        self._starts: list[float] = scaling.times[:-1].tolist()
        # ``at`` takes the way over the ground, w = k s with k^2 = -m, which leaves the least
        # to do for each arm: R^2 = a - y^2 with y = b / k - w, R' = y / R and R'' = -a / R^3.
        k = max(sqrt(-line.curvature), STEEPEST)
        self._ends = [*self._starts[1:], self.duration]
        self._ways = k * scaling.coefficients()
        # The piece that was asked for last: the next instant is nearly always in the same.
        self._row: tuple[float, ...] = (0.0, 0.0)
        y1, y2, y3 = (tilt / k for _, tilt in line.arms)
        a1, a2, a3 = (square + y * y for (square, _), y in zip(line.arms, (y1, y2, y3)))
        self._arms = (a1, y1, a2, y2, a3, y3, line.start[2], line.slope / k)
        heights = line.heights_at(float(scaling.ways[-1]))
        self._final = SliderState(heights, AT_REST, AT_REST)
        if blend is not None:
            self._final = _sum(self._final, blend.at(self.duration))

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        row = self._row
        if not row[0] <= time < row[1]:
            time = max(time, 0.0)
            if time >= self.duration:
                return self._final
            row = self._row = self._piece(bisect_right(self._starts, time) - 1)
        start, _, s0, s1, s2, s3, s4, s5, v0, v1, v2, v3, v4, b0, b1, b2, b3 = row
        t = time - start
        way = s0 + t * (s1 + t * (s2 + t * (s3 + t * (s4 + t * s5))))
        speed = v0 + t * (v1 + t * (v2 + t * (v3 + t * v4)))
        acceleration = b0 + t * (b1 + t * (b2 + t * b3))
        a1, y1, a2, y2, a3, y3, base, slope = self._arms
        base += slope * way
        square = speed * speed
        y1 -= way
        y2 -= way
        y3 -= way
        q1, q2, q3 = a1 - y1 * y1, a2 - y2 * y2, a3 - y3 * y3
        r1, r2, r3 = sqrt(q1), sqrt(q2), sqrt(q3)
        f1, f2, f3 = y1 / r1 + slope, y2 / r2 + slope, y3 / r3 + slope
        state = new_state(
            SliderState,
            (
                (base + r1, base + r2, base + r3),
                (f1 * speed, f2 * speed, f3 * speed),
                (
                    f1 * acceleration - a1 / (q1 * r1) * square,
                    f2 * acceleration - a2 / (q2 * r2) * square,
                    f3 * acceleration - a3 / (q3 * r3) * square,
                ),
            ),
        )
        if self.blend is None:
            return state
        return _sum(state, self.blend.at(time))

    def _piece(self, index: int) -> tuple[float, ...]:
        """Return begin and end of a piece, and its coefficients of way, speed, acceleration."""
        s0, s1, s2, s3, s4, s5 = self._ways[:, index].tolist()
        speed = s1, 2.0 * s2, 3.0 * s3, 4.0 * s4, 5.0 * s5
        acceleration = 2.0 * s2, 6.0 * s3, 12.0 * s4, 20.0 * s5
        return (
            self._starts[index],
            self._ends[index],
            s0,
            s1,
            s2,
            s3,
            s4,
            s5,
            *speed,
            *acceleration,
        )

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        way, speed, acceleration = self.scaling.evaluate(times)
        _, first, second, _ = self.line.derivatives(way)
        sampled = SampledPlan(
            times,
            self.line.heights(way).T,
            (first * speed).T,
            (first * acceleration + second * speed * speed).T,
        )
        if self.blend is not None:
            for values, offsets in zip(sampled[1:], self.blend.sample(times)[1:]):
                values += offsets
        return sampled

    def check_limits(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Compare the bounds of the derivatives on the line with the limits.

        Args:
            limits: of the sliders.
            since: pieces that end before this time are past, and not checked [s].

        Raises:
            SliderLimitError: if a limit may be exceeded.
            PlanningError: if the platform would go back along the line.
        """
        # A braking may lead out of reach; the NaN that this gives fails every comparison below.
        scaling = self.scaling.since(since)
        with np.errstate(invalid="ignore"):
            bounds = derivative_bounds(self.line, scaling, self.blend)
        check_line_bounds(bounds, scaling.times, limits)

    def checks_inside(self, region: Workspace, limits: SliderLimits) -> Iterable[Traced[None]]:
        """Return the checks of the line, and of the way beside it if there is one."""
        if self.line.known_inside is not region:
            end = self.line.point(float(self.scaling.ways[-1]))
            yield region.segment_check(self.line.start, end)
        # A plan that begins at rest has none, as that of the setpoint before the first step.
        if self.blend is None or self.blend.duration == 0.0:
            return
        duration = self.blend.duration
        times = self.scaling.times[: np.searchsorted(self.scaling.times, duration) + 1]
        heights = self.sample(times).heights
        # What a slider can move beyond both ends of a piece under its largest acceleration.
        excess = np.square(np.diff(times)).max() / 8.0 * np.array(limits.acceleration)
        self.check_travel(heights.min(axis=0) - excess, heights.max(axis=0) + excess, region)
        yield region.path_check(self.at, duration, hypot(*limits.acceleration))


def _sum(state: SliderState, offset: SliderState) -> SliderState:
    (h1, h2, h3), (v1, v2, v3), (a1, a2, a3) = state
    (dh1, dh2, dh3), (dv1, dv2, dv3), (da1, da2, da3) = offset
    return SliderState(
        (h1 + dh1, h2 + dh2, h3 + dh3),
        (v1 + dv1, v2 + dv2, v3 + dv3),
        (a1 + da1, a2 + da2, a3 + da3),
    )


class PathPlan(Trajectory):
    """A part of a path with a time scaling that ends at rest, or where another part goes on.

    Attributes:
        duration: time until the sliders rest [s].
        heights: of the sliders on the path.
        scaling: how far along the path the platform is at each time.
        continue_at: when the next part should begin; at the end of this one if that is a stop [s].
        ends_path: whether it leads to the end of the path.
    """

    __slots__ = (
        "_end",
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
        self._end = PathStart(*(float(values[-1]) for values in scaling[1:]))
        # The piece that was asked for last: the next instant is nearly always in the same.
        self._row: tuple[float, ...] = (0.0, 0.0)

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        return self.heights.state(*self.on_path(time))

    def on_path(self, time: float) -> PathStart:
        """Return place, speed and acceleration along the path ``time`` seconds after the start."""
        row = self._row
        if not row[0] <= time < row[1]:
            time = max(time, 0.0)
            if time >= self.duration:
                return self._end
            index = bisect_right(self._starts, time) - 1
            piece = self._table[:, index].tolist()
            row = self._row = (self._starts[index], self._ends[index], *piece)
        start, _, s0, s1, s2, s3, s4, s5 = row
        t = time - start
        return PathStart(
            s0 + t * (s1 + t * (s2 + t * (s3 + t * (s4 + t * s5)))),
            s1 + t * (2.0 * s2 + t * (3.0 * s3 + t * (4.0 * s4 + t * (5.0 * s5)))),
            2.0 * s2 + t * (6.0 * s3 + t * (12.0 * s4 + t * (20.0 * s5))),
        )

    def until(self, time: float) -> PathPlan:
        """Return what is driven of it if another part goes on at a ``time``, a knot of it [s]."""
        return PathPlan(self.heights, PathScaling(self.scaling.until(time), time))

    def place(self, time: float) -> float:
        """Return how far along the path the platform is at a ``time`` [m]."""
        return self.on_path(time).place

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

    def check_limits(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Compare the bounds of the derivatives along the path with the limits.

        Args:
            limits: of the sliders.
            since: pieces that end before this time are past, and not checked [s].

        Raises:
            SliderLimitError: if a limit may be exceeded.
            PlanningError: if the platform would go back along the path, or too fast for it.
        """
        check_path_limits(self.heights, self.scaling, limits, since)

    def checks_inside(self, region: Workspace, _limits: SliderLimits) -> Iterable[Traced[None]]:
        """Check the path from where the plan begins."""
        at_once(check_place(self.heights.driven, region, float(self.scaling.ways[0])))
        return ()
