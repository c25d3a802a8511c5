r"""What a plan on a straight line asks of the sliders at most, bounded without gaps.

Between two knots the way s(t) is a quintic, so its derivatives are bounded by their Bernstein
control points, and those of the slider heights h(s) by their values at both ends of the piece
(the rise of an arm is concave along a line, so that slopes are monotone and the rise is least at
an end). The fourth derivative of h(s(t)) is then at most

$$|h''''| \dot s^4 + 6 |h'''| \dot s^2 |\ddot s| + |h''| (3 \ddot s^2 + 4 \dot s |\dddot s|)
+ |h'| |\ddddot s| = B,$$

and inside a piece of length $\Delta$ the jerk exceeds its values at the ends by at most
$\Delta B / 2$, and the acceleration leaves the straight line between its own by at most
$\Delta^2 B / 8$. The velocity exceeds its values at the ends only as far as this allows: by the
area that the acceleration encloses before it changes its sign, or after.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.limits import SliderLimits
from tri_glide_kinematics.planning.line_plan import WayLaw
from tri_glide_kinematics.planning.plans import CubicPlan, FloatArray
from tri_glide_kinematics.planning.straight_line import StraightLine


class Demand(NamedTuple):
    """Upper bounds of absolute values in each piece of a plan, for each slider.

    Attributes:
        velocity: Shape (..., k, 3) [m/s].
        acceleration: Shape (..., k, 3) [m/s^2].
        jerk: Shape (..., k, 3) [m/s^3].
        backwards: largest speed against the direction of the line. Shape (...) [m/s].
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    backwards: FloatArray


def line_demand(line: StraightLine, law: WayLaw, blend: CubicPlan | None = None) -> Demand:
    """Bound what the sliders do while the platform follows ``law`` on ``line``.

    Args:
        line: where the platform moves.
        law: one law, or several with an axis for them in front.
        blend: offsets of the sliders that are added to them.
    """
    times, ways, speeds, gains = law
    dt = times[..., 1:] - times[..., :-1]
    steps = _derivative_control_points(law, dt)
    # Largest absolute values of the four derivatives of s in each piece.
    d1, d2, d3, d4 = (np.abs(points).max(axis=0)[..., np.newaxis] for points in steps)
    rise, first, second, third = line.derivatives(ways)
    speed, gain = speeds[..., np.newaxis], gains[..., np.newaxis]
    velocity = first * speed
    acceleration = first * gain + second * speed * speed
    bend = speed * (3.0 * second * gain + third * speed * speed)
    jerk_left = bend[..., :-1, :] + first[..., :-1, :] * steps[2][0][..., np.newaxis]
    jerk_right = bend[..., 1:, :] + first[..., 1:, :] * steps[2][-1][..., np.newaxis]

    tilt = np.abs(first - line.slope)
    lowest = np.minimum(rise[..., 1:, :], rise[..., :-1, :])
    g1 = np.maximum(tilt[..., 1:, :], tilt[..., :-1, :])
    g2 = (g1 * g1 - line.curvature) / lowest
    g3 = 3.0 * g1 * g2 / lowest
    g4 = (3.0 * g2 * g2 + 4.0 * g1 * g3) / lowest
    square = d1 * d1
    snap = (
        square * (square * g4 + 6.0 * d2 * g3)
        + g2 * (3.0 * d2 * d2 + 4.0 * d1 * d3)
        + (g1 + abs(line.slope)) * d4
    )
    dt = dt[..., np.newaxis]
    if blend is None:
        jerk = np.maximum(np.abs(jerk_left), np.abs(jerk_right))
    else:
        jerk = _add_blend(blend, times, velocity, acceleration, jerk_left, jerk_right)
    jerk += 0.5 * dt * snap
    bow = 0.125 * dt * dt * snap
    left, right = acceleration[..., :-1, :], acceleration[..., 1:, :]
    turning = left * right < 0.0
    velocity, left, right = np.abs(velocity), np.abs(left), np.abs(right)
    weaker = np.where(turning, np.minimum(left, right), 0.0)
    sums = np.maximum(left + right, np.finfo(float).tiny)
    return Demand(
        np.maximum(velocity[..., 1:, :], velocity[..., :-1, :])
        + dt * (bow + 0.5 * weaker * weaker / sums),
        np.maximum(left, right) + bow,
        jerk,
        -np.minimum(steps[0].min(axis=(0, -1)), 0.0),
    )


def slowdown(demand: Demand, limits: SliderLimits) -> FloatArray:
    """Return by which factor each piece has to be slower for all limits to hold.

    It is exact for a whole plan from rest to rest: times scaled by k divide velocities by k,
    accelerations by k^2 and jerks by k^3. Shape (..., k).
    """
    velocity = (demand.velocity / np.array(limits.velocity)).max(axis=-1)
    acceleration = (demand.acceleration / np.array(limits.acceleration)).max(axis=-1)
    jerk = (demand.jerk / np.array(limits.jerk)).max(axis=-1)
    return np.asarray(np.maximum(np.maximum(velocity, np.sqrt(acceleration)), np.cbrt(jerk)))


def _derivative_control_points(law: WayLaw, dt: FloatArray) -> list[FloatArray]:
    """Return the Bernstein control points of the derivatives 1 to 4 of the way in each piece.

    The j-th of them has the shape (6 - j, ..., k).
    """
    _, ways, speeds, gains = law
    step = dt / 5.0
    bow = dt * dt / 20.0
    first, last = ways[..., :-1], ways[..., 1:]
    second, fifth = first + speeds[..., :-1] * step, last - speeds[..., 1:] * step
    third = 2.0 * second - first + gains[..., :-1] * bow
    fourth = 2.0 * fifth - last + gains[..., 1:] * bow
    points = np.array((first, second, third, fourth, fifth, last))
    derivatives = []
    for degree in (5, 4, 3, 2):
        points = (points[1:] - points[:-1]) * (degree / dt)
        derivatives.append(points)
    return derivatives


def _add_blend(
    blend: CubicPlan,
    times: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    jerk_left: FloatArray,
    jerk_right: FloatArray,
) -> FloatArray:
    """Add the blend to the values at the knots; return the largest jerk at the ends of pieces."""
    sampled = blend.sample(times)
    velocity += sampled.velocities
    acceleration += sampled.accelerations
    jerks = np.concatenate((blend.pieces[3], np.zeros((1, 3))))
    bounds = np.append(blend.starts, blend.duration)
    begins = np.searchsorted(bounds, times[:-1], side="right") - 1
    ends = np.searchsorted(bounds, times[1:], side="left") - 1
    at_begin, at_end = jerks[begins], jerks[ends]
    jerk: FloatArray = np.maximum(
        np.maximum(np.abs(jerk_left + at_begin), np.abs(jerk_right + at_end)),
        np.maximum(np.abs(jerk_left + at_end), np.abs(jerk_right + at_begin)),
    )
    # Knots are set where the blend changes its jerk, but for changes too close to tell apart.
    for piece in np.flatnonzero(ends > begins):
        inside = jerks[begins[piece] : ends[piece] + 1]
        sums = np.concatenate((jerk_left[piece] + inside, jerk_right[piece] + inside))
        jerk[piece] = np.abs(sums).max(axis=0)
        changes = bounds[begins[piece] + 1 : ends[piece] + 1]
        gap = np.minimum(changes - times[piece], times[piece + 1] - changes).max()
        slack = 2.0 * gap * np.abs(inside).max(axis=0)
        for knot in (piece, piece + 1):
            acceleration[knot] += np.copysign(slack, acceleration[knot])
    return jerk
