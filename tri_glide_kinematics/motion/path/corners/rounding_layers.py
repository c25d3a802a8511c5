"""Layers of roundings, and the breaks at which they begin and end.

In a layer of two roundings the one that begins first also ends first. Those that taper off or swing
out are put together of some, one inside the other (``tapering``, ``swinging``), each in a layer of
its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import (
    ROWS,
    Interruptible,
    any_of,
    blocks,
    column_of,
    columns_of,
    concatenated,
    indices_of,
    picked,
    sorting,
)
from tri_glide_kinematics.motion.path.corners.joints import Indices, RoundedJoints
from tri_glide_kinematics.motion.path.corners.swinging import NARROWER
from tri_glide_kinematics.motion.path.corners.tapering import PARTS, WIDEST
from tri_glide_kinematics.motion.path.corners.widths import Widths
from tri_glide_kinematics.vectors import FloatArray

# Two breaks that are nearer, as part of the path's length, are one: the rest is rounding error.
SAME_BREAK = 1e-13


class Layer(NamedTuple):
    """Roundings; of two, the one that begins first also ends first.

    Each is made of one of the third and one of the fourth degree, the latter w/8 (1 - |x|/w)^4.

    Attributes:
        ways: programmed way at each joint. Shape (m,) [m].
        tangent_jumps: change of the unit tangent. Shape (m, 3).
        curvature_jumps: change of the curvature vector; None where none is rounded in this layer.
            Shape (m, 3) [1/m].
        half_widths: Shape (m,) [m].
        thirds: how much of the third degree counts. Shape (m,).
        fourths: how much of the fourth degree counts; None for nothing. Shape (m,).
    """

    ways: FloatArray
    tangent_jumps: FloatArray
    curvature_jumps: FloatArray | None
    half_widths: FloatArray
    thirds: FloatArray
    fourths: FloatArray | None


class Breaks(NamedTuple):
    """Joints of a path and ends of its roundings.

    Attributes:
        ways: of all of them, ascending. Shape (k + 1,) [m].
        begins: index of the break at which each rounding of a layer begins. Shape (m,).
        middles: index of the break at its joint. Shape (m,).
        ends: index of the break at which it ends. Shape (m,).
    """

    ways: FloatArray
    begins: Indices
    middles: Indices
    ends: Indices


def layers_of(joints: RoundedJoints, widths: Widths) -> Interruptible[list[Layer]]:
    """Return the layers of all roundings, those with terms of the fourth degree first."""
    total, tapers, half_widths = len(joints.ways), widths.tapers, widths.half_widths
    tapering = yield from indices_of(tapers)
    swinging = yield from indices_of(widths.swings)
    bent = yield from any_of(np.asarray, joints.bends)
    (part, _), *inner = PARTS
    thirds = yield from column_of(total, lambda some: 1.0 - tapers[some])
    fourths = None
    if len(tapering):
        fourths = yield from column_of(total, lambda some: part * tapers[some])
    jumps = joints.tangent_jumps, joints.curvature_jumps if bent else None
    layers = [Layer(joints.ways, *jumps, half_widths, thirds, fourths)]
    if len(tapering):
        ways, changes = yield from _corners(joints, tapering)

        def inner_parts(some: slice) -> list[FloatArray]:
            wide, heights = half_widths[tapering[some]], tapers[tapering[some]]
            parts = [(width * wide, part * heights) for part, width in inner]
            return [column for pair in parts for column in pair]

        columns = yield from columns_of(len(tapering), inner_parts)
        nothing = np.zeros(len(tapering))
        for narrower, heights in zip(columns[::2], columns[1::2]):
            layers.append(Layer(ways, changes, None, narrower, nothing, heights))
    if len(swinging):
        ways, changes = yield from _corners(joints, swinging)

        def shapes(some: slice) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
            here = swinging[some]
            wide, swings = widths.swing_widths[here], widths.swings[here]
            heights = half_widths[here] / (WIDEST * (1.0 + swings))
            parts = 6.0 * swings * heights / ((1.0 - NARROWER) * wide)
            return wide, -parts, NARROWER * wide, parts

        wide, less, narrow, more = yield from columns_of(len(swinging), shapes)
        layers.append(Layer(ways, changes, None, wide, less, None))
        layers.append(Layer(ways, changes, None, narrow, more, None))
    return layers


def _corners(joints: RoundedJoints, some: Indices) -> Interruptible[tuple[FloatArray, FloatArray]]:
    """Return ways and changes of the tangent at ``some`` of the joints."""
    ways = yield from picked(joints.ways, some)
    return ways, (yield from picked(joints.tangent_jumps, some))


def breaks_of(ways: FloatArray, layers: Sequence[Layer]) -> Interruptible[list[Breaks]]:
    """Return the joints of a path and the ends of its roundings, each place once; interruptibly.

    Args:
        ways: of all joints, rounded or not. Shape (n + 1,) [m].
        layers: of roundings.

    Returns:
        One for each layer, all with the same ``ways``.
    """
    middles = yield from concatenated([layer.ways for layer in layers])
    half_widths = yield from concatenated([layer.half_widths for layer in layers])
    begins, ends = yield from columns_of(
        len(middles),
        lambda some: (
            np.clip(middles[some] - half_widths[some], ways[0], ways[-1]),
            np.clip(middles[some] + half_widths[some], ways[0], ways[-1]),
        ),
    )
    ends = yield from concatenated((ways, begins, ends))
    order = yield from sorting(ends, ways[:: ROWS // 3])
    ascending = yield from picked(ends, order)
    fresh = np.ones(len(ends), dtype=bool)
    group = np.empty(len(ends), dtype=np.intp)
    total = -1
    for first in range(0, len(ends), ROWS):
        yield
        some = slice(first, first + ROWS)
        begin = max(first, 1)
        steps = np.diff(ascending[begin - 1 : first + ROWS])
        fresh[begin : first + ROWS] = steps > SAME_BREAK * ways[-1]
        numbers = np.cumsum(fresh[some]) + total
        group[order[some]] = numbers
        total = int(numbers[-1])
    yield
    places = yield from picked(ascending, (yield from indices_of(fresh)))
    # Where an end of a rounding lies on a joint but for rounding, it is the joint that counts.
    count, rounded = len(ways), len(half_widths)
    for some in blocks(count):
        places[group[some]] = ways[some]
        yield
    columns = (
        group[count : count + rounded],
        (yield from column_of(rounded, lambda some: group[np.searchsorted(ways, middles[some])])),
        group[count + rounded :],
    )
    last = np.cumsum([len(layer.half_widths) for layer in layers])
    return [
        Breaks(places, *(column[end - len(layer.half_widths) : end] for column in columns))
        for layer, end in zip(layers, last)
    ]
