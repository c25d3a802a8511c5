r"""How wide roundings are, so that the path keeps its tolerances: the formulas, for some joints.

The rounding of a joint i, of half width $w_i$, adds to the path as programmed

$$\Delta t_i B(s - s_i; w_i) + \Delta k_i E(s - s_i; w_i),\quad
B(x; w) = \frac{w}{6} (1 - |x|/w)^3,\quad E(x; w) = \frac{x (w - |x|)^3}{12 w^2}$$

for $|x| < w$, with the jumps of the unit tangent and of the curvature vector. As
$|E| \le \frac{w^2}{81} (1 - |x|/w)$, the sum of both bounds over all joints is convex between two
joints and so is largest at one: if it is at most the tolerance at each joint, the path nowhere
leaves the larger tolerance of the joints beside it. Where a rounding overlaps no other, it is
known better: its distance from two lines is B times the sine of the angle, and
$|E| \le \frac{27}{3072} w^2$.

Corners that stand alone have wider roundings, which taper off or swing out. One of the third degree
that keeps a tolerance $\varepsilon$ has the half width
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

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints
from tri_glide_kinematics.vectors import BoolArray, FloatArray

# Largest value of |E|, and factor of its convex bound, as parts of the square of w.
LARGEST_BEND = 27.0 / 3072.0
CONVEX_BEND = 1.0 / 81.0

# All tolerances hold by this part more, so that rounding decides nothing.
SPARE = 1e-9

# A rounding of a jump of curvature turns the path by at most a part of this.
WIDEST_BEND = 1.5

# Roundings that share their room use this part of the tolerance first, as neighbours add theirs.
SHARE = 0.9

# Number of joints to each side that a rounding reaches over at most, unless the corner is large.
NEIGHBOURS = 32

# No rounding reaches over more joints that share their room.
FARTHEST_NEIGHBOUR = 250

# A corner is large if the tangent changes by more.
LARGE_TURN = 0.2


class Widths(NamedTuple):
    """Widths and shapes of all roundings.

    Attributes:
        half_widths: of the part that does not swing out. Shape (m,) [m].
        deviations: bound of the deviation of the path at each joint. Shape (m,) [m].
        single: whether a rounding overlapped no other when it was made. Shape (m,).
        tapers: how much of that part tapers off, from 0 to 1. Shape (m,).
        swings: how far the rounding swings out to the other side, by its height; 0 if it does
            not. Shape (m,).
        swing_widths: half width of the part that does; 0 where there is none. Shape (m,) [m].
    """

    half_widths: FloatArray
    deviations: FloatArray
    single: BoolArray
    tapers: FloatArray
    swings: FloatArray
    swing_widths: FloatArray

    @classmethod
    def of_hats(cls, half_widths: FloatArray, deviations: FloatArray, single: BoolArray) -> Widths:
        """Return widths of roundings that neither taper off nor swing out."""
        nothing = np.zeros(len(half_widths))
        return cls(half_widths, deviations, single, nothing, nothing, nothing)

    @property
    def reaches(self) -> FloatArray:
        """Half widths of whole roundings. Shape (m,) [m]."""
        return np.asarray(np.maximum(self.half_widths, self.swing_widths))

    def part(self, some: slice) -> Widths:
        """Return ``some`` of them."""
        return Widths(*(getattr(self, name)[some] for name in self._fields))

    def followed_by(self, others: Widths) -> Widths:
        """Return these and then ``others``."""
        both = ((getattr(self, name), getattr(others, name)) for name in self._fields)
        return Widths(*(np.concatenate(pair) for pair in both))


NONE_KEPT = Widths.of_hats(np.zeros(0), np.zeros(0), np.zeros(0, dtype=bool))


class Weights(NamedTuple):
    """How much the rounding of each joint counts: bound is turns B + bends w^2 (1 - |x|/w).

    Attributes:
        turns: Shape (m,).
        bends: Shape (m,) [1/m].
    """

    turns: FloatArray
    bends: FloatArray


def width_that_fits(joints: RoundedJoints, turns: FloatArray, bend: float) -> FloatArray:
    """Return the widths with which roundings that do not overlap just keep the tolerances."""
    tolerances = (1.0 - SPARE) * joints.tolerances
    of_corner = 6.0 * tolerances / turns
    # The corner is the farthest place if the curvature jumps by little.
    little = joints.bends * of_corner <= 6.0 * turns
    half, bends = turns / 12.0, bend * joints.bends
    root = np.sqrt(half * half + bends * tolerances)
    return np.where(little, of_corner, tolerances / (half + root))


def widths_alone(joints: RoundedJoints) -> FloatArray:
    """Return the widths of roundings that overlap no others. Shape (m,) [m]."""
    with np.errstate(divide="ignore", over="ignore"):
        most = np.minimum(joints.rooms, WIDEST_BEND / joints.bends)
        return np.minimum(width_that_fits(joints, joints.distances, LARGEST_BEND), most)


def deviations_alone(joints: RoundedJoints, widths: FloatArray) -> FloatArray:
    """Return the largest distance from the path as programmed of roundings that stand alone."""
    of_corner = joints.distances * widths / 6.0
    of_bend = LARGEST_BEND * joints.bends * widths * widths
    little = joints.bends * widths <= 6.0 * joints.distances
    return np.where(little, of_corner, of_corner + of_bend)


def are_crowded(ways: FloatArray, widths: FloatArray) -> BoolArray:
    """Return which roundings of these ``widths`` overlap others. Shape (m,)."""
    crowded = np.zeros(len(ways), dtype=bool)
    too_near = widths[1:] + widths[:-1] > np.diff(ways)
    crowded[1:] |= too_near
    crowded[:-1] |= too_near
    return crowded


def widths_in_crowd(joints: RoundedJoints, alone: FloatArray) -> FloatArray:
    """Return the widths at most of roundings that overlap others. Shape (m,) [m]."""
    with np.errstate(divide="ignore"):
        return np.minimum(alone, width_that_fits(joints, joints.turns, CONVEX_BEND))


def widths_by_turns(
    joints: RoundedJoints, turns: FloatArray, widths: FloatArray, some: slice
) -> FloatArray:
    """Return about the width at which many small corners around a joint use its tolerance.

    Corners within a third of a width w count for 8/27 w/6 of their turn at least.

    Args:
        joints: all that are rounded.
        turns: sum of how much the joints before each, and before the end, count. Shape (m + 1,).
        widths: at most, of ``some`` roundings. Shape (n,) [m].
        some: of the joints.
    """
    ways = joints.ways[some]
    # Joints that are far away must not matter.
    widths = np.minimum(widths, reaches_over(joints.ways, FARTHEST_NEIGHBOUR, some))
    for _ in range(3):
        near = turns[np.searchsorted(joints.ways, ways + widths / 3.0)]
        near -= turns[np.searchsorted(joints.ways, ways - widths / 3.0)]
        fitting = (20.25 / np.maximum(near, SPARE)) * joints.tolerances[some]
        widths = np.minimum(widths, np.sqrt(widths * fitting))
    return widths


def reaches_over(ways: FloatArray, count: int, some: slice) -> FloatArray:
    """Return widths that reach over ``count`` joints to one side, and no more to the other.

    Args:
        ways: of all joints. Shape (m,) [m].
        count: of joints.
        some: of the joints, for which they are returned.
    """
    joints, last = np.arange(some.start, some.stop), len(ways) - 1
    here = ways[some]
    before = here - ways[np.maximum(joints - count, 0)]
    before[joints < count] = np.inf
    after = ways[np.minimum(joints + count, last)] - here
    after[joints + count > last] = np.inf
    return np.asarray(np.minimum(before, after))


def excess_in_crowd(
    joints: RoundedJoints, widths: FloatArray, cubic: FloatArray, linear: FloatArray
) -> FloatArray:
    """Return what all roundings add at joints, as part of what is allowed first. Shape (m,).

    Args:
        joints: that are rounded.
        widths: of their roundings. Shape (m,) [m].
        cubic: sum over all joints that a rounding reaches over, of what each counts and of the cube
            of how far it is reached beyond. Shape (m,) [m^3].
        linear: the same for jumps of curvature, and of how far it is reached beyond. Shape (m,).
    """
    added = cubic / (6.0 * widths * widths) + linear * widths
    return np.asarray(added / (SHARE * joints.tolerances))


def is_too_far(excess: FloatArray) -> BoolArray:
    """Return where deviations are larger than the tolerance, as parts of which they are given."""
    return np.asarray(excess > 1.0)


def halves_between(ways: FloatArray) -> FloatArray:
    """Return half the way to the nearer neighbour. Shape (m,) [m]."""
    open_end, gaps = (np.inf,), np.diff(ways)
    both = np.minimum(np.concatenate((open_end, gaps)), np.concatenate((gaps, open_end)))
    return np.asarray(0.5 * both)


def grown(joints: RoundedJoints, alone: FloatArray, widths: Widths) -> Widths:
    """Return the widths, larger where the roundings do not overlap and so are known better."""
    gaps, half_widths = np.diff(joints.ways), widths.half_widths
    apart = np.ones(len(gaps) + 2, dtype=bool)
    apart[1:-1] = np.maximum(half_widths[1:], half_widths[:-1]) <= 0.5 * gaps
    free = apart[1:] & apart[:-1]
    wider = np.maximum(half_widths, np.minimum(alone, halves_between(joints.ways)))
    found = np.where(free, wider, half_widths)
    deviations = np.where(free, deviations_alone(joints, found), widths.deviations)
    return Widths.of_hats(found, deviations, widths.single | free)


def with_kept(widths: Widths, kept: Widths) -> Widths:
    """Return the widths, those that are kept as they are."""
    count = len(kept.half_widths)
    # The others do not reach to the middle of those that are single.
    found = np.maximum(kept.deviations, widths.deviations[:count])
    deviations = np.where(kept.single, kept.deviations, found)
    return kept._replace(deviations=deviations).followed_by(widths.part(slice(count, None)))


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
