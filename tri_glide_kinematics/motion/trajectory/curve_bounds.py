r"""Upper bounds of velocity, acceleration and jerk of the sliders along a straight line or a path.

Between two knots the way s(t) is a quintic, so its derivatives are bounded by their Bernstein
control points. The fifth derivative of the slider heights h(s(t)) is then at most

$$|h^{(5)}| |\dot s|^5 + 10 |h^{(4)}| |\dot s|^3 |\ddot s|
+ |h'''| (15 |\dot s| \ddot s^2 + 10 \dot s^2 |s^{(3)}|)
+ |h''| (10 |\ddot s| |s^{(3)}| + 5 |\dot s| |s^{(4)}|) + |h'| |s^{(5)}| = C,$$

and inside a piece of length $\Delta$ the jerk leaves the straight line between its values at the
ends by at most $\Delta^2 C / 8$. Its change along the piece is $\delta$, so its slope nowhere
exceeds $\delta / \Delta + \Delta C$, and the acceleration leaves the straight line between its own
values by at most $\Delta^2 / 8$ times that. The velocity exceeds its values at the ends only as far
as this allows: by the area that the acceleration encloses before it changes its sign, or after,
which is at most a quarter of $\Delta$ times the weaker one of both accelerations.

On a straight line the derivatives of h(s) are bounded by their values at both ends of the piece:
the rise of an arm is concave, so that slopes are monotone and the rise is least at an end.

The fifth derivative along a path exists in parts in which the path is smooth: the pieces of the
time scaling are divided where the path has a break. In such a part the fifth derivative of p(s) has
a constant magnitude (a cubic or quartic, and on arcs a circular motion), so the lower ones are
bounded by what they are at the ends and by half the length of the part times the bound of the next
one. With $x = R R'$, $g = R'$ these bound $x' \dots x^{(4)}$ by the triangle inequality, and so
$g' \dots g^{(4)}$; the rise of an arm is not less than $R^2$ at the ends allows, less an eighth of
the squared length times its second derivative.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.errors import PlanningError, SliderLimitError
from tri_glide_kinematics.motion.limits import QUANTITIES, RELATIVE_ROUNDING, SliderLimits
from tri_glide_kinematics.motion.trajectory import quintics
from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan
from tri_glide_kinematics.motion.trajectory.curves import Curve, CurveParts
from tri_glide_kinematics.motion.trajectory.time_scaling import TimeScaling
from tri_glide_kinematics.vectors import FloatArray, Indices

# Speed against the direction of a line or a path that is rounding [m/s].
NO_BACKWARD_SPEED = 1e-8

# A break this near to a knot, as a part of the length of the piece, is at the knot.
_AT_KNOT = 1e-9

# Steps of the search for the instant at which a break is passed, and how exact it is, as a part of
# the longest piece.
_INSTANT = 1e-11
_HALLEY_STEPS = 40

# Parts that are looked at together, about: few together cost nearly as much as many.
_BLOCK = 160


class Bounds(NamedTuple):
    """Upper bounds of absolute values in each piece of a time scaling.

    Attributes:
        velocity: of the sliders. Shape (3, k) [m/s].
        acceleration: of the sliders. Shape (3, k) [m/s^2].
        jerk: of the sliders. Shape (3, k) [m/s^3].
        platform: part of the largest speed of the platform. Shape (k,).
        backwards: largest speed against the direction of the curve [m/s].
        added: parts of the m added bounds that are used; None without one. Shape (m, k).
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    platform: FloatArray
    backwards: float
    added: FloatArray | None = None

    @classmethod
    def joined(cls, blocks: Iterable[Bounds]) -> Bounds:
        """Return the bounds in all pieces of some blocks, one after the other."""
        first, *others = blocks
        if not others:
            return first
        blocks = (first, *others)
        velocity, acceleration, jerk, platform, backwards, added = zip(*blocks)
        return cls(
            np.concatenate(velocity, axis=1),
            np.concatenate(acceleration, axis=1),
            np.concatenate(jerk, axis=1),
            np.concatenate(platform),
            max(backwards),
            None if first.added is None else np.concatenate(added, axis=1),
        )

    def parts(self, limits: SliderLimits) -> FloatArray:
        """Return the largest parts of the limits in each piece.

        Returns:
            Of velocities, accelerations and jerks; the largest of what scales like one of them.
            Shape (3, k).
        """
        table = np.array(self[:3]) / limits.table[..., np.newaxis]
        result = table.max(axis=1)
        np.maximum(result[0], self.platform, out=result[0])
        if self.added is not None:
            for bound, used in zip(limits.added, self.added):
                row = result[bound.order - 1]
                np.maximum(row, used, out=row)
        return np.asarray(result)

    def slowdown(self, limits: SliderLimits) -> FloatArray:
        """Return by which factor each piece has to be slower for all limits to hold. Shape (k,).

        It is exact for a whole plan from rest to rest: in n times the time, velocities are divided
        by n, accelerations by n^2 and jerks by n^3.
        """
        velocity, acceleration, jerk = self.parts(limits)
        return np.asarray(np.maximum(np.maximum(velocity, np.sqrt(acceleration)), np.cbrt(jerk)))

    def check(
        self, times: FloatArray, limits: SliderLimits, above: float = RELATIVE_ROUNDING
    ) -> None:
        """Compare the bounds with the limits.

        Args:
            times: at which the pieces begin. Shape (k + 1,) [s].
            limits: of the sliders.
            above: part by which the bound of the platform's speed may exceed what a path asks for.

        Raises:
            SliderLimitError: if a limit may be exceeded.
            AddedBoundError: if an added bound may be.
            PlanningError: if the platform would go back along the curve, or too fast for it.
        """
        if not self.backwards <= NO_BACKWARD_SPEED:
            raise PlanningError("the platform cannot stop in time, and would go back")
        for (quantity, unit), values, bound in zip(QUANTITIES, self[:3], limits.table):
            ratios = values / bound[:, np.newaxis]
            slider, piece = divmod(int(ratios.argmax()), ratios.shape[1])
            if not ratios[slider, piece] <= 1.0 + RELATIVE_ROUNDING:
                value, time = float(values[slider, piece]), float(times[piece])
                raise SliderLimitError(quantity, slider, value, float(bound[slider]), unit, time)
        for added, used in zip(limits.added, () if self.added is None else self.added):
            piece = int(used.argmax())
            if not used[piece] <= 1.0 + RELATIVE_ROUNDING:
                raise added.error(float(used[piece]), float(times[piece]))
        fastest = float(self.platform.max())
        if not fastest <= 1.0 + above:
            text = f"the platform would be {fastest:.6g} times as fast as the path asks for"
            raise PlanningError(text)


