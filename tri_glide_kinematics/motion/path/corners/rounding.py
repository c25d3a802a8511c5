"""How a path is rounded, stage by stage: its joints, how wide they are rounded, what that adds.

What is done for some joints, or between some breaks, stands in ``joints``, ``widths`` and
``corrections``. Here it is done for all of them, interruptibly. Functions inside of others work on
``some`` of the rows, with the values that the names around them have at that time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    picked,
    sorting,
)
from tri_glide_kinematics.motion.path.corners.corrections import (
    SUM_BLOCK,
    Breaks,
    Layer,
    RoundingSums,
    carried_on,
    changes_at,
    roundings_over,
)
from tri_glide_kinematics.motion.path.corners.joints import (
    Jumps,
    RoundedJoints,
    ShapedCorners,
    jumps_at,
    least_between,
    rooms_at,
)
from tri_glide_kinematics.motion.path.corners.widths import (
    CONVEX_BEND,
    LARGE_TURN,
    LARGEST_BEND,
    LOWER,
    NEIGHBOURS,
    NONE_KEPT,
    PARTS,
    SPARE,
    Weights,
    Widths,
    are_crowded,
    deviations_alone,
    excess_in_crowd,
    grown,
    halves_between,
    inner_parts,
    is_too_far,
    reaches_over,
    swing_parts,
    swung,
    tapered,
    widths_alone,
    widths_by_turns,
    widths_in_crowd,
    with_kept,
)
from tri_glide_kinematics.motion.path.segments import Segments
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Indices

# The widths are made smaller at most so often, until all tolerances hold and the way driven is
# nowhere too short.
MAX_ROUNDS = 40

# Number of times that widths in a crowd are made smaller before that.
FIRST_ROUNDS = 4

# Roundings are made smaller to this part where they reach too far over one that stays as it is, or
# where together they would make the way driven too short.
SMALLER = 0.7

# Two breaks that are nearer, as part of the path's length, are one: the rest is rounding error.
SAME_BREAK = 1e-13

# The sums are formed at all breaks if they have no more terms, or no more each on average.
FEW_TERMS = 4000
FEW_EACH = 2

# Number of spans between breaks that are worked on together.
CARRIED_SPANS = 64 * SUM_BLOCK

# Number of joints that are worked on together where their neighbours are searched for.
SEARCHED_ROWS = 2000

# Number of terms of sums that are worked on together.
TERMS = 2000

NO_STOPS = np.zeros(0)


def joints_of(
    segments: Segments, stops: FloatArray = NO_STOPS, shaped: ShapedCorners | None = None
) -> Interruptible[tuple[RoundedJoints, FloatArray]]:
    """Return the joints of a path that are rounded, and the ways at all stops [m].

    Args:
        segments: of the path.
        stops: ways of joints that are stops in any case, unless they are smooth; ascending [m].
        shaped: how corners are driven with a shaper; None without one.
    """
    ways = yield from Segments.joints.in_pieces(segments)
    inner, tolerances = ways[1:-1], segments.tolerances[:-1]
    changes = columns_of(
        len(inner), lambda some: jumps_at(segments, some, stops, shaped), spare_zeros=True
    )
    jumps = Jumps(*(yield from changes))
    stopped = yield from picked(inner, (yield from indices_of(jumps.stops)))
    all_stops = yield from concatenated((ways[:1], stopped, ways[-1:]))
    rounded = yield from indices_of(jumps.rounded)
    free = yield from _free(tolerances, jumps, rounded)
    columns: list[NDArray[Any]] = [inner, *jumps[:5], tolerances]
    # Nothing is copied if all joints are rounded, as those of a dense path.
    if len(rounded) < len(inner):
        columns = yield from columns_of(
            len(rounded),
            lambda some: [column[rounded[some]] for column in columns],
            spare_zeros=True,
        )
    rooms = yield from columns_of(len(rounded), lambda some: rooms_at(columns[0][some], all_stops))
    return RoundedJoints(*(*columns, *rooms, free)), all_stops


def _free(tolerances: FloatArray, jumps: Jumps, rounded: Indices) -> Interruptible[BoolArray]:
    """Return whether no smooth joint beside a rounded one has a smaller tolerance.

    Args:
        tolerances: of all joints between segments. Shape (n - 1,) [m].
        jumps: at these joints.
        rounded: indices of the rounded joints, ascending. Shape (m,).

    Returns:
        Shape (m,).
    """
    rough = yield from indices_of(jumps.rough)
    smooth = yield from concatenated((jumps.smooth_tolerances, np.array([np.inf])))
    # Of the smooth joints from one that is not to the next.
    heads = yield from concatenated((np.zeros(1, dtype=np.intp), rough, np.array([len(smooth)])))
    least = yield from column_of(len(rough) + 1, lambda some: least_between(smooth, heads, some))

    def is_free(some: slice) -> BoolArray:
        here = rounded[some]
        following = np.searchsorted(rough, here)
        beside = np.minimum(least[following], least[following + 1])
        return np.asarray(beside >= tolerances[here])

    return (yield from column_of(len(rounded), is_free))


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


def corrections_of(
    ways: FloatArray, joints: RoundedJoints, widths: Widths
) -> Interruptible[tuple[FloatArray, FloatArray]]:
    """Return what the roundings add to a path, as polynomials; interruptibly.

    Args:
        ways: of all joints, rounded or not. Shape (n + 1,) [m].
        joints: that are rounded.
        widths: of the roundings; of two, the one that begins first also ends first.

    Returns:
        The breaks, shape (k + 1,) [m]; and from each to the next the coefficients of ascending
        powers of the way from the break: four, or five if the curvature jumps at a joint or a
        rounding tapers off. Shape (k, 4 or 5, 3).
    """
    layers = yield from _layers(joints, widths)
    all_breaks = yield from _breaks(ways, layers)
    # The first layer has terms of the highest degree, so that the table is wide enough for all.
    table: FloatArray | None = None
    for layer, breaks in zip(layers, all_breaks):
        table = yield from _with_layer(table, layer, breaks)
    return all_breaks[0].ways, np.asarray(table)


def _with_layer(
    table: FloatArray | None, layer: Layer, breaks: Breaks
) -> Interruptible[FloatArray]:
    """Return the ``table`` of coefficients with those of a layer added; the first makes it."""
    count, terms = len(breaks.ways) - 1, 0
    over = yield from columns_of(count, lambda some: roundings_over(breaks, some))
    sums = RoundingSums(breaks, layer, *over)
    for some in blocks(count):
        terms += int(sums.counts(some).sum())
        yield
    carries_on = terms > max(FEW_TERMS, FEW_EACH * count)
    made = np.empty((count, sums.size, 3)) if table is None else table
    for begin in range(0, count, CARRIED_SPANS):
        some = slice(begin, min(begin + CARRIED_SPANS, count))
        added = yield from _corrections_on(sums, some, carries_on)
        if table is None:
            made[some] = added
        else:
            made[some, : sums.size] += added
        yield
    return made


def _layers(joints: RoundedJoints, widths: Widths) -> Interruptible[list[Layer]]:
    """Return the layers of all roundings, those with terms of the fourth degree first."""
    total, tapers, half_widths = len(joints.ways), widths.tapers, widths.half_widths
    tapering = yield from indices_of(tapers)
    swinging = yield from indices_of(widths.swings)
    bent = yield from any_of(np.asarray, joints.bends)
    thirds = yield from column_of(total, lambda some: 1.0 - tapers[some])
    fourths = None
    if len(tapering):
        fourths = yield from column_of(total, lambda some: PARTS[0][0] * tapers[some])
    jumps = joints.tangent_jumps, joints.curvature_jumps if bent else None
    layers = [Layer(joints.ways, *jumps, half_widths, thirds, fourths)]
    if len(tapering):
        ways = yield from picked(joints.ways, tapering)
        changes = yield from picked(joints.tangent_jumps, tapering)
        columns = yield from columns_of(
            len(tapering),
            lambda some: inner_parts(half_widths[tapering[some]], tapers[tapering[some]]),
        )
        nothing = np.zeros(len(tapering))
        for narrower, heights in zip(columns[::2], columns[1::2]):
            layers.append(Layer(ways, changes, None, narrower, nothing, heights))
    if len(swinging):
        ways = yield from picked(joints.ways, swinging)
        changes = yield from picked(joints.tangent_jumps, swinging)
        given = half_widths, widths.swings, widths.swing_widths
        columns = yield from columns_of(
            len(swinging), lambda some: swing_parts(*(each[swinging[some]] for each in given))
        )
        for wide, heights in zip(columns[::2], columns[1::2]):
            layers.append(Layer(ways, changes, None, wide, heights, None))
    return layers


def _breaks(ways: FloatArray, layers: Sequence[Layer]) -> Interruptible[list[Breaks]]:
    """Return the joints of a path and the ends of its roundings, each place once.

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
    # A joint counts as the end of a rounding that differs from it by rounding errors only.
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


