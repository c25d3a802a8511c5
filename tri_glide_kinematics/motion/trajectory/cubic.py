"""Trajectories of constant jerk in each of their pieces, and the certified step of tracking."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, pairwise

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import SliderLimitError
from tri_glide_kinematics.motion.limits import (
    AT_REST,
    QUANTITIES,
    RELATIVE_ROUNDING,
    SampledPlan,
    Series,
    SliderLimits,
    SliderState,
    moved,
    new_state,
    polynomial,
    resting,
)
from tri_glide_kinematics.motion.trajectory.phases import (
    Phases,
    after,
    merged,
    total_duration,
)
from tri_glide_kinematics.motion.trajectory.trajectory import MixedSeries, Trajectory
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Workspace

# Breakpoints of two sliders closer than this are one: a jerk this long is below rounding [s].
SAME_TIME = 1e-11


class CubicPlan(Trajectory):
    """Constant jerk in each piece, as ruckig plans it.

    Attributes:
        duration: time until all sliders rest [s].
    """

    def __init__(self, initial: SliderState, jerks: Sequence[Phases]) -> None:
        """Integrate the jerks.

        Args:
            initial: state at the start.
            jerks: for each slider (duration [s], jerk [m/s^3]), one phase after the other. The
                last of them leaves the slider at rest.
        """
        sliders = [SliderProfile(*values) for values in zip(*initial, jerks)]
        starts = [0.0]
        for time in sorted(time for slider in sliders for time in slider.starts):
            if time - starts[-1] > SAME_TIME:
                starts.append(time)
        rows: list[tuple[float, ...]] = []
        for start, end in pairwise(starts):
            first, second, third = (slider.at(start, 0.5 * (start + end)) for slider in sliders)
            rows.append((start, end, *first, *second, *third))
        # What steps read, which along a straight way is something else, and what the sliders do.
        self._rows = rows
        self._pieces = rows
        # The piece that was asked for last: the next instant is nearly always in the same.
        self._row = self._rows[0] if rows else (0.0,) * 14
        self.duration = starts.pop()
        self._starts = starts if rows else []
        h1, h2, h3 = (slider.final_height for slider in sliders)
        self._final = SliderState((h1, h2, h3), AT_REST, AT_REST)
        # The platform's place at rest, once it was asked for.
        self._final_platform: tuple[float, ...] | None = None

    @cached_property
    def starts(self) -> FloatArray:
        """Where each piece begins, ascending from 0. Shape (k,) [s]."""
        return np.array(self._starts)

    @cached_property
    def lengths(self) -> FloatArray:
        """How long each piece is. Shape (k,) [s]."""
        return self.pieces_since(0.0)[0]

    @cached_property
    def pieces(self) -> FloatArray:
        """Height, velocity, acceleration and jerk where each piece begins. Shape (4, k, 3)."""
        return self.pieces_since(0.0)[1]

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        start, end, h1, v1, a1, j1, h2, v2, a2, j2, h3, v3, a3, j3 = self._row
        if time < start or time >= end:
            time = max(time, 0.0)
            if time >= self.duration:
                return self._final
            row = self._row = self._rows[bisect_right(self._starts, time) - 1]
            start, end, h1, v1, a1, j1, h2, v2, a2, j2, h3, v3, a3, j3 = row
        # The cubic of ``phases.after``, unrolled: calls for each slider take twice as long.
        t = time - start
        half, sixth = 0.5 * t, t / 6.0
        b1, b2, b3 = a1 + j1 * t, a2 + j2 * t, a3 + j3 * t
        s1, s2, s3 = a1 + b1, a2 + b2, a3 + b3
        return new_state(
            SliderState,
            (
                (
                    h1 + t * (v1 + sixth * (a1 + s1)),
                    h2 + t * (v2 + sixth * (a2 + s2)),
                    h3 + t * (v3 + sixth * (a3 + s3)),
                ),
                (v1 + half * s1, v2 + half * s2, v3 + half * s3),
                (b1, b2, b3),
            ),
        )

    def platform_at(self, machine: TriGlide, time: float) -> tuple[float, ...]:
        """Return how the platform moves at a ``time`` [s]; the rest at the end is remembered."""
        if time < self.duration:
            return machine.forward_motion(*self.at(time))
        if self._final_platform is None:
            self._final_platform = machine.forward_motion(*self._final)
        return self._final_platform

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        if not self._rows:
            return SampledPlan(times, *(np.tile(values, (len(times), 1)) for values in self._final))
        inside = np.maximum(times, 0.0)
        index = np.searchsorted(self.starts, inside, side="right") - 1
        t = np.minimum(inside - self.starts[index], self.lengths[index])[:, np.newaxis]
        sampled = SampledPlan(times, *after(t, *self.pieces[:, index]))
        ended = times >= self.duration
        for values, final in zip(sampled[1:], self._final):
            values[ended] = final
        return sampled

    def pieces_since(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return ``lengths`` and ``pieces`` of what is left of the plan at ``time`` [s]."""
        table = np.array(self._left(time)).reshape(-1, 14)
        return table[:, 1] - table[:, 0], table[:, 2:].reshape(-1, 3, 4).transpose(2, 0, 1)

    def _left(self, time: float) -> list[tuple[float, ...]]:
        """Return begin, end and twelve numbers of each piece that is left at a ``time`` [s]."""
        if time <= 0.0:
            return self._pieces
        if time >= self.duration:
            return []
        first, *others = self._pieces[bisect_right(self._starts, time) - 1 :]
        sliders = zip(*self.at(time), first[5::4])
        return [(time, first[1], *chain.from_iterable(sliders)), *others]

    def knots(self) -> FloatArray:
        """Return where pieces begin, and the end [s]."""
        return np.append(self.starts, self.duration)

    def height_series(self, times: FloatArray, half: FloatArray) -> Series:
        """Return Taylor series of the slider heights; the arguments are as of the platform's."""
        coefficients = np.zeros((4, 3, len(times)))
        if self._rows:
            inside = np.clip(times, 0.0, self.duration)
            index = np.searchsorted(self.starts, inside, side="right") - 1
            height, velocity, acceleration, jerk = self.pieces[:, index].transpose(0, 2, 1)
            pieces = np.array((height, velocity, acceleration / 2.0, jerk / 6.0))
            coefficients = moved(pieces, inside - self.starts[index])
            coefficients[1:, :, (times < 0.0) | (times >= self.duration)] = 0.0
        ended = times >= self.duration if self._rows else np.ones(len(times), dtype=bool)
        coefficients[0, :, ended] = self._final.heights
        return polynomial(coefficients, half)

    def mixed_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> MixedSeries:
        """Return Taylor series of the slider heights; at rest, of the platform's position."""
        if not self._rows:
            place = machine.forward_batch(np.array((self._final.heights,)))[0]
            return resting(place, len(times)), np.zeros(len(times), dtype=bool)
        return self.height_series(times, half), np.ones(len(times), dtype=bool)

    def check_sliders(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Compare the exact extremes with the limits.

        Args:
            limits: of the sliders.
            since: what lies before this time is past, and not checked [s].

        Raises:
            SliderLimitError: if a limit is exceeded by more than rounding.
        """
        left = self._left(since)
        if not left:
            return
        # Of a few numbers, for which numpy takes several times as long.
        sliders = [_peaks([(row[1] - row[0], *row[i : i + 3]) for row in left]) for i in (3, 7, 11)]
        bounds = (limits.velocity, limits.acceleration, limits.jerk)
        for (quantity, unit), peak, bound in zip(QUANTITIES, zip(*sliders), bounds):
            for slider in range(3):
                if not peak[slider] <= bound[slider] * (1.0 + RELATIVE_ROUNDING):
                    raise SliderLimitError(quantity, slider, peak[slider], bound[slider], unit)

    def height_extremes(self, since: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Return the lowest and the highest height of each slider from ``since`` [s] to the end.

        They are at the ends of a piece or where the velocity, a quadratic of time, passes zero.

        Returns:
            Two arrays, each of shape (3,) [m].
        """
        final = np.array(self.at(self.duration).heights)[np.newaxis]
        lengths, (height, velocity, acceleration, jerk) = self.pieces_since(since)
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(acceleration * acceleration - 2.0 * jerk * velocity)
            sum_of_terms = -(acceleration + np.copysign(root, acceleration))
            turnings = np.stack((sum_of_terms / jerk, 2.0 * velocity / sum_of_terms))
            inside = (turnings > 0.0) & (turnings < lengths[:, np.newaxis])
        time = np.where(inside, turnings, 0.0)
        turns, _, _ = after(time, height, velocity, acceleration, jerk)
        heights = np.concatenate((final, height, *turns))
        return heights.min(axis=0), heights.max(axis=0)

    def checking_inside(self, region: Workspace, _limits: SliderLimits) -> Interruptible[None]:
        """Check travel, and all of the way."""
        self.check_travel(*self.height_extremes(), region)
        # Accelerations are largest where pieces begin.
        peaks = np.abs(self.pieces[2]).max(axis=0, initial=0.0)
        largest = math.hypot(*peaks.tolist())
        yield
        yield from region.path_check(self.at, self.duration, largest)


def _peaks(pieces: Sequence[tuple[float, ...]]) -> list[float]:
    """Return the largest velocity, acceleration and jerk of a slider.

    Args:
        pieces: how long each is [s], and velocity, acceleration and jerk where it begins.
    """
    velocities: list[float] = []
    accelerations: list[float] = []
    for time, v, a, jerk in pieces:
        _, end_velocity, end_acceleration = after(time, 0.0, v, a, jerk)
        velocities += abs(v), abs(end_velocity)
        accelerations += abs(a), abs(end_acceleration)
        if a * end_acceleration < 0.0:
            velocities.append(abs(v - a * a / (2.0 * jerk)))
    jerks = [abs(jerk) for *_, jerk in pieces]
    # Of numbers that are not finite the sum is none, either, and then the peak is NaN.
    return [max(some) + 0.0 * sum(some) for some in (velocities, accelerations, jerks)]


class SliderProfile:
    """One slider in phases of constant jerk, and its rest behind them.

    Attributes:
        starts: when each phase begins that takes some time, and the end. Shape (k + 1,) [s].
        final_height: where it rests [m].
    """

    def __init__(self, height: float, velocity: float, acceleration: float, phases: Phases) -> None:
        """Integrate the ``phases`` from a state on."""
        time = 0.0
        state = height, velocity, acceleration
        self.starts: list[float] = []
        self._pieces: list[tuple[float, float, float, float]] = []
        for duration, jerk in phases:
            if duration <= 0.0:
                continue
            self.starts.append(time)
            self._pieces.append((*state, jerk))
            time += duration
            state = after(duration, *state, jerk)
        self.starts.append(time)
        # The residual velocity and acceleration of ruckig's last phase are below 1e-10; they end
        # here. Its residual height is kept: correcting it would be a step.
        self.final_height = state[0]
        self._pieces.append((self.final_height, 0.0, 0.0, 0.0))

    def at(self, time: float, inside: float) -> tuple[float, float, float, float]:
        """Return the state at ``time`` in the phase to which the instant ``inside`` belongs."""
        index = bisect_right(self.starts, inside) - 1
        height, velocity, acceleration, jerk = self._pieces[index]
        return (*after(time - self.starts[index], height, velocity, acceleration, jerk), jerk)


class StraightPlan(CubicPlan):
    """From rest to rest; each slider moves by a constant ratio to a leading one.

    The pieces are those of any ``CubicPlan``, but a setpoint takes one cubic instead of three.

    Attributes:
        length: way of the leading slider [m].
    """

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
        # ``at`` takes the leader's velocity, half its acceleration and three times its way,
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

    def checking_inside(self, region: Workspace, _limits: SliderLimits) -> Interruptible[None]:
        """Check travel, and all of the way."""
        # From rest to rest no slider turns.
        lowest, highest = zip(*map(sorted, zip(self._heights, self._final.heights)))
        self.check_travel(lowest, highest, region)
        # Over the way there is no acceleration, whatever there is over time.
        yield
        yield from region.path_check(self.at_way, self.length, 0.0)

    def at_way(self, distance: float) -> SliderState:
        """Return place and motion after ``distance`` [m] of the leading slider, at its 1 m/s."""
        (h1, h2, h3), (x, y, z) = self._heights, self._directions
        heights = (h1 + distance * x, h2 + distance * y, h3 + distance * z)
        return SliderState(heights, self._directions, AT_REST)

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        start, end, v0, w0, b0, j, h1, h2, h3, s1, s2, s3, k1, k2, k3, d1, d2, d3 = self._row
        if time < start or time >= end:
            time = max(time, 0.0)
            if time >= self.duration:
                return self._final
            row = self._row = self._rows[bisect_right(self._starts, time) - 1]
            start, end, v0, w0, b0, j, h1, h2, h3, s1, s2, s3, k1, k2, k3, d1, d2, d3 = row
        # The cubic of ``phases.after``, unrolled for the leader.
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


@dataclass(eq=False, repr=False, slots=True)
class TrackedStep(Trajectory):
    """A certified plan: one step, then a braking to rest.

    As a rule the next cycle replaces the plan after its step. So only the state after the step is
    at hand; all of the plan is worked out when something else is asked for.

    Attributes:
        start: state in which the step begins.
        after: state after the step.
        period: of the step [s].
        ways: phases of each slider, of the step and of the braking.
        duration: of the longest way: time from the start until all sliders rest [s].
    """

    start: SliderState
    after: SliderState
    period: float
    ways: Sequence[Phases]
    duration: float
    _cubic: CubicPlan | None = field(default=None, init=False)

    @property
    def ends_at_rest(self) -> bool:
        """Whether nothing moves after the step."""
        return self.duration <= self.period and not any(
            (*self.after.velocities, *self.after.accelerations)
        )

    def as_cubic(self) -> CubicPlan:
        """Return all of the plan in pieces of constant jerk."""
        if self._cubic is None:
            self._cubic = CubicPlan(self.start, self.ways)
        return self._cubic

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        if time == self.period:
            return self.after
        return self.as_cubic().at(time) if time > 0.0 else self.start

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        return self.as_cubic().sample(times)

    def check_sliders(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Compare the exact extremes with the limits, as a ``CubicPlan`` does."""
        self.as_cubic().check_sliders(limits, since)

    def checking_inside(self, region: Workspace, limits: SliderLimits) -> Interruptible[None]:
        """Check travel, and all of the way, as a ``CubicPlan`` does."""
        return self.as_cubic().checking_inside(region, limits)

    def knots(self) -> FloatArray:
        """Return where pieces begin, and the end [s]."""
        return self.as_cubic().knots()

    def mixed_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> MixedSeries:
        """Return Taylor series of the slider heights."""
        return self.as_cubic().mixed_series(machine, times, half)


def lasting(phases: Phases, blend: CubicPlan | None) -> Phases:
    """Return ``phases`` that end no sooner than the ``blend``, by standing still at the end."""
    missing = blend.duration - total_duration(phases) if blend else 0.0
    return [*phases, (missing, 0.0)] if missing > 0.0 else phases


def with_knots_of(times: list[float], blend: CubicPlan | None, shortest: float) -> list[float]:
    """Return ``times`` and the times at which ``blend`` changes its jerk, none too close [s]."""
    if blend is None:
        return times
    return merged(times, [*blend.starts.tolist(), blend.duration], shortest)
