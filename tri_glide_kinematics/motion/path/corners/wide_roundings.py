r"""Roundings of corners that stand alone: wider ones, which taper off or swing out.

A rounding of the third degree that keeps a tolerance $\varepsilon$ has the half width
$6 \varepsilon$, and its p'' is a hat. The third derivative jumps in its middle, where p'' is
largest. It had better be small there, and small again where the platform is fast. So here

$$T(x; w) = \tfrac{3}{4} Q(x; w) + \tfrac{3}{10} Q(x; \tfrac{3}{5} w)
- \tfrac{1}{20} Q(x; \tfrac{1}{5} w),\qquad Q(x; w) = \frac{w}{8} (1 - |x|/w)^4,$$

of which p'' is nearly flat in the middle and falls to the slope 0 at the end. The numbers are the
best that a search found, rounded. As $T(0) = 0.115 w$, the half width is $8.70 \varepsilon$. In a
square of 40 mm with a tolerance of 1 mm, what roundings save grows from 11 to 21 % of the time.
Where the room bounds the width, the hat is better, as it is lower. So between both widths the
rounding is a mixture that just keeps the tolerance.

With much room a rounding swings out to the other side before it turns in. As a car that keeps to
the outside before a bend drives it faster, so does a platform that may be on both sides of the
path. Of the height h,

$$B(x) = T(x; (1 + a) h) - a h\, G(x; w),\qquad
G(x; w) = \frac{Q(x; w) - Q(x; 4w/5)}{Q(0; w) - Q(0; 4w/5)},$$

with a T of the height (1 + a) h, and roundings Q of the third degree. G is 1 at the corner, where
it has no corner itself, and falls to 0 at w. So B is h at the corner, and beside it no less than
-h: a is as large as that allows; less where one line is longer.

Roundings of two corners may overlap, as each reaches over nine tenths of the way between. Both
together are within the larger tolerance: ``test_swinging.py`` adds them for many ways and pairs of
tolerances.
"""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints
from tri_glide_kinematics.motion.path.corners.widths import SPARE, Widths
from tri_glide_kinematics.vectors import FloatArray

# How much each part counts, and its half width by that of the widest, which is the first.
PARTS = ((0.75, 1.0), (0.3, 0.6), (-0.05, 0.2))

# Half width of a rounding that tapers off, by its height.
WIDEST = 8.0 / sum(part * width for part, width in PARTS)

# By this part it is lower than a hat of the same width.
LOWER = 1.0 - 6.0 / WIDEST


def heights_of(half_widths: FloatArray, tapers: FloatArray) -> FloatArray:
    """Return the height of roundings at their joints. Shape (m,) [m]."""
    return half_widths * (1.0 - LOWER * tapers) / 6.0


def inner_parts(half_widths: FloatArray, tapers: FloatArray) -> list[FloatArray]:
    """Return half width and part of each Q inside the widest one, one after the other.

    Args:
        half_widths: of roundings. Shape (m,) [m].
        tapers: how much of each tapers off. Shape (m,).
    """
    _, *inner = PARTS
    return [column for part, width in inner for column in (width * half_widths, part * tapers)]


def tapered(joints: RoundedJoints, widths: Widths, count: int) -> Widths:
    """Return widths that use the room beside corners that stand alone.

    Args:
        joints: that are rounded.
        widths: of roundings of the third degree.
        count: so many of the first ones stay as they are.
    """
    old = widths.half_widths
    corners = widths.single & (joints.bends == 0.0)
    corners[:count] = False
    if not corners.any():
        return widths
    heights = (1.0 - SPARE) * joints.tolerances[corners] / joints.distances[corners]
    wanted = np.zeros(len(old))
    wanted[corners] = np.maximum(WIDEST * heights - old[corners], 0.0)
    left = np.maximum(np.diff(joints.ways) - old[1:] - old[:-1], 0.0)
    # Each may have half of what is left between two, and what the other does not want.
    open_end = (np.inf,)
    before = np.concatenate((open_end, np.maximum(0.5 * left, left - wanted[:-1])))
    after = np.concatenate((np.maximum(0.5 * left, left - wanted[1:]), open_end))
    more = np.minimum(np.minimum(before, after), wanted)
    half_widths = np.maximum(np.minimum(old + more, joints.rooms), old)
    half_widths = np.where(corners, half_widths, old)
    tapers, deviations = widths.tapers.copy(), widths.deviations.copy()
    wider = half_widths[corners]
    tapers[corners] = np.clip((1.0 - 6.0 * heights / wider) / LOWER, 0.0, 1.0)
    deviations[corners] = joints.distances[corners] * heights_of(wider, tapers[corners])
    return widths._replace(half_widths=half_widths, deviations=deviations, tapers=tapers)


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

# Part from which on a rounding counts as tapered off altogether: the rest is rounding error.
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
    # The platform comes along a longer line too fast for the swing of the other line.
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
