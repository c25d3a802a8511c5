"""Trajectories along a curve: a line or a path with a time scaling, and a blend onto it."""

from __future__ import annotations

from bisect import bisect_right
from itertools import groupby
from math import hypot, inf

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible, blocks
from tri_glide_kinematics.motion.limits import (
    SampledPlan,
    Series,
    SliderLimits,
    SliderState,
    composed,
    divided,
    heights_of,
    moved,
    polynomial,
    positions,
)
from tri_glide_kinematics.motion.path import check_place
from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan
from tri_glide_kinematics.motion.trajectory.curve_bounds import (
    Bounds,
    bounds_of,
    check_along,
    smooth_parts,
)
from tri_glide_kinematics.motion.trajectory.curves import Curve, PathHeights, StraightLine
from tri_glide_kinematics.motion.trajectory.time_scaling import PathStart, TimeScaling
from tri_glide_kinematics.motion.trajectory.trajectory import CELLS_AT_ONCE, MixedSeries, Trajectory
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, ascending
from tri_glide_kinematics.workspace import Workspace


class CurvePlan(Trajectory):
    """A curve with a time scaling, with or without a blend.

    Attributes:
        duration: time until all sliders rest [s].
        curve: where the platform moves.
        scaling: how far along it is at each time.
        blend: slider offsets that lead from the motion before onto the curve, or None.
    """

    is_along_curve = True

    def __init__(self, curve: Curve, scaling: TimeScaling, blend: CubicPlan | None = None) -> None:
        """Prepare the plan; the time scaling ends at rest or is continued, the blend ends at zero.

        Raises:
            ValueError: if the end is out of reach of an arm.
        """
        self.curve = curve
        self.scaling = scaling
        self.blend = blend
        self.duration = max(float(scaling.times[-1]), blend.duration if blend else 0.0)
        self._starts: list[float] = scaling.times[:-1].tolist()
        self._ends = [*self._starts[1:], self.duration]
        self._table = scaling.coefficients()
        # Of each piece, once it was asked for; see ``_piece``.
        self._rows: list[tuple[float, ...] | None] = [None] * len(self._starts)
        # The piece that was asked for last: the next instant is nearly always in the same.
        self._row: tuple[float, ...] = (0.0, 0.0)
        self._end = PathStart(*(float(values[-1]) for values in scaling[1:]))
        self._final = self._beside(curve.state(*self._end), self.duration)

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        row = self._row
        if not row[0] <= time < row[1]:
            if time >= self.duration:
                return self._final
            time = max(time, 0.0)
            row = self._piece(time)
        start, _, s0, s1, s2, s3, s4, s5, v1, v2, v3, v4, a1, a2, a3 = row
        t = time - start
        state = self.curve.state(
            s0 + t * (s1 + t * (s2 + t * (s3 + t * (s4 + t * s5)))),
            s1 + t * (v1 + t * (v2 + t * (v3 + t * v4))),
            v1 + t * (a1 + t * (a2 + t * a3)),
        )
        return state if self.blend is None else self._beside(state, time)

    def platform_at(self, machine: TriGlide, time: float) -> tuple[float, ...]:
        """Return how the platform moves at a ``time`` [s]; without a blend, the curve tells it."""
        if self.blend is not None and time < self.blend.duration:
            return super().platform_at(machine, time)
        return self.curve.platform(*self._along(time))

    def on_curve(self, time: float) -> PathStart:
        """Return place, speed and acceleration along the curve ``time`` seconds after the start."""
        return PathStart(*self._along(time))

    def _along(self, time: float) -> tuple[float, ...]:
        """Return the same as a plain tuple."""
        row = self._row
        if not row[0] <= time < row[1]:
            if time >= self.duration:
                return self._end
            time = time if time > 0.0 else 0.0
            row = self._piece(time)
        start, _, s0, s1, s2, s3, s4, s5, v1, v2, v3, v4, a1, a2, a3 = row
        t = time - start
        # As in ``at``, where a call for it would take a twentieth of the time.
        return (
            s0 + t * (s1 + t * (s2 + t * (s3 + t * (s4 + t * s5)))),
            s1 + t * (v1 + t * (v2 + t * (v3 + t * v4))),
            v1 + t * (a1 + t * (a2 + t * a3)),
        )

    def _piece(self, time: float) -> tuple[float, ...]:
        """Return begin and end of the piece of the scaling at a ``time`` [s]; its coefficients.

        Six of the way, then those of speed and acceleration that are not the same.
        """
        index = bisect_right(self._starts, time) - 1
        row = self._rows[index]
        if row is None:
            s0, s1, s2, s3, s4, s5 = self._table[:, index].tolist()
            of_speed = (2.0 * s2, 3.0 * s3, 4.0 * s4, 5.0 * s5)
            of_acceleration = (6.0 * s3, 12.0 * s4, 20.0 * s5)
            begin, end = self._starts[index], self._ends[index]
            row = (begin, end, s0, s1, s2, s3, s4, s5, *of_speed, *of_acceleration)
            self._rows[index] = row
        self._row = row
        return row

    def _beside(self, state: SliderState, time: float) -> SliderState:
        """Return a ``state`` on the curve with the offsets of the blend at a ``time`` [s]."""
        if self.blend is None:
            return state
        (h1, h2, h3), (v1, v2, v3), (a1, a2, a3) = state
        (dh1, dh2, dh3), (dv1, dv2, dv3), (da1, da2, da3) = self.blend.at(time)
        return SliderState(
            (h1 + dh1, h2 + dh2, h3 + dh3),
            (v1 + dv1, v2 + dv2, v3 + dv3),
            (a1 + da1, a2 + da2, a3 + da3),
        )

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        ways, speeds, accelerations = self.scaling.evaluate(times)
        height, first, second, _ = self.curve.derivatives(ways).heights
        sampled = SampledPlan(
            times,
            height.T,
            (first * speeds).T,
            (first * accelerations + second * speeds * speeds).T,
        )
        if self.blend is not None:
            for values, offsets in zip(sampled[1:], self.blend.sample(times)[1:]):
                values += offsets
        return sampled

    def check_sliders(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Compare the bounds of the derivatives along the curve with the limits.

        Args:
            limits: of the sliders.
            since: pieces that end before this time are past, and not checked [s].

        Raises:
            SliderLimitError: if a limit may be exceeded.
            PlanningError: if the platform would go back along the curve, or too fast for it.
        """
        check_along(self.curve, self.scaling, limits, blend=self.blend, since=since)

    def knots(self) -> FloatArray:
        """Return where pieces of the scaling, of the curve and of the blend begin, and the end."""
        knots = smooth_parts(self.curve, self.scaling).times
        if self.blend is None:
            return knots
        return ascending(np.concatenate((knots, self.blend.knots())))

    def mixed_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> MixedSeries:
        """Return Taylor series of the platform's position, in a blend of the slider heights."""
        way = self.way_series(times, half)
        return _mixed_series(self.curve, way, self.blend, machine, times, half)

    def way_series(self, times: FloatArray, half: FloatArray) -> Series:
        """Return Taylor series of the way along the curve; see ``mixed_series``."""
        return _way_series(self.scaling, self._table, times, half)


def _way_series(
    scaling: TimeScaling, table: FloatArray, times: FloatArray, half: FloatArray
) -> Series:
    """Return Taylor series of the way along a curve; ``table`` has the coefficients of the pieces.

    See ``Trajectory.mixed_series`` for the others.
    """
    last = float(scaling.times[-1])
    inside = np.clip(times, 0.0, last)
    index = np.searchsorted(scaling.times[:-1], inside, side="right") - 1
    coefficients = table[:, np.newaxis, index]
    ways = moved(coefficients, inside - np.take(scaling.times, index))
    ways[1:, 0, (times < 0.0) | (times >= last)] = 0.0
    return polynomial(ways, half)


def _mixed_series(
    curve: Curve,
    way: Series,
    blend: CubicPlan | None,
    machine: TriGlide,
    times: FloatArray,
    half: FloatArray,
) -> MixedSeries:
    """Return Taylor series of the platform's position, in a blend of the slider heights."""
    series = composed(curve.place_series(way.values[0, 0], half * way.bounds[1, 0]), way)
    in_blend = np.zeros(len(times), dtype=bool)
    if blend is not None:
        # Behind it the platform is on the curve.
        in_blend = times - half < blend.duration
        if in_blend.any():
            some = half[in_blend]
            on_curve = heights_of(machine.geometry, series.of(in_blend), some)
            series.put(in_blend, on_curve.plus(blend.height_series(times[in_blend], some)))
    return series, in_blend


def bounds_along(
    curve: Curve, scaling: TimeScaling, limits: SliderLimits, blend: CubicPlan | None = None
) -> Interruptible[Bounds]:
    """Return bounds for a platform that follows a curve, those of the added ones among them.

    Args:
        curve: where the platform moves.
        scaling: how far along it is at each time.
        limits: whose added bounds count.
        blend: offsets of the sliders that are added to them.
    """
    parts = smooth_parts(curve, scaling)
    bounds = bounds_of(parts, curve.in_parts(parts.ways), blend)
    return (yield from with_added(bounds, curve, scaling, parts.times, limits, blend))


def with_added(
    bounds: Bounds,
    curve: Curve,
    scaling: TimeScaling,
    knots: FloatArray,
    limits: SliderLimits,
    blend: CubicPlan | None = None,
) -> Interruptible[Bounds]:
    """Return ``bounds`` in the pieces of a ``scaling`` with the parts of the added ones.

    Between two ``knots`` [s] the curve is smooth, and so is the scaling.
    """
    if not limits.added:
        return bounds
    if blend is not None:
        knots = ascending(np.concatenate((knots, blend.knots())))
        knots = knots[knots <= scaling.times[-1]]
    yield
    table = scaling.coefficients()
    middles, half = divided(knots)
    pieces = np.searchsorted(scaling.times, middles, side="right") - 1
    added = np.zeros((len(limits.added), len(scaling.times) - 1))
    for some in blocks(len(middles), CELLS_AT_ONCE):
        if some.start:
            yield
        cells = half[some]
        way = _way_series(scaling, table, middles[some], cells)
        for machine, bounded in groupby(zip(limits.added, added), lambda each: each[0].machine):
            mixed = _mixed_series(curve, way, blend, machine, middles[some], cells)
            series = positions(machine, *mixed, cells)
            for bound, used in bounded:
                yield
                # NaN, where a blend leads out of reach, stays.
                with np.errstate(invalid="ignore"):
                    np.maximum.at(used, pieces[some], bound.used(series, cells).most)
    return bounds._replace(added=added)


class LinePlan(CurvePlan):
    """A straight line with a time scaling.

    Attributes:
        line: where the platform moves.
    """

    def __init__(
        self, line: StraightLine, scaling: TimeScaling, blend: CubicPlan | None = None
    ) -> None:
        """Prepare the plan as a ``CurvePlan`` is.

        Raises:
            ArmTooShortError: if the end is out of reach of an arm, as that of a braking may be.
        """
        line.heights_at(float(scaling.ways[-1]))
        super().__init__(line, scaling, blend)
        self.line = line

    @property
    def straight_from(self) -> float:
        """From when on the platform is on the line: the end of the blend [s]."""
        return 0.0 if self.blend is None else self.blend.duration

    def checking_inside(self, region: Workspace, limits: SliderLimits) -> Interruptible[None]:
        """Check the line, and the way beside it if there is one."""
        if self.line.known_inside is not region:
            end = self.line.point(float(self.scaling.ways[-1]))
            yield
            yield from region.segment_check(self.line.start, end)
        # A plan that begins at rest has none, as that of the setpoint before the first step.
        if self.blend is None or self.blend.duration == 0.0:
            return
        duration = self.blend.duration
        times = self.scaling.times[: np.searchsorted(self.scaling.times, duration) + 1]
        heights = self.sample(times).heights
        # A slider can move this far beyond both ends of a piece under its largest acceleration.
        excess = np.square(np.diff(times)).max() / 8.0 * np.array(limits.acceleration)
        self.check_travel(heights.min(axis=0) - excess, heights.max(axis=0) + excess, region)
        yield
        yield from region.path_check(self.at, duration, hypot(*limits.acceleration))


class PathPlan(CurvePlan):
    """A part of a path with a time scaling that ends at rest, or where another part goes on.

    Attributes:
        heights: of the sliders on the path.
        continue_at: when the next part should begin; at the end of this one if that is a stop [s].
        ends_path: whether it leads to the end of the path.
    """

    def __init__(
        self, heights: PathHeights, scaling: TimeScaling, continue_at: float = inf
    ) -> None:
        """Prepare the plan of a part of a path; without a ``continue_at`` [s] it ends at a stop."""
        super().__init__(heights, scaling)
        self.heights = heights
        self.ends_path = self.ends_at >= heights.driven.length
        self.continue_at = min(continue_at, self.duration)

    @property
    def ends_at(self) -> float:
        """Place on the path at which it comes to rest [m]."""
        return self._end.place

    def until(self, time: float) -> PathPlan:
        """Return what is driven of it if another part goes on at a ``time``, a knot of it [s]."""
        return PathPlan(self.heights, self.scaling.until(time), time)

    def delayed(self, delay: float) -> PathPlan:
        """Return the same after ``delay`` seconds of rest where it begins; it begins at rest."""
        return PathPlan(self.heights, self.scaling.delayed(delay), self.continue_at + delay)

    def place(self, time: float) -> float:
        """Return how far along the path the platform is at a ``time`` [m]."""
        return self.on_curve(time).place

    def moved_to(self, heights: PathHeights, time: float) -> PathPlan:
        """Return what is left at a ``time`` [s], on a path that is the same as far as it leads."""
        left = self.scaling.since(time)
        return PathPlan(heights, left._replace(times=left.times - time), self.continue_at - time)

    def checking_inside(self, region: Workspace, _limits: SliderLimits) -> Interruptible[None]:
        """Check the path from where the plan begins."""
        yield from check_place(self.heights.driven, region, float(self.scaling.ways[0]))
