"""How wide roundings are that reach over joints of others, of many small ones above all."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.interruptible import (
    Interruptible,
    accumulated,
    any_of,
    column_of,
    columns_of,
    concatenated,
)
from tri_glide_kinematics.motion.path.corners.deviations import (
    CONVEX_BEND,
    SPARE,
    Weights,
    is_too_far,
    pairs,
    width_alone,
)
from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints
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
    ways, total = joints.ways, len(joints.ways)

    def at_most(some: slice) -> FloatArray:
        part = joints.part(some)
        with np.errstate(divide="ignore"):
            return np.minimum(alone[some], width_alone(part, part.turns, CONVEX_BEND))

    widths = yield from column_of(total, at_most)
    if total > NEIGHBOURS:
        # What is far away must not matter.
        widths = yield from column_of(
            total,
            lambda some: np.minimum(widths[some], _reaches(ways[some], FARTHEST)),
            margin=FARTHEST,
        )
        widths = yield from _roughly(joints, weights, widths)
        most = yield from _most_neighbours(joints, widths)
        widths = yield from column_of(total, lambda some: np.minimum(widths[some], most[some]))
    bent = yield from any_of(np.asarray, weights.bends)
    for _ in range(4):
        cubic, linear = yield from _own_terms(weights, widths)
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
        excess = yield from _excess(joints, widths, cubic, linear)
        if not (yield from any_of(is_too_far, excess)):
            break
        widths = yield from _lowered(widths, excess)
    return widths


def _own_terms(
    weights: Weights, widths: FloatArray
) -> Interruptible[tuple[FloatArray, FloatArray]]:
    """Return what each rounding adds at its own joint, as cubes and as squares of its width."""
    cubic, linear = yield from columns_of(
        len(widths),
        lambda some: (weights.turns[some] * widths[some] ** 3, weights.bends[some] * widths[some]),
    )
    return cubic, linear


def _excess(
    joints: RoundedJoints, widths: FloatArray, cubic: FloatArray, linear: FloatArray
) -> Interruptible[FloatArray]:
    """Return what all roundings add at each joint, as part of what is allowed. Shape (m,)."""

    def excess(some: slice) -> FloatArray:
        width = widths[some]
        added = cubic[some] / (6.0 * width * width) + linear[some] * width
        return np.asarray(added / (SHARE * joints.tolerances[some]))

    return (yield from column_of(len(widths), excess))


def _lowered(widths: FloatArray, excess: FloatArray) -> Interruptible[FloatArray]:
    """Return the ``widths``, smaller where too much is added. Shape (m,)."""

    def lowered(some: slice) -> FloatArray:
        less = widths[some] / np.sqrt(np.maximum(excess[some], 1.0))
        return np.where(is_too_far(excess[some]), less, widths[some])

    return (yield from column_of(len(widths), lowered))


def _roughly(
    joints: RoundedJoints, weights: Weights, widths: FloatArray
) -> Interruptible[FloatArray]:
    """Return about the width at which many small corners around a joint use its tolerance.

    Corners within a third of a width w count for 8/27 w/6 of their turn at least.
    """
    ways = joints.ways
    turns = yield from concatenated((np.zeros(1), weights.turns))
    turns = yield from accumulated(np.add, turns)

    def narrower(some: slice) -> FloatArray:
        near = turns[np.searchsorted(ways, ways[some] + widths[some] / 3.0)]
        near -= turns[np.searchsorted(ways, ways[some] - widths[some] / 3.0)]
        fitting = (20.25 / np.maximum(near, SPARE)) * joints.tolerances[some]
        return np.minimum(widths[some], np.sqrt(widths[some] * fitting))

    for _ in range(3):
        widths = yield from column_of(len(ways), narrower)
    return widths


def _most_neighbours(joints: RoundedJoints, widths: FloatArray) -> Interruptible[FloatArray]:
    """Return widths that reach over no more than so many joints, except about large corners."""
    ways, total = joints.ways, len(joints.ways)

    def ends(some: slice) -> tuple[FloatArray, FloatArray]:
        large = np.where(joints.turns[some] > LARGE_TURN, widths[some], 0.0)
        return large + ways[some], large - ways[some]

    after, before = yield from columns_of(total, ends)
    after = yield from accumulated(np.maximum, after)
    before = (yield from accumulated(np.maximum, before[::-1]))[::-1]
    around = yield from column_of(
        total, lambda some: np.maximum(after[some] - ways[some], before[some] + ways[some])
    )
    return (
        yield from column_of(
            total,
            lambda some: np.maximum(_reaches(ways[some], NEIGHBOURS), around[some]),
            margin=NEIGHBOURS,
        )
    )


def _reaches(ways: FloatArray, count: int) -> FloatArray:
    """Return widths that reach over ``count`` joints to one side, and no more to the other."""
    reaches = np.full(len(ways), np.inf)
    reaches[count:] = ways[count:] - ways[:-count]
    reaches[:-count] = np.minimum(reaches[:-count], reaches[count:])
    return reaches
