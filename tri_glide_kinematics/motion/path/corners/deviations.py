r"""How far a path that is rounded is from the path as programmed.

The rounding of a joint i, of half width $w_i$, adds to the path as programmed

$$\Delta t_i B(s - s_i; w_i) + \Delta k_i E(s - s_i; w_i),\quad
B(x; w) = \frac{w}{6} (1 - |x|/w)^3,\quad E(x; w) = \frac{x (w - |x|)^3}{12 w^2}$$

for $|x| < w$, with the jumps of the unit tangent and of the curvature vector. As
$|E| \le \frac{w^2}{81} (1 - |x|/w)$, the sum of both bounds over all joints is convex between two
joints and so is largest at one: if it is at most the tolerance at each joint, the path nowhere
leaves the larger tolerance of the joints beside it. Where a rounding overlaps no other, it is
known better: its distance from two lines is B times the sine of the angle, and
$|E| \le \frac{27}{3072} w^2$.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import ROWS, Interruptible, any_of, columns_of
from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints
from tri_glide_kinematics.vectors import FloatArray

# Largest value of |E|, and factor of its convex bound, as parts of the square of w.
LARGEST_BEND = 27.0 / 3072.0
CONVEX_BEND = 1.0 / 81.0

# All tolerances hold by this part more, so that rounding decides nothing.
SPARE = 1e-9


class Weights(NamedTuple):
    """How much the rounding of each joint counts: bound is turns B + bends w^2 (1 - |x|/w).

    Attributes:
        turns: Shape (m,).
        bends: Shape (m,) [1/m].
    """

    turns: FloatArray
    bends: FloatArray


def deviation_bounds(
    ways: FloatArray, weights: Weights, half_widths: FloatArray
) -> Interruptible[FloatArray]:
    """Return the bound of the deviation at each joint; interruptibly.

    Args:
        ways: of the joints. Shape (m,) [m].
        weights: of their roundings.
        half_widths: of their roundings, which differ by no more than the ways. Shape (m,) [m].

    Returns:
        Shape (m,) [m].
    """

    def factors(some: slice) -> tuple[FloatArray, FloatArray, FloatArray]:
        widths, turns = half_widths[some], weights.turns[some]
        linear = weights.bends[some] * widths
        return turns / (6.0 * widths * widths), linear, widths * (turns / 6.0 + linear)

    cubic, linear, bounds = yield from columns_of(len(ways), factors, spare_zeros=True)
    bent = yield from any_of(np.asarray, linear)
    for offset in range(1, len(ways)):
        reaches = False
        for some, after in pairs(len(ways), offset):
            forwards = np.maximum(half_widths[some] - (ways[after] - ways[some]), 0.0)
            if forwards.any():
                reaches = True
                bounds[after] += forwards * forwards * forwards * cubic[some]
                if bent:
                    bounds[after] += forwards * linear[some]
            yield
        for some, after in pairs(len(ways), offset):
            backwards = np.maximum(half_widths[after] - (ways[after] - ways[some]), 0.0)
            if backwards.any():
                reaches = True
                bounds[some] += backwards * backwards * backwards * cubic[after]
                if bent:
                    bounds[some] += backwards * linear[after]
            yield
        if not reaches:
            break
    return bounds


def is_too_far(excess: FloatArray) -> NDArray[np.bool_]:
    """Return where deviations are larger than the tolerance, as parts of which they are given."""
    return np.asarray(excess > 1.0)


def pairs(count: int, offset: int) -> Iterator[tuple[slice, slice]]:
    """Yield which of ``count`` joints, and which so many behind them; some pairs at a time."""
    for first in range(0, count - offset, ROWS):
        last = min(first + ROWS, count - offset)
        yield slice(first, last), slice(first + offset, last + offset)


def width_alone(joints: RoundedJoints, turns: FloatArray, bend: float) -> FloatArray:
    """Return the widths with which roundings that do not overlap just keep the tolerances."""
    tolerances = (1.0 - SPARE) * joints.tolerances
    of_corner = 6.0 * tolerances / turns
    # The corner is the farthest place if the curvature jumps by little.
    little = joints.bends * of_corner <= 6.0 * turns
    half, bends = turns / 12.0, bend * joints.bends
    root = np.sqrt(half * half + bends * tolerances)
    return np.where(little, of_corner, tolerances / (half + root))


def deviation_alone(joints: RoundedJoints, widths: FloatArray) -> FloatArray:
    """Return the largest distance from the path as programmed of roundings that stand alone."""
    of_corner = joints.distances * widths / 6.0
    of_bend = LARGEST_BEND * joints.bends * widths * widths
    little = joints.bends * widths <= 6.0 * joints.distances
    return np.where(little, of_corner, of_corner + of_bend)