def _corrections_on(sums: RoundingSums, some: slice, carries_on: bool) -> Interruptible[FloatArray]:
    """Return the coefficients on some spans in succession. Shape (n, size, 3)."""
    formed = sums.counts(some) > 0
    if carries_on:
        heads = np.flatnonzero(formed[::SUM_BLOCK])
        firsts = np.zeros((-(-len(formed) // SUM_BLOCK), sums.size, 3))
        yield from _form(firsts, heads, sums, some.start + SUM_BLOCK * heads)
        changes = changes_at(sums, some)
        yield
        ways = sums.breaks.ways[some.start : some.stop + 1]
        table, is_lossy = carried_on(changes, firsts, ways)
        yield
        table[~formed] = 0.0
        formed &= is_lossy
    else:
        table = np.zeros((len(formed), sums.size, 3))
    rows = np.flatnonzero(formed)
    yield from _form(table, rows, sums, some.start + rows)
    return table


def _form(
    table: FloatArray, rows: Indices, sums: RoundingSums, spans: Indices
) -> Interruptible[None]:
    """Write coefficients on ``spans`` to ``rows`` of a ``table``, each summed over all roundings.

    Args:
        table: Shape (n, size, 3).
        rows: Shape (m,).
        sums: over roundings.
        spans: Shape (m,).
    """
    part = np.cumsum(sums.counts(spans)) // TERMS
    for number in range(int(part[-1]) + 1 if len(part) else 0):
        these = slice(*np.searchsorted(part, (number, number + 1)))
        if these.stop > these.start:
            table[rows[these]] = sums.at(spans[these])
            yield
