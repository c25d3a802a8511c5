"""How wide roundings are that reach over joints of others, of many small ones above all."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.paths.deviations import (
    CONVEX_BEND,
    SPARE,
    Weights,
    pairs,
    width_alone,
)
from tri_glide_kinematics.motion.paths.joints import RoundedJoints
from tri_glide_kinematics.vectors import FloatArray

# Roundings that share their room use this part of the tolerance first, as neighbours add theirs.
SHARE = 0.9

# So many joints to each side a rounding reaches over at most, unless the corner is a large one.
NEIGHBOURS = 32

# No rounding reaches over more joints that share their room.
FARTHEST = 250

# A corner is large if the tangent changes by more.
LARGE_TURN = 0.2


def shared_widths(
    joints: RoundedJoints, weights: Weights, alone: FloatArray
) -> Interruptible[FloatArray]:
    """Return the width with which all roundings around a joint together keep its tolerance."""
    ways, allowed = joints.ways, SHARE * joints.tolerances
    with np.errstate(divide="ignore"):
        widths = np.minimum(alone, width_alone(joints, joints.turns, CONVEX_BEND))
    if len(ways) > NEIGHBOURS:
        yield
        # What is far away must not matter.
        widths = np.minimum(widths, _reaches(ways, FARTHEST))
        widths = yield from _roughly(joints, weights, widths)
        yield
        widths = np.minimum(widths, _most_neighbours(joints, widths))
        yield
    bent = bool(weights.bends.any())
    for _ in range(4):
        cubic, linear = weights.turns * widths**3, weights.bends * widths
        yield
        for offset in range(1, len(ways)):
            reaches = False
            for some, after in pairs(len(ways), offset):
                here = np.maximum(widths[some] - (ways[after] - ways[some]), 0.0)
                if here.any():
                    reaches = True
                    cubic[some] += here * here * here * weights.turns[after]
                    if bent:
                        linear[some] += here * weights.bends[after]
                yield
            for some, after in pairs(len(ways), offset):
                there = np.maximum(widths[after] - (ways[after] - ways[some]), 0.0)
                if there.any():
                    reaches = True
                    cubic[after] += there * there * there * weights.turns[some]
                    if bent:
                        linear[after] += there * weights.bends[some]
                yield
            if not reaches:
                break
        excess = (cubic / (6.0 * widths * widths) + linear * widths) / allowed
        yield
        if not (excess > 1.0).any():
            break
        widths = np.where(excess > 1.0, widths / np.sqrt(np.maximum(excess, 1.0)), widths)
    return widths


def _roughly(
    joints: RoundedJoints, weights: Weights, widths: FloatArray
) -> Interruptible[FloatArray]:
    """Return about the width at which many small corners around a joint use its tolerance.

    Corners within a third of a width w count for 8/27 w/6 of their turn at least.
    """
    ways = joints.ways
    turns = np.concatenate(((0.0,), np.cumsum(weights.turns)))
    for _ in range(3):
        yield
        near = turns[np.searchsorted(ways, ways + widths / 3.0)]
        yield
        near -= turns[np.searchsorted(ways, ways - widths / 3.0)]
        yield
        fitting = (20.25 / np.maximum(near, SPARE)) * joints.tolerances
        widths = np.minimum(widths, np.sqrt(widths * fitting))
    return widths


def _most_neighbours(joints: RoundedJoints, widths: FloatArray) -> FloatArray:
    """Return widths that reach over no more than so many joints, except about large corners."""
    ways = joints.ways
    large = np.where(joints.turns > LARGE_TURN, widths, 0.0)
    around = np.maximum.accumulate(large + ways) - ways
    around = np.maximum(around, np.maximum.accumulate((large - ways)[::-1])[::-1] + ways)
    return np.maximum(_reaches(ways, NEIGHBOURS), around)


def _reaches(ways: FloatArray, count: int) -> FloatArray:
    """Return widths that reach over ``count`` joints to one side, and no more to the other."""
    reaches = np.full(len(ways), np.inf)
    reaches[count:] = ways[count:] - ways[:-count]
    reaches[:-count] = np.minimum(reaches[:-count], reaches[count:])
    return reaches