def derivative_bounds(curve: Curve, scaling: TimeScaling, blend: CubicPlan | None = None) -> Bounds:
    """Return bounds for a platform that follows a ``curve`` with a time ``scaling``.

    Where an arm might not reach they are NaN.

    Args:
        curve: where the platform moves.
        scaling: how far along it is at each time.
        blend: offsets of the sliders that are added to them.
    """
    parts = smooth_parts(curve, scaling)
    return bounds_of(parts, curve.in_parts(parts.ways), blend)


def check_along(
    curve: Curve,
    scaling: TimeScaling,
    limits: SliderLimits,
    *,
    blend: CubicPlan | None = None,
    since: float = 0.0,
    above: float = RELATIVE_ROUNDING,
) -> None:
    """Compare the bounds of the derivatives along a curve with the limits.

    Args:
        curve: where the platform moves.
        scaling: how far along it is at each time.
        limits: of the sliders.
        blend: offsets of the sliders that are added to them.
        since: pieces that end before this time are past, and not checked [s].
        above: part by which the bound of the platform's speed may exceed what a path asks for.

    Raises:
        SliderLimitError: if a limit may be exceeded.
        PlanningError: if the platform would go back along the curve, or too fast for it.
    """
    scaling = scaling.since(since)
    # A braking may lead out of reach; the NaN that this gives fails every comparison.
    with np.errstate(invalid="ignore"):
        bounds = Bounds.joined(
            derivative_bounds(curve, block, blend) for block in blocks(curve, scaling)
        )
    bounds.check(scaling.times, limits, above)


