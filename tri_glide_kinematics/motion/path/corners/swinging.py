r"""Roundings of corners with much room: they swing out to the other side before they turn in.

As a car that keeps to the outside before a bend drives it faster, so does a platform that may be on
both sides of the path. Here

$$B(x) = T(x; (1 + a) h) - a h\, G(x; w),\qquad
G(x; w) = \frac{Q(x; w) - Q(x; 4w/5)}{Q(0; w) - Q(0; 4w/5)},$$

with the rounding T of ``tapering``, of the height (1 + a) h, and roundings Q of the third degree. G
is 1 at the corner, where it has no corner itself, and falls to 0 at w. So B is h at the corner, and
beside it no less than -h: a is as large as that allows; less where one line is longer.

Roundings of two corners may overlap, as each reaches over nine tenths of the way between. Both
together are within the larger tolerance: ``test_swinging.py`` adds them for many ways and pairs of
tolerances.
"""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints
from tri_glide_kinematics.motion.path.corners.tapering import WIDEST
from tri_glide_kinematics.motion.path.corners.widths import SPARE, Widths
from tri_glide_kinematics.vectors import FloatArray

# Half width of the narrow part of G, as part of the wide one.
NARROWER = 0.8

# Largest part of the way to the next joint, and largest multiple of the height, that w is. Farther
# from the corner, nothing is gained by it.
SWING_REACH = 0.9
FARTHEST_SWING = 100.0

# With a swing a <= LEAST_SWING + FALLING (h / w)^2, B is nowhere below -0.993 h, nor are two
# together.
LEAST_SWING = 0.99
FALLING = 560.0

# How fast a grows with w where there is little room. T becomes a little wider than half of it.
GROWING = 1.1

# What tapers off by all but this does so altogether: rounding.
ALL_OF_IT = 1.0 - 1e-9


def swing_of(ratios: FloatArray) -> FloatArray:
    """Return a for the ``ratios`` of w to h; at most 0 where there is no room for any."""
    fitting = GROWING * (ratios / (2.0 * SWING_REACH * WIDEST) - 1.0)
    return np.asarray(np.minimum(fitting, LEAST_SWING + FALLING / (ratios * ratios)))


def swing_parts(
    half_widths: FloatArray, swings: FloatArray, swing_widths: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return half width and part of both Q of which - a h G is made. Shape (m,) each.

    Args:
        half_widths: of the parts that do not swing out. Shape (m,) [m].
        swings: a. Shape (m,).
        swing_widths: w. Shape (m,) [m].
    """
    heights = half_widths / (WIDEST * (1.0 + swings))
    parts = 6.0 * swings * heights / ((1.0 - NARROWER) * swing_widths)
    return swing_widths, -parts, NARROWER * swing_widths, parts


def swung(joints: RoundedJoints, widths: Widths, count: int, rooms_before: FloatArray) -> Widths:
    """Return widths that use the room beside corners that stand alone and taper off.

    Args:
        joints: that are rounded.
        widths: of roundings that taper off where there is room.
        count: so many of the first ones stay as they are.
        rooms_before: over which each may reach to what is before it. Shape (m,) [m].
    """
    alone = widths.single & (joints.bends == 0.0)
    corners = alone & (widths.tapers >= ALL_OF_IT) & joints.free
    corners[:count] = False
    if not corners.any():
        return widths
    # Over others it does not reach.
    others = np.where(alone, 0.0, widths.half_widths)
    gaps = np.diff(joints.ways)
    before = np.minimum(np.concatenate(((np.inf,), gaps - others[:-1])), rooms_before)
    after = np.minimum(np.concatenate((gaps - others[1:], (np.inf,))), joints.rooms_after)
    heights = (1.0 - SPARE) * joints.tolerances[corners] / joints.distances[corners]
    first, second = (
        np.minimum(SWING_REACH * rooms[corners], FARTHEST_SWING * heights)
        for rooms in (before, after)
    )
    reaches = np.minimum(first, second)
    # Where one line is longer, the platform comes along it too fast for the swing of the other.
    swings = swing_of(reaches / heights) * reaches / np.maximum(first, second)
    swinging = swings > 0.0
    chosen = np.flatnonzero(corners)[swinging]
    half_widths, tapers = widths.half_widths.copy(), widths.tapers.copy()
    all_swings, swing_widths = widths.swings.copy(), widths.swing_widths.copy()
    tapers[chosen] = 1.0
    all_swings[chosen] = swings[swinging]
    swing_widths[chosen] = reaches[swinging]
    half_widths[chosen] = (WIDEST * (1.0 + swings) * heights)[swinging]
    return widths._replace(
        half_widths=half_widths, tapers=tapers, swings=all_swings, swing_widths=swing_widths
    )
