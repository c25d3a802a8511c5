"""How wide all joints of a path are rounded, also where many roundings share their room.

The formulas stand in ``widths``. Functions inside of others work on ``some`` of the rows, with the
values that the names around them have at that time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tri_glide_kinematics.interruptible import (
    ROWS,
    Interruptible,
    accumulated,
    any_of,
    blocks,
    column_of,
    columns_of,
    concatenated,
    indices_of,
)
from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints
from tri_glide_kinematics.motion.path.corners.widths import (
    CONVEX_BEND,
    LARGE_TURN,
    LARGEST_BEND,
    LOWER,
    NEIGHBOURS,
    NONE_KEPT,
    SPARE,
    Weights,
    Widths,
    are_crowded,
    deviations_alone,
    excess_in_crowd,
    grown,
    halves_between,
    is_too_far,
    reaches_over,
    swung,
    tapered,
    widths_alone,
    widths_by_turns,
    widths_in_crowd,
    with_kept,
)
from tri_glide_kinematics.vectors import BoolArray, FloatArray

# The widths are made smaller at most so often, until all tolerances hold and the way driven is
# nowhere too short.
MAX_ROUNDS = 40

# Number of times that widths in a crowd are made smaller before that.
FIRST_ROUNDS = 4

# Roundings are made smaller to this part where they reach too far over one that stays as it is, or
# where together they would make the way driven too short.
SMALLER = 0.7

# Number of joints that are worked on together where their neighbours are searched for.
SEARCHED_ROWS = 2000


def widths_of(
    joints: RoundedJoints, kept: Widths = NONE_KEPT, swing_rooms: FloatArray | None = None
) -> Interruptible[Widths]:
    """Return widths with which all tolerances hold; interruptibly.

    Args:
        joints: that are rounded.
        kept: what the first of them have and keep. Those that are ``single`` the others overlap
            at their outer half at most (``joints.rooms``).
        swing_rooms: over which roundings that swing out may reach to what is before them, if that
            is more than ``joints.rooms_before``. Shape (m,) [m].
    """
    total = len(joints.ways)
    if swing_rooms is None:
        swing_rooms = joints.rooms_before

    def without_others(some: slice) -> tuple[FloatArray, BoolArray]:
        widths, stay = widths_alone(joints.part(some)), kept.part(some)
        widths[: len(stay.half_widths)] = stay.half_widths
        crowded = are_crowded(joints.ways[some], widths)
        crowded[: len(stay.half_widths)] = ~stay.single
        return widths, crowded

    alone, crowded = yield from columns_of(total, without_others, margin=1)
    if (yield from any_of(np.asarray, crowded)):
        half_widths, deviations = yield from _widths_in_crowd(joints, alone, crowded, kept)
    else:
        half_widths = alone
        deviations = yield from column_of(
            total, lambda some: deviations_alone(joints.part(some), alone[some])
        )

    def finished(some: slice) -> Widths:
        part, stay = joints.part(some), kept.part(some)
        found = Widths.of_hats(half_widths[some], deviations[some], ~crowded[some])
        found = with_kept(grown(part, alone[some], found), stay)
        found = tapered(part, found, len(stay.half_widths))
        return swung(part, found, len(stay.half_widths), swing_rooms[some])

    # Each of the last three steps looks at the two neighbours of a joint.
    return Widths(*(yield from columns_of(total, finished, margin=3, spare_zeros=True)))


def _widths_in_crowd(
    joints: RoundedJoints, alone: FloatArray, crowded: BoolArray, kept: Widths
) -> Interruptible[tuple[FloatArray, FloatArray]]:
    """Return widths of roundings of which some share their room, and how far they deviate.

    Args:
        joints: that are rounded.
        alone: widths that they would have alone. Shape (m,) [m].
        crowded: whether with these they overlap others. Shape (m,).
        kept: what the first of them have and keep.

    Returns:
        Half widths and bounds of the deviation at each joint. Shape (m,) each [m].
    """
    count, total, ways = len(kept.half_widths), len(joints.ways), joints.ways

    def counting(some: slice) -> tuple[FloatArray, FloatArray]:
        turns = np.where(crowded[some], joints.turns[some], joints.distances[some])
        # The others do not overlap a part that swings out.
        first = kept.part(some)
        turns[: len(first.tapers)] *= (1.0 - LOWER * first.tapers) / (1.0 + first.swings)
        return turns, np.where(crowded[some], CONVEX_BEND, LARGEST_BEND) * joints.bends[some]

    weights = Weights(*(yield from columns_of(total, counting, spare_zeros=True)))
    shared = yield from _shared_widths(joints, weights, alone)
    least = yield from least_widths(ways, kept.half_widths)

    def wanted(some: slice) -> FloatArray:
        found = np.maximum(np.where(crowded[some], shared[some], alone[some]), least[some])
        stay = kept.half_widths[some]
        found[: len(stay)] = stay
        return found

    def excess_on(some: slice) -> FloatArray:
        # Of those that stay, a sum in another order may be larger by rounding.
        spare = np.where(least[some] > 0.0, 1.0, 1.0 - 0.5 * SPARE)
        return np.asarray(deviations[some] / (joints.tolerances[some] * spare))

    def lowered(some: slice) -> FloatArray:
        less = half_widths[some] * np.maximum(0.97 / excess[some], 0.5)
        return np.where(is_too_far(excess[some]), less, widths[some])

    def apart_on(some: slice) -> FloatArray:
        return np.asarray(np.minimum(half_widths[some], halves_between(ways[some])))

    widths = yield from column_of(total, wanted)
    half_widths = yield from enveloped(ways, widths)
    for _ in range(MAX_ROUNDS):
        deviations = yield from deviation_bounds(ways, weights, half_widths)
        excess = yield from column_of(total, excess_on)
        if not (yield from any_of(is_too_far, excess)):
            break
        widths = yield from column_of(total, lowered)
        if count:
            widths = yield from _reaching_less(ways, widths, half_widths, excess, least)
        smaller = yield from enveloped(ways, (yield from _at_least(widths, least)))
        if not (yield from any_of(np.not_equal, smaller, half_widths)):
            break
        half_widths = smaller
    else:
        # Roundings that do not overlap hold their tolerances in any case.
        apart = yield from column_of(total, apart_on, margin=1)
        half_widths = yield from _at_least(apart, least)
        deviations = yield from deviation_bounds(ways, weights, half_widths)
    return half_widths, deviations


def _shared_widths(
    joints: RoundedJoints, weights: Weights, alone: FloatArray
) -> Interruptible[FloatArray]:
    """Return the width with which all roundings around a joint together keep its tolerance."""
    total = len(joints.ways)

    def own_terms(some: slice) -> tuple[FloatArray, FloatArray]:
        return weights.turns[some] * widths[some] ** 3, weights.bends[some] * widths[some]

    def add(reaches: FloatArray, of: slice, over: slice) -> None:
        cubic[of] += reaches * reaches * reaches * weights.turns[over]
        if bent:
            linear[of] += reaches * weights.bends[over]

    def excess_on(some: slice) -> FloatArray:
        return excess_in_crowd(joints.part(some), widths[some], cubic[some], linear[some])

    def lowered(some: slice) -> FloatArray:
        less = widths[some] / np.sqrt(np.maximum(excess[some], 1.0))
        return np.where(is_too_far(excess[some]), less, widths[some])

    widths = yield from _widths_at_most(joints, weights, alone)
    bent = yield from any_of(np.asarray, weights.bends)
    for _ in range(FIRST_ROUNDS):
        cubic, linear = yield from columns_of(total, own_terms)
        yield from _over_neighbours(joints.ways, widths, add)
        excess = yield from column_of(total, excess_on)
        if not (yield from any_of(is_too_far, excess)):
            break
        widths = yield from column_of(total, lowered)
    return widths


def _widths_at_most(
    joints: RoundedJoints, weights: Weights, alone: FloatArray
) -> Interruptible[FloatArray]:
    """Return widths that reach over no more than so many joints, except about large corners."""
    ways, total = joints.ways, len(joints.ways)
    if total <= NEIGHBOURS:
        return (
            yield from column_of(
                total, lambda some: widths_in_crowd(joints.part(some), alone[some])
            )
        )
    turns = yield from concatenated((np.zeros(1), weights.turns))
    turns = yield from accumulated(np.add, turns)

    def rough(some: slice) -> tuple[FloatArray, FloatArray, FloatArray]:
        most = widths_in_crowd(joints.part(some), alone[some])
        widths = widths_by_turns(joints, turns, most, some)
        large = np.where(joints.turns[some] > LARGE_TURN, widths, 0.0)
        return widths, large + ways[some], large - ways[some]

    widths, after, before = yield from columns_of(total, rough, rows=SEARCHED_ROWS)
    after = yield from accumulated(np.maximum, after)
    before = (yield from accumulated(np.maximum, before[::-1]))[::-1]

    def at_most(some: slice) -> FloatArray:
        around = np.maximum(after[some] - ways[some], before[some] + ways[some])
        most = np.maximum(reaches_over(ways, NEIGHBOURS, some), around)
        return np.asarray(np.minimum(widths[some], most))

    return (yield from column_of(total, at_most))


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

    def add(reaches: FloatArray, of: slice, over: slice) -> None:
        bounds[over] += reaches * reaches * reaches * cubic[of]
        if bent:
            bounds[over] += reaches * linear[of]

    cubic, linear, bounds = yield from columns_of(len(ways), factors, spare_zeros=True)
    bent = yield from any_of(np.asarray, linear)
    yield from _over_neighbours(ways, half_widths, add)
    return bounds


def _over_neighbours(
    ways: FloatArray, half_widths: FloatArray, add: Callable[[FloatArray, slice, slice], None]
) -> Interruptible[None]:
    """Call ``add`` for all pairs of joints of which the rounding of one reaches over the other.

    Args:
        ways: of the joints. Shape (m,) [m].
        half_widths: of their roundings. Shape (m,) [m].
        add: takes how far roundings reach beyond other joints, 0 if they do not, shape (n,) [m],
            which joints these roundings are of, and which joints they reach over.
    """
    # Block by block, as all that a block needs stays in the cache of the processor.
    for first in range(0, len(ways) - 1, ROWS):
        for offset in range(1, len(ways) - first):
            last = min(first + ROWS, len(ways) - offset)
            before, behind = slice(first, last), slice(first + offset, last + offset)
            gaps = ways[behind] - ways[before]
            some_reach = False
            for of, over in ((before, behind), (behind, before)):
                reaches = half_widths[of] - gaps
                np.maximum(reaches, 0.0, out=reaches)
                if reaches.any():
                    some_reach = True
                    add(reaches, of, over)
                yield
            if not some_reach:
                break


def _at_least(widths: FloatArray, least: FloatArray) -> Interruptible[FloatArray]:
    """Return the larger of both. Shape (m,)."""
    return column_of(len(widths), lambda some: np.maximum(widths[some], least[some]))


def _reaching_less(
    ways: FloatArray,
    widths: FloatArray,
    half_widths: FloatArray,
    excess: FloatArray,
    least: FloatArray,
) -> Interruptible[FloatArray]:
    """Return ``widths``, smaller where roundings reach over those that stay and deviate too far."""
    total = len(ways)
    over = yield from column_of(total, lambda some: is_too_far(excess[some]) & (least[some] > 0.0))
    found = yield from indices_of(over)
    if not len(found):
        return widths
    first, last = ways[found[0]], ways[found[-1]]

    def lowered(some: slice) -> FloatArray:
        reaching = ways[some] - half_widths[some] < last
        reaching &= ways[some] + half_widths[some] > first
        less = np.minimum(widths[some], SMALLER * half_widths[some])
        return np.where(reaching, less, widths[some])

    return (yield from column_of(total, lowered))


def least_widths(ways: FloatArray, kept: FloatArray) -> Interruptible[FloatArray]:
    """Return what the widths must not be less than if the first ones stay as they are.

    Those that stay have this width, and no other rounding ends before they do.

    Args:
        ways: of all joints. Shape (m,) [m].
        kept: half widths of the first ones. Shape (k,) [m].

    Returns:
        Shape (m,) [m].
    """
    if not len(kept):
        return np.zeros(len(ways))
    ends = yield from column_of(len(kept), lambda some: ways[: len(kept)][some] + kept[some])
    end = ends.max()

    def least(some: slice) -> FloatArray:
        found, stay = np.maximum(end - ways[some], 0.0), kept[some]
        found[: len(stay)] = stay
        return np.asarray(found)

    return (yield from column_of(len(ways), least))


def enveloped(ways: FloatArray, widths: FloatArray) -> Interruptible[FloatArray]:
    """Return the largest widths below ``widths`` that differ by no more than the ways do.

    So of two roundings the one that begins first also ends first.
    """
    begins, ends = yield from columns_of(
        len(ways), lambda some: (widths[some] - ways[some], widths[some] + ways[some])
    )
    begins = yield from accumulated(np.minimum, begins)
    ends = (yield from accumulated(np.minimum, ends[::-1]))[::-1]

    def least_of(some: slice) -> FloatArray:
        both = np.minimum(begins[some] + ways[some], ends[some] - ways[some])
        return np.minimum(both, widths[some])

    return (yield from column_of(len(ways), least_of))


def widths_kept(joints: RoundedJoints, widths: Widths, place: float) -> Interruptible[Widths]:
    """Return the widths of the first joints: those whose roundings begin before a ``place`` [m]."""
    begun = yield from column_of(
        len(joints.ways), lambda some: joints.ways[some] - widths.part(some).reaches < place
    )
    indices = yield from indices_of(begun)
    return widths.part(slice(int(indices[-1]) + 1 if len(indices) else 0))


def widths_behind(joints: RoundedJoints, kept: Widths, place: float) -> Interruptible[Widths]:
    """Return the widths of all roundings, of which the first ones are kept.

    All others begin at the ``place`` [m] or behind it. A rounding that was known better, as no
    other overlapped it, they overlap at its outer half at most: there its deviation is convex. One
    that swings out they do not overlap. What swings out itself may overlap both, as in any path
    (``widths``).
    """
    ways = joints.ways[: len(kept.half_widths)]
    begin, first = place, 0
    for some in blocks(len(ways)):
        part = kept.part(some)
        middles = ways[some] + np.maximum(0.5 * part.half_widths, part.swing_widths)
        begin = max(begin, float(middles[part.single].max(initial=place)))
        # Roundings that have ended before do not matter.
        first += int(np.count_nonzero(ways[some] + part.reaches <= place))
        yield
    near = joints.part(slice(first, None))

    def rooms_behind(some: slice) -> tuple[FloatArray, FloatArray]:
        rooms, at = near.rooms_before[some], near.ways[some]
        hats, swings = (np.minimum(rooms, np.maximum(at - end, 0.0)) for end in (begin, place))
        return hats, swings

    rooms, swing_rooms = yield from columns_of(len(near.ways), rooms_behind)
    widths = yield from widths_of(
        replace(near, rooms_before=rooms), kept.part(slice(first, None)), swing_rooms
    )

    def all_of(some: slice) -> Widths:
        behind = slice(max(some.start - first, 0), max(some.stop - first, 0))
        return kept.part(slice(first)).part(some).followed_by(widths.part(behind))

    return Widths(*(yield from columns_of(len(joints.ways), all_of, spare_zeros=True)))
