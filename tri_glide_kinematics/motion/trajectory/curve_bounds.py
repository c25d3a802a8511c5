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

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.path import Indices
from tri_glide_kinematics.motion.trajectory import quintics
from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan
from tri_glide_kinematics.motion.trajectory.curves import PathHeights, StraightLine
from tri_glide_kinematics.motion.trajectory.errors import PlanningError, SliderLimitError
from tri_glide_kinematics.motion.trajectory.limits import (
    QUANTITIES,
    RELATIVE_ROUNDING,
    SliderLimits,
)
from tri_glide_kinematics.motion.trajectory.time_scaling import TimeScaling
from tri_glide_kinematics.vectors import FloatArray

# Speed against the direction of a line or a path that is rounding [m/s].
NO_BACKWARD_SPEED = 1e-8


class DerivativeBounds(NamedTuple):
    """Upper bounds of absolute values in each piece of a plan, for each slider.

    Attributes:
        velocity: Shape (3, k) [m/s].
        acceleration: Shape (3, k) [m/s^2].
        jerk: Shape (3, k) [m/s^3].
        speeds: control points of the speed along the line in each piece. Shape (5, k) [m/s].
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    speeds: FloatArray

    @property
    def backwards(self) -> float:
        """Largest speed against the direction of the line [m/s]."""
        return -min(float(self.speeds.min()), 0.0)


def derivative_bounds(
    line: StraightLine, scaling: TimeScaling, blend: CubicPlan | None = None
) -> DerivativeBounds:
    """Return bounds for a platform that follows ``line`` with a time ``scaling``.

    Args:
        line: where the platform moves.
        scaling: how far along it is at each time.
        blend: offsets of the sliders that are added to them.
    """
    times, ways, speeds, accelerations = scaling
    dt = times[1:] - times[:-1]
    square = dt * dt
    cube = square * dt
    points = quintics.derivative_control_points(dt, ways, speeds, accelerations)
    speed_points = points[:5] / dt
    # Largest absolute values of the derivatives of s in each piece.
    d1 = np.abs(speed_points).max(axis=0)
    largest = np.abs(points)
    d2 = largest[5:9].max(axis=0) / square
    d3 = largest[9:12].max(axis=0) / cube
    d4 = largest[12:14].max(axis=0) / (square * square)
    d5 = largest[14] / (square * cube)
    # At both ends of each piece: first where all begin, then where all end.
    ways, speeds, accelerations = np.array(
        ((ways[:-1], ways[1:]), (speeds[:-1], speeds[1:]), (accelerations[:-1], accelerations[1:]))
    ).reshape(3, -1)
    jerks_along = (points[9:12:2] / cube).ravel()
    rise, first, second, third = line.derivatives(ways)
    speeds_squared = speeds * speeds
    # Velocity, acceleration and jerk of the sliders.
    ends = np.array(
        (
            first * speeds,
            first * accelerations + second * speeds_squared,
            first * jerks_along
            + second * (3.0 * speeds * accelerations)
            + third * (speeds_squared * speeds),
        )
    ).reshape(3, 3, 2, -1)
    change = np.abs(ends[2, :, 1] - ends[2, :, 0])
    if blend is not None:
        _add_blend(blend, times, ends)
    magnitudes = np.abs(ends)
    velocity, acceleration, jerk = magnitudes.max(axis=2)
    weaker = magnitudes[1].min(axis=1)
    turning = ends[1, :, 0] * ends[1, :, 1] < 0.0

    steepest = np.abs(first - line.slope).reshape(3, 2, -1).max(axis=1)
    flatness = 1.0 / rise.reshape(3, 2, -1).min(axis=1)
    ratio = steepest * flatness
    g2 = (steepest * steepest - line.curvature) * flatness
    g3 = ratio * g2
    g4 = g2 * g2 * flatness
    d11 = d1 * d1
    fifth = (
        ratio * g4 * (105.0 * d11 * d11 * d1)
        + g4 * (150.0 * d11 * d1 * d2)
        + g3 * (45.0 * d1 * d2 * d2 + 30.0 * d11 * d3)
        + g2 * (10.0 * d2 * d3 + 5.0 * d1 * d4)
        + (steepest + abs(line.slope)) * d5
    )
    # How far acceleration and jerk may exceed their values at the ends.
    of_jerk = fifth * (0.125 * square)
    of_acceleration = (0.125 * change + of_jerk) * dt
    velocity += (of_acceleration + 0.25 * weaker * turning) * dt
    acceleration += of_acceleration
    jerk += of_jerk
    return DerivativeBounds(velocity, acceleration, jerk, speed_points)


def check_bounds(bounds: Sequence[FloatArray], times: FloatArray, limits: SliderLimits) -> None:
    """Compare bounds in the pieces of a plan with the limits.

    Args:
        bounds: of velocity, acceleration and jerk. Each of the shape (3, k).
        times: at which the pieces begin. Shape (k + 1,) [s].
        limits: of the sliders.

    Raises:
        SliderLimitError: if a limit may be exceeded.
    """
    for (quantity, unit), values, bound in zip(QUANTITIES, bounds, limits.table):
        ratios = values / bound[:, np.newaxis]
        slider, piece = divmod(int(ratios.argmax()), ratios.shape[1])
        if not ratios[slider, piece] <= 1.0 + RELATIVE_ROUNDING:
            value, time = float(values[slider, piece]), float(times[piece])
            raise SliderLimitError(quantity, slider, value, float(bound[slider]), unit, time)


def check_line_bounds(bounds: DerivativeBounds, times: FloatArray, limits: SliderLimits) -> None:
    """Compare ``bounds`` in the pieces of a plan on a line with the limits.

    Args:
        bounds: of each piece.
        times: at which they begin, and the end. Shape (k + 1,) [s].
        limits: of the sliders.

    Raises:
        SliderLimitError: if a limit may be exceeded.
        PlanningError: if the platform would go back along the line.
    """
    if not bounds.backwards <= NO_BACKWARD_SPEED:
        raise PlanningError("the platform cannot stop before the end of the line")
    check_bounds(bounds[:3], times, limits)


def slowdown(bounds: DerivativeBounds, limits: SliderLimits) -> FloatArray:
    """Return by which factor each piece has to be slower for all limits to hold. Shape (k,).

    It is exact for a whole plan from rest to rest: in n times the time, velocities are divided by
    n, accelerations by n^2 and jerks by n^3.
    """
    parts = np.array(bounds[:3]) / limits.table[..., np.newaxis]
    velocity, acceleration, jerk = parts.max(axis=1)
    return np.asarray(np.maximum(np.maximum(velocity, np.sqrt(acceleration)), np.cbrt(jerk)))


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


# A break this near to a knot, as a part of the length of the piece, is at the knot.
_SAME_PLACE = 1e-9

# Steps of the search for the instant at which a break is passed, and how exact it is, as a part of
# the longest piece.
_INSTANT = 1e-11
_STEPS = 40


class PathParts(NamedTuple):
    """Parts of the pieces of a time scaling, each inside one piece of the path.

    Attributes:
        piece: of the time scaling. Shape (m,).
        begin: time since the piece began. Shape (m,) [s].
        end: likewise. Shape (m,) [s].
        from_way: where it begins. Shape (m,) [m].
        to_way: where it ends. Shape (m,) [m].
    """

    piece: Indices
    begin: FloatArray
    end: FloatArray
    from_way: FloatArray
    to_way: FloatArray


def divided(
    breaks: FloatArray, scaling: TimeScaling, dt: FloatArray, coefficients: FloatArray
) -> PathParts:
    """Return the parts of the pieces of a time scaling between ``breaks`` of the path."""
    ways = scaling.ways
    count = len(dt)
    slack = _SAME_PLACE * (ways[1:] - ways[:-1])
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
    return PathParts(piece, begin, end, from_way, to_way)


def _instants(ways: FloatArray, coefficients: FloatArray, dt: FloatArray) -> FloatArray:
    """Return when quintics pass ``ways``, by Halley's method between bounds. Shape (n,) [s]."""
    if not len(ways):
        return np.empty(0)
    low, high = np.zeros(len(ways)), dt.copy()
    begin, end = coefficients[0], quintics.evaluate(coefficients, dt)[0]
    # As at a constant speed.
    time = np.clip((ways - begin) / (end - begin), 0.0, 1.0) * dt
    tolerance = _INSTANT * float(dt.max())
    for _ in range(_STEPS):
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
        # What is found stays: the next step would be one of rounding, out of the bounds.
        time = np.where(found, time, np.where(sane, better, 0.5 * (low + high)))
    return np.asarray(time)


