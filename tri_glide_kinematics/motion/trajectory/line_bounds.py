r"""Upper bounds of velocity, acceleration and jerk of the sliders along a straight line.

Between two knots the way s(t) is a quintic, so its derivatives are bounded by their Bernstein
control points, and those of the slider heights h(s) by their values at both ends of the piece
(the rise of an arm is concave along a line, so that slopes are monotone and the rise is least at
an end). The fifth derivative of h(s(t)) is then at most

$$|h^{(5)}| |\dot s|^5 + 10 |h^{(4)}| |\dot s|^3 |\ddot s|
+ |h'''| (15 |\dot s| \ddot s^2 + 10 \dot s^2 |s^{(3)}|)
+ |h''| (10 |\ddot s| |s^{(3)}| + 5 |\dot s| |s^{(4)}|) + |h'| |s^{(5)}| = C,$$

and inside a piece of length $\Delta$ the jerk leaves the straight line between its values at the
ends by at most $\Delta^2 C / 8$. Its change along the piece is $\delta$, so its slope nowhere
exceeds $\delta / \Delta + \Delta C$, and the acceleration leaves the straight line between its own
values by at most $\Delta^2 / 8$ times that. The velocity exceeds its values at the ends only as far
as this allows: by the area that the acceleration encloses before it changes its sign, or after,
which is at most a quarter of $\Delta$ times the weaker one of both accelerations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.trajectory import quintics
from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan
from tri_glide_kinematics.motion.trajectory.errors import PlanningError, SliderLimitError
from tri_glide_kinematics.motion.trajectory.limits import (
    QUANTITIES,
    RELATIVE_ROUNDING,
    SliderLimits,
)
from tri_glide_kinematics.motion.trajectory.straight_line import StraightLine
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
