"""Layers of roundings, and the breaks at which they begin and end.

In a layer of two roundings the one that begins first also ends first. Those that taper off or swing
out are put together of some, one inside the other (``tapering``, ``swinging``), each in a layer of
its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import ROWS, Interruptible, picked, sorting
from tri_glide_kinematics.motion.paths.joints import Indices, RoundedJoints
from tri_glide_kinematics.motion.paths.swinging import NARROWER
from tri_glide_kinematics.motion.paths.tapering import PARTS, WIDEST
from tri_glide_kinematics.motion.paths.widths import Widths
from tri_glide_kinematics.vectors import FloatArray

# Two places of a path that are nearer, as part of its length, are the same: rounding.
SAME_PLACE = 1e-13


class Layer(NamedTuple):
    """Roundings; of two, the one that begins first also ends first.

    Each is made of one of the third and one of the fourth degree, the latter w/8 (1 - |x|/w)^4.

    Attributes:
        joints: that are rounded.
        half_widths: Shape (m,) [m].
        thirds: how much of the third degree counts. Shape (m,).
        fourths: how much of the fourth degree counts. Shape (m,).
    """

    joints: RoundedJoints
    half_widths: FloatArray
    thirds: FloatArray
    fourths: FloatArray


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


def layers_of(joints: RoundedJoints, widths: Widths) -> list[Layer]:
    """Return the layers of all roundings, those with terms of the fourth degree first."""
    tapers, half_widths = widths.tapers, widths.half_widths
    (part, _), *inner = PARTS
    layers = [Layer(joints, half_widths, 1.0 - tapers, part * tapers)]
    tapering = np.flatnonzero(tapers)
    if len(tapering):
        corners, nothing = _corners(joints, tapering), np.zeros(len(tapering))
        for part, width in inner:
            narrower = width * half_widths[tapering]
            layers.append(Layer(corners, narrower, nothing, part * tapers[tapering]))
    swinging = np.flatnonzero(widths.swings)
    if len(swinging):
        corners, nothing = _corners(joints, swinging), np.zeros(len(swinging))
        wide, swings = widths.swing_widths[swinging], widths.swings[swinging]
        heights = half_widths[swinging] / (WIDEST * (1.0 + swings))
        parts = 6.0 * swings * heights / ((1.0 - NARROWER) * wide)
        layers.append(Layer(corners, wide, -parts, nothing))
        layers.append(Layer(corners, NARROWER * wide, parts, nothing))
    return layers


def _corners(joints: RoundedJoints, some: Indices) -> RoundedJoints:
    """Return ``some`` of the joints, whose curvature is rounded in another layer."""
    found = joints.part(some)
    return replace(found, curvature_jumps=np.zeros((len(some), 3)), bends=np.zeros(len(some)))


def breaks_of(ways: FloatArray, layers: Sequence[Layer]) -> Interruptible[list[Breaks]]:
    """Return the joints of a path and the ends of its roundings, each place once; interruptibly.

    Args:
        ways: of all joints, rounded or not. Shape (n + 1,) [m].
        layers: of roundings.

    Returns:
        One for each layer, all with the same ``ways``.
    """
    middles = np.concatenate([layer.joints.ways for layer in layers])
    half_widths = np.concatenate([layer.half_widths for layer in layers])
    ends = np.concatenate((ways, middles - half_widths, middles + half_widths))
    yield
    np.clip(ends, ways[0], ways[-1], out=ends)
    yield
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
        fresh[begin : first + ROWS] = steps > SAME_PLACE * ways[-1]
        numbers = np.cumsum(fresh[some]) + total
        group[order[some]] = numbers
        total = int(numbers[-1])
    yield
    places = ascending[fresh]
    yield
    # Where an end of a rounding lies on a joint but for rounding, it is the joint that counts.
    count, rounded = len(ways), len(half_widths)
    places[group[:count]] = ways
    yield
    joints = np.searchsorted(ways, middles)
    yield
    columns = (
        group[count : count + rounded],
        group[joints],
        group[count + rounded :],
    )
    last = np.cumsum([len(layer.half_widths) for layer in layers])
    return [
        Breaks(places, *(column[end - len(layer.half_widths) : end] for column in columns))
        for layer, end in zip(layers, last)
    ]