# Parts that are looked at together, about: few together cost nearly as much as many.
_BLOCK = 700


class PathBounds(NamedTuple):
    """Upper bounds of absolute values in each piece of a time scaling.

    Attributes:
        velocity: of the sliders. Shape (3, k) [m/s].
        acceleration: of the sliders. Shape (3, k) [m/s^2].
        jerk: of the sliders. Shape (3, k) [m/s^3].
        platform: part of the largest speed of the platform. Shape (k,).
        backwards: largest speed against the direction of the path [m/s].
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    platform: FloatArray
    backwards: float

    def parts(self, limits: SliderLimits) -> FloatArray:
        """Return the largest parts of the limits in each piece.

        Returns:
            Of velocities, that of the platform among them, accelerations and jerks. Shape (3, k).
        """
        table = np.array(self[:3]) / limits.table[..., np.newaxis]
        result = table.max(axis=1)
        np.maximum(result[0], self.platform, out=result[0])
        return np.asarray(result)


def path_bounds(heights: PathHeights, scaling: TimeScaling) -> PathBounds:
    """Return bounds for a platform that follows a path with a time ``scaling``, at once."""
    return at_once(bounds_in_pieces(heights, scaling))


def bounds_in_pieces(heights: PathHeights, scaling: TimeScaling) -> Interruptible[PathBounds]:
    """Return bounds for a platform that follows a path with a time ``scaling``.

    Where an arm might not reach they are NaN.

    Args:
        heights: of the sliders along the path.
        scaling: how far along it the platform is at each time.
    """
    blocks = []
    count = len(scaling.times) - 1
    first, last = np.searchsorted(heights.driven.breaks, scaling.ways[[0, -1]])
    size = max(_BLOCK * count // (count + int(last - first)), 1)
    for begin in range(0, count, size):
        block = TimeScaling(*(values[begin : begin + size + 1] for values in scaling))
        blocks.append((yield from _bounds_of_block(heights, block)))
        yield
    velocity, acceleration, jerk, platform, backwards = zip(*blocks)
    return PathBounds(
        np.concatenate(velocity, axis=1),
        np.concatenate(acceleration, axis=1),
        np.concatenate(jerk, axis=1),
        np.concatenate(platform),
        max(backwards),
    )


def _bounds_of_block(heights: PathHeights, scaling: TimeScaling) -> Interruptible[PathBounds]:
    """Return the bounds for some pieces."""
    times, ways, speeds, accelerations = scaling
    dt = times[1:] - times[:-1]
    points = quintics.derivative_control_points(dt, ways, speeds, accelerations)
    speed_points = points[:5] / dt
    largest = np.abs(points)
    orders = (
        np.abs(speed_points).max(axis=0),
        largest[5:9].max(axis=0) / dt**2,
        largest[9:12].max(axis=0) / dt**3,
        largest[12:14].max(axis=0) / dt**4,
        largest[14] / dt**5,
    )
    coefficients = scaling.coefficients()
    yield
    parts = divided(heights.driven.breaks, scaling, dt, coefficients)
    yield
    piece = parts.piece
    of_parts = yield from _bounds_of_parts(
        heights, parts, coefficients[:, piece], np.array(orders)[:, piece]
    )
    firsts = np.flatnonzero(np.diff(piece, prepend=-1))
    largest = np.maximum.reduceat(of_parts, firsts, axis=1)
    backwards = -min(float(speed_points.min()), 0.0)
    return PathBounds(largest[:3], largest[3:6], largest[6:9], largest[9], backwards)


def check_path_limits(
    heights: PathHeights,
    scaling: TimeScaling,
    limits: SliderLimits,
    since: float = 0.0,
    above: float = RELATIVE_ROUNDING,
) -> None:
    """Compare the bounds of the derivatives along a path with the limits.

    Args:
        heights: of the sliders along the path.
        scaling: how far along it the platform is at each time.
        limits: of the sliders.
        since: pieces that end before this time are past, and not checked [s].
        above: part by which the bound of the platform's speed may exceed what the path asks for.

    Raises:
        SliderLimitError: if a limit may be exceeded.
        PlanningError: if the platform would go back along the path, or too fast for it.
    """
    scaling = scaling.since(since)
    bounds = path_bounds(heights, scaling)
    if not bounds.backwards <= NO_BACKWARD_SPEED:
        raise PlanningError("the platform would go back along the path")
    check_bounds(bounds[:3], scaling.times, limits)
    if not float(bounds.platform.max()) <= 1.0 + above:
        raise PlanningError(
            f"the platform would be {bounds.platform.max():.6g} times as fast as the path asks for"
        )


def _bounds_of_parts(
    heights: PathHeights, parts: PathParts, coefficients: FloatArray, orders: FloatArray
) -> Interruptible[FloatArray]:
    """Return the bounds in each part: velocities, accelerations, jerks, platform. Shape (10, m).

    Args:
        heights: of the sliders along the path.
        parts: of the pieces.
        coefficients: of the quintic of each part's piece. Shape (6, m).
        orders: largest absolute derivatives of the way by time there, from first to fifth.
            Shape (5, m).
    """
    count = len(parts.piece)
    driven = heights.driven
    times = np.concatenate((parts.begin, parts.end))
    ways = np.concatenate((parts.from_way, parts.to_way))
    middle = driven.pieces_of(0.5 * (parts.from_way + parts.to_way))
    table = driven.derivatives_on(np.concatenate((middle, middle)), ways, 5)
    yield
    both = np.concatenate((coefficients, coefficients), axis=1)
    _, speeds, accelerations = quintics.evaluate(both, times)
    jerks = 6.0 * both[3] + times * (24.0 * both[4] + times * 60.0 * both[5])
    (_, first, second, third), rates = heights.seen_from_sliders(table)
    squared = speeds * speeds
    ends = np.array(
        (
            first * speeds,
            first * accelerations + second * squared,
            first * jerks + second * (3.0 * speeds * accelerations) + third * (squared * speeds),
        )
    ).reshape(3, 3, 2, count)
    change = np.abs(ends[2, :, 1] - ends[2, :, 0])
    magnitudes = np.abs(ends)
    velocity, acceleration, jerk = magnitudes.max(axis=2)
    weaker = magnitudes[1].min(axis=1)
    turning = ends[1, :, 0] * ends[1, :, 1] < 0.0
    length = parts.to_way - parts.from_way
    yield
    by_way, (p1, p2, p3) = _largest_by_way(heights, table, length)
    yield
    d1, d2, d3, d4, d5 = orders
    h1, h2, h3, h4, h5 = by_way
    d11 = d1 * d1
    fifth = (
        h5 * (d11 * d11 * d1)
        + h4 * (10.0 * d11 * d1 * d2)
        + h3 * (15.0 * d1 * d2 * d2 + 10.0 * d11 * d3)
        + h2 * (10.0 * d2 * d3 + 5.0 * d1 * d4)
        + h1 * d5
    )
    dt = parts.end - parts.begin
    of_jerk = fifth * (0.125 * dt * dt)
    of_acceleration = (0.125 * change + of_jerk) * dt
    result = np.empty((10, count))
    result[:3] = velocity + (of_acceleration + 0.25 * weaker * turning) * dt
    result[3:6] = acceleration + of_acceleration
    result[6:9] = jerk + of_jerk
    bound = heights.speed_limits(0.5 * (parts.from_way + parts.to_way))
    # The velocity of the platform leaves the straight line between its values by its jerk alone.
    of_speed = (p1 * d3 + 3.0 * p2 * d1 * d2 + p3 * d11 * d1) * (0.125 * dt * dt)
    result[9] = (np.abs(rates * speeds).reshape(2, count).max(axis=0) + of_speed) / bound
    return result


def _largest_by_way(
    heights: PathHeights, table: FloatArray, length: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return bounds of the derivatives of the heights, and of the platform's place, by the way.

    Args:
        heights: of the sliders along the path.
        table: derivatives of the platform's position up to the fifth, where parts begin and then
            where they end. Shape (6, 2 m, 3).
        length: of the parts. Shape (m,) [m].

    Returns:
        From the first to the fifth, shape (5, 3, m), and from the first to the third, shape (3, m).
    """
    count = len(length)
    half = 0.5 * length
    dx, dy, squares = heights.relative(table[0])
    # The horizontal parts alone bend the arms.
    level = np.sqrt(np.square(table[1:, :, :2]).sum(axis=2)).reshape(5, 2, count).max(axis=1)
    upright = np.abs(table[1:, :, 2]).reshape(5, 2, count).max(axis=1)
    # Of a tilted circle only the whole has a constant magnitude.
    level[4] = upright[4] = np.hypot(level[4], upright[4])
    for order in (3, 2, 1, 0):
        level[order] += half * level[order + 1]
        upright[order] += half * upright[order + 1]
    p1, p2, p3, p4, p5 = level
    away = np.sqrt(dx * dx + dy * dy).reshape(3, 2, count).max(axis=1) + half * p1
    x1 = p1 * p1 + away * p2
    x2 = 3.0 * p1 * p2 + away * p3
    x3 = 3.0 * p2 * p2 + 4.0 * p1 * p3 + away * p4
    x4 = 10.0 * p2 * p3 + 5.0 * p1 * p4 + away * p5
    x0 = np.abs(dx * table[1, :, 0] + dy * table[1, :, 1]).reshape(3, 2, count).max(axis=1)
    x0 += half * x1
    rise = squares.reshape(3, 2, count).min(axis=1) - (0.25 * length * length) * x1
    with np.errstate(invalid="ignore"):
        flatness = 1.0 / np.sqrt(rise)
    g = x0 * flatness
    g1 = (x1 + g * g) * flatness
    g2 = (x2 + 3.0 * g * g1) * flatness
    g3 = (x3 + 3.0 * g1 * g1 + 4.0 * g * g2) * flatness
    g4 = (x4 + 10.0 * g1 * g2 + 5.0 * g * g3) * flatness
    by_way = np.array((g, g1, g2, g3, g4)) + upright[:, np.newaxis]
    return by_way, np.hypot(level[:3], upright[:3])