def blocks(curve: Curve, scaling: TimeScaling) -> Iterator[TimeScaling]:
    """Yield the pieces of a time scaling in blocks, of each of which bounds are found soon."""
    count = len(scaling.times) - 1
    first, last = curve.breaks.searchsorted((scaling.ways[0], scaling.ways[-1]))
    size = max(_BLOCK * count // (count + int(last - first)), 1)
    if size >= count:
        yield scaling
        return
    for begin in range(0, count, size):
        yield TimeScaling(*(values[begin : begin + size + 1] for values in scaling))


class SmoothParts(NamedTuple):
    """Parts of the pieces of a time scaling in each of which the curve is smooth.

    What is given at both ends is given where all parts begin, and then where all end.

    Attributes:
        piece: of the time scaling, ascending. Shape (m,).
        times: at which parts begin, and the end. Shape (m + 1,) [s].
        durations: Shape (m,) [s].
        ways: at both ends. Shape (2 m,) [m].
        speeds: likewise [m/s].
        accelerations: likewise [m/s^2].
        jerks: likewise [m/s^3].
        orders: largest absolute derivatives of the way by time in each piece, from first to fifth.
            Each of the shape (m,).
        backwards: largest speed against the direction of the curve [m/s].
    """

    piece: Indices
    times: FloatArray
    durations: FloatArray
    ways: FloatArray
    speeds: FloatArray
    accelerations: FloatArray
    jerks: FloatArray
    orders: tuple[FloatArray, ...]
    backwards: float


def smooth_parts(curve: Curve, scaling: TimeScaling) -> SmoothParts:
    """Return the parts of the pieces of a time ``scaling`` between breaks of a ``curve``."""
    times, ways, speeds, accelerations = scaling
    dt = times[1:] - times[:-1]
    square = dt * dt
    cube = square * dt
    points = quintics.derivative_control_points(dt, ways, speeds, accelerations)
    speed_points = points[:5] / dt
    largest = np.abs(points)
    orders = (
        np.abs(speed_points).max(axis=0),
        largest[5:9].max(axis=0) / square,
        largest[9:12].max(axis=0) / cube,
        largest[12:14].max(axis=0) / (square * square),
        largest[14] / (square * cube),
    )
    backwards = -min(float(speed_points.min()), 0.0)
    if not len(curve.breaks):
        jerks = (points[9:12:2] / cube).ravel()
        ways, speeds, accelerations = (
            np.concatenate((values[:-1], values[1:])) for values in scaling[1:]
        )
        motion = (ways, speeds, accelerations, jerks)
        return SmoothParts(np.arange(len(dt)), times, dt, *motion, orders, backwards)
    coefficients = scaling.coefficients()
    piece, begin, end, from_way, to_way = _divided(curve.breaks, scaling, dt, coefficients)
    inside = np.concatenate((begin, end))
    both = np.concatenate((coefficients[:, piece],) * 2, axis=1)
    _, speeds, accelerations = quintics.evaluate(both, inside)
    return SmoothParts(
        piece,
        np.append(times[piece] + begin, times[-1]),
        end - begin,
        np.concatenate((from_way, to_way)),
        speeds,
        accelerations,
        6.0 * both[3] + inside * (24.0 * both[4] + inside * 60.0 * both[5]),
        tuple(order[piece] for order in orders),
        backwards,
    )


def _divided(
    breaks: FloatArray, scaling: TimeScaling, dt: FloatArray, coefficients: FloatArray
) -> tuple[Indices, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the parts of the pieces of a time scaling between ``breaks`` of a curve.

    Returns:
        Piece, time since that began where the part begins and where it ends [s], and the way there
        [m]. Each of the shape (m,).
    """
    ways = scaling.ways
    count = len(dt)
    slack = _AT_KNOT * (ways[1:] - ways[:-1])
    firsts = np.searchsorted(breaks, ways[:-1] + slack, "right")
    numbers = np.maximum(np.searchsorted(breaks, ways[1:] - slack, "left") - firsts, 0)
    owners = np.repeat(np.arange(count), numbers)
    offsets = np.arange(len(owners)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    inside = breaks[firsts[owners] + offsets]
    passed = _instants(inside, coefficients[:, owners], dt[owners])
    # All begins, in order: where each piece begins, and after it the breaks in it.
    piece = np.repeat(np.arange(count), numbers + 1)
    begin, from_way = np.zeros(len(piece)), np.empty(len(piece))
    at_knots = np.arange(count) + np.cumsum(numbers) - numbers
    at_breaks = np.arange(len(owners)) + owners + 1
    from_way[at_knots] = ways[:-1]
    from_way[at_breaks], begin[at_breaks] = inside, passed
    end, to_way = np.empty(len(piece)), np.empty(len(piece))
    end[:-1], to_way[:-1] = begin[1:], from_way[1:]
    lasts = at_knots + numbers
    end[lasts], to_way[lasts] = dt, ways[1:]
    return piece, begin, end, from_way, to_way


def _instants(ways: FloatArray, coefficients: FloatArray, dt: FloatArray) -> FloatArray:
    """Return when quintics pass ``ways``, by Halley's method between bounds. Shape (n,) [s]."""
    if not len(ways):
        return np.empty(0)
    low, high = np.zeros(len(ways)), dt.copy()
    begin, end = coefficients[0], quintics.evaluate(coefficients, dt)[0]
    # As at a constant speed.
    time = np.clip((ways - begin) / (end - begin), 0.0, 1.0) * dt
    tolerance = _INSTANT * float(dt.max())
    for _ in range(_HALLEY_STEPS):
        value, slope, second = quintics.evaluate(coefficients, time)
        miss = value - ways
        before = miss < 0.0
        low, high = np.where(before, time, low), np.where(before, high, time)
        with np.errstate(divide="ignore", invalid="ignore"):
            better = time - 2.0 * miss * slope / (2.0 * slope * slope - miss * second)
        found = np.abs(better - time) <= tolerance
        if found.all():
            break
        sane = (better > low) & (better < high)
        # A time that is found stays: the next step would be one of rounding, out of the bounds.
        time = np.where(found, time, np.where(sane, better, 0.5 * (low + high)))
    return np.asarray(time)


def bounds_of(parts: SmoothParts, seen: CurveParts, blend: CubicPlan | None = None) -> Bounds:
    """Return the bounds in the pieces that some parts belong to; see ``derivative_bounds``.

    Args:
        parts: of the pieces.
        seen: what the curve is like in them.
        blend: offsets of the sliders that are added to them.
    """
    count = len(parts.piece)
    speeds, accelerations = parts.speeds, parts.accelerations
    first, second, third = seen.at_ends
    squared = speeds * speeds
    ends = np.array(
        (
            first * speeds,
            first * accelerations + second * squared,
            first * parts.jerks
            + second * (3.0 * speeds * accelerations)
            + third * (squared * speeds),
        )
    ).reshape(3, 3, 2, count)
    change = np.abs(ends[2, :, 1] - ends[2, :, 0])
    if blend is not None:
        _add_blend(blend, parts.times, ends)
    magnitudes = np.abs(ends)
    # Of velocities, accelerations and jerks.
    largest = magnitudes.max(axis=2)
    weaker = magnitudes[1].min(axis=1)
    turning = ends[1, :, 0] * ends[1, :, 1] < 0.0
    d1, d2, d3, d4, d5 = parts.orders
    h1, h2, h3, h4, h5 = seen.by_way
    d11 = d1 * d1
    fifth = (
        h5 * (d11 * d11 * d1)
        + h4 * (10.0 * d11 * d1 * d2)
        + h3 * (15.0 * d1 * d2 * d2 + 10.0 * d11 * d3)
        + h2 * (10.0 * d2 * d3 + 5.0 * d1 * d4)
        + h1 * d5
    )
    # How far acceleration and jerk may exceed their values at the ends.
    dt = parts.durations
    eighth = 0.125 * dt * dt
    of_jerk = fifth * eighth
    of_acceleration = (0.125 * change + of_jerk) * dt
    largest[0] += (of_acceleration + 0.25 * weaker * turning) * dt
    largest[1] += of_acceleration
    largest[2] += of_jerk
    platform = np.zeros(count)
    if seen.platform is not None:
        rates, (p1, p2, p3), speed_limits = seen.platform
        # Its velocity leaves the straight line between its values by its jerk alone.
        of_speed = (p1 * d3 + 3.0 * p2 * d1 * d2 + p3 * d11 * d1) * eighth
        fastest = np.abs(rates * speeds).reshape(2, count).max(axis=0) + of_speed
        platform = fastest / speed_limits
    if parts.piece[-1] + 1 < count:
        firsts = np.flatnonzero(np.diff(parts.piece, prepend=-1))
        largest = np.maximum.reduceat(largest, firsts, axis=2)
        platform = np.maximum.reduceat(platform, firsts)
    return Bounds(largest[0], largest[1], largest[2], platform, parts.backwards)


def _add_blend(blend: CubicPlan, times: FloatArray, ends: FloatArray) -> None:
    """Add the blend to velocity, acceleration and jerk at both ends of each piece.

    Args:
        blend: offsets of the sliders.
        times: of the knots. Shape (k + 1,) [s].
        ends: quantity, slider, begin or end, piece. Shape (3, 3, 2, k).
    """
    sampled = blend.sample(times)
    for values, offsets in zip(ends, (sampled.velocities.T, sampled.accelerations.T)):
        values[:, 0] += offsets[:, :-1]
        values[:, 1] += offsets[:, 1:]
    jerks = np.concatenate((blend.pieces[3], np.zeros((1, 3)))).T
    changes = np.append(blend.starts, blend.duration)
    begins = np.searchsorted(changes, times[:-1], side="right") - 1
    lasts = np.searchsorted(changes, times[1:], side="left") - 1
    own = ends[2].copy()
    ends[2] += jerks[:, np.newaxis, begins]
    # Knots are set where the blend changes its jerk, but for changes too close to tell apart.
    for piece in np.flatnonzero(lasts > begins):
        inside = jerks[:, begins[piece] : lasts[piece] + 1]
        sums = np.abs(own[..., piece, np.newaxis] + inside[:, np.newaxis])
        ends[2, ..., piece] = sums.max(axis=2)
        within = changes[begins[piece] + 1 : lasts[piece] + 1]
        gap = np.minimum(within - times[piece], times[piece + 1] - within).max()
        slack = 2.0 * gap * np.abs(inside).max(axis=1, keepdims=True)
        ends[1, ..., piece] += np.copysign(slack, ends[1, ..., piece])
