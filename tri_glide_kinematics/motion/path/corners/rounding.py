"""How wide the rounding of each joint is, so that the path keeps its tolerances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import (
    Interruptible,
    accumulated,
    any_of,
    column_of,
    columns_of,
    indices_of,
)
from tri_glide_kinematics.motion.path.corners.crowded_widths import shared_widths
from tri_glide_kinematics.motion.path.corners.deviations import (
    CONVEX_BEND,
    LARGEST_BEND,
    SPARE,
    Weights,
    deviation_alone,
    deviation_bounds,
    is_too_far,
    width_alone,
)
from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints
from tri_glide_kinematics.motion.path.corners.swinging import swung
from tri_glide_kinematics.motion.path.corners.tapering import LOWER, tapered
from tri_glide_kinematics.motion.path.corners.widths import NONE_KEPT, Widths
from tri_glide_kinematics.vectors import FloatArray

# A rounding of a jump of curvature turns the path by at most a part of this.
WIDEST_BEND = 1.5

# The widths are made smaller at most so often, until all tolerances hold.
MAX_ROUNDS = 40

# Roundings that reach too far over one that stays as it is are made smaller to this part.
SMALLER = 0.7


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
    count, total = len(kept.half_widths), len(joints.ways)
    if swing_rooms is None:
        swing_rooms = joints.rooms_before
    alone = yield from column_of(total, lambda some: _alone(joints.part(some)))
    alone[:count] = kept.half_widths

    def overlap(some: slice) -> NDArray[np.bool_]:
        found = _crowded(joints.ways[some], alone[some])
        found[: max(count - some.start, 0)] = ~kept.single[some]
        return found

    crowded = yield from column_of(total, overlap, margin=1)
    if (yield from any_of(np.asarray, crowded)):
        half_widths, deviations = yield from _crowded_widths(joints, alone, crowded, kept)
    else:
        half_widths = alone
        deviations = yield from column_of(
            total, lambda some: deviation_alone(joints.part(some), alone[some])
        )

    def finished(some: slice) -> Widths:
        part, kept_part = joints.part(some), kept.part(some)
        found = Widths.of_hats(half_widths[some], deviations[some], ~crowded[some])
        found = _with_kept(_grown(part, alone[some], found), kept_part)
        found = tapered(part, found, len(kept_part.half_widths))
        return swung(part, found, len(kept_part.half_widths), swing_rooms[some])

    # Each of the last three steps looks at the two neighbours of a joint.
    return Widths(*(yield from columns_of(total, finished, margin=3, spare_zeros=True)))


def _alone(joints: RoundedJoints) -> FloatArray:
    """Return the widths of roundings that overlap no others. Shape (m,) [m]."""
    with np.errstate(divide="ignore", over="ignore"):
        most = np.minimum(joints.rooms, WIDEST_BEND / joints.bends)
        return np.minimum(width_alone(joints, joints.distances, LARGEST_BEND), most)


def _crowded(ways: FloatArray, widths: FloatArray) -> NDArray[np.bool_]:
    """Return which roundings of these ``widths`` overlap others. Shape (m,)."""
    crowded = np.zeros(len(ways), dtype=bool)
    too_near = widths[1:] + widths[:-1] > np.diff(ways)
    crowded[1:] |= too_near
    crowded[:-1] |= too_near
    return crowded


def _crowded_widths(
    joints: RoundedJoints, alone: FloatArray, crowded: NDArray[np.bool_], kept: Widths
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
    weights = yield from _weights(joints, crowded, kept)
    found = yield from shared_widths(joints, weights, alone)
    least = yield from least_widths(ways, kept.half_widths)
    shared = yield from column_of(
        total,
        lambda some: np.maximum(np.where(crowded[some], found[some], alone[some]), least[some]),
    )
    shared[:count] = kept.half_widths
    half_widths = yield from enveloped(ways, shared)
    for _ in range(MAX_ROUNDS):
        deviations = yield from deviation_bounds(ways, weights, half_widths)
        # Of those that stay, a sum in another order may be larger by rounding.
        excess = yield from _excess(joints, deviations, least)
        if not (yield from any_of(is_too_far, excess)):
            break
        shared = yield from _lowered(shared, half_widths, excess)
        if count:
            shared = yield from _reaching_less(ways, shared, half_widths, excess, least)
        smaller = yield from enveloped(ways, (yield from _at_least(shared, least)))
        if not (yield from any_of(np.not_equal, smaller, half_widths)):
            break
        half_widths = smaller
    else:
        # Roundings that do not overlap hold their tolerances in any case.
        half_widths = yield from _at_least((yield from _apart(ways, half_widths)), least)
        deviations = yield from deviation_bounds(ways, weights, half_widths)
    return half_widths, deviations


def _excess(
    joints: RoundedJoints, deviations: FloatArray, least: FloatArray
) -> Interruptible[FloatArray]:
    """Return the deviations as part of the tolerances. Shape (m,)."""

    def excess(some: slice) -> FloatArray:
        # Of those that stay, a sum in another order may be larger by rounding.
        spare = np.where(least[some] > 0.0, 1.0, 1.0 - 0.5 * SPARE)
        return np.asarray(deviations[some] / (joints.tolerances[some] * spare))

    return (yield from column_of(len(deviations), excess))


def _lowered(
    widths: FloatArray, half_widths: FloatArray, excess: FloatArray
) -> Interruptible[FloatArray]:
    """Return ``widths``, less than ``half_widths`` where the tolerance is exceeded. Shape (m,)."""

    def lowered(some: slice) -> FloatArray:
        less = half_widths[some] * np.maximum(0.97 / excess[some], 0.5)
        return np.where(is_too_far(excess[some]), less, widths[some])

    return (yield from column_of(len(widths), lowered))


def _at_least(widths: FloatArray, least: FloatArray) -> Interruptible[FloatArray]:
    """Return the larger of both. Shape (m,)."""
    larger = column_of(len(widths), lambda some: np.maximum(widths[some], least[some]))
    return (yield from larger)


def _apart(ways: FloatArray, widths: FloatArray) -> Interruptible[FloatArray]:
    """Return the ``widths``, made so small that the roundings do not overlap. Shape (m,)."""

    def apart(some: slice) -> FloatArray:
        return np.asarray(np.minimum(widths[some], _halves(np.diff(ways[some]))))

    return (yield from column_of(len(ways), apart, margin=1))


def _weights(
    joints: RoundedJoints, crowded: NDArray[np.bool_], kept: Widths
) -> Interruptible[Weights]:
    """Return how much each rounding counts."""

    def weights(some: slice) -> tuple[FloatArray, FloatArray]:
        turns = np.where(crowded[some], joints.turns[some], joints.distances[some])
        # What swings out the others do not overlap.
        first = kept.part(some)
        turns[: len(first.tapers)] *= (1.0 - LOWER * first.tapers) / (1.0 + first.swings)
        return turns, np.where(crowded[some], CONVEX_BEND, LARGEST_BEND) * joints.bends[some]

    return Weights(*(yield from columns_of(len(crowded), weights, spare_zeros=True)))


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
    count = len(kept)
    if not count:
        return np.zeros(len(ways))
    ends = yield from column_of(count, lambda some: ways[:count][some] + kept[some])
    end = ends.max()
    least = yield from column_of(len(ways), lambda some: np.maximum(end - ways[some], 0.0))
    least[:count] = kept
    return least


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


def _halves(gaps: FloatArray) -> FloatArray:
    """Return half the way to the nearer neighbour. Shape (m,) [m]."""
    open_end = (np.inf,)
    both = np.minimum(np.concatenate((open_end, gaps)), np.concatenate((gaps, open_end)))
    return np.asarray(0.5 * both)


def _grown(joints: RoundedJoints, alone: FloatArray, widths: Widths) -> Widths:
    """Return the widths, larger where the roundings do not overlap and so are known better."""
    gaps, half_widths = np.diff(joints.ways), widths.half_widths
    apart = np.ones(len(gaps) + 2, dtype=bool)
    apart[1:-1] = np.maximum(half_widths[1:], half_widths[:-1]) <= 0.5 * gaps
    free = apart[1:] & apart[:-1]
    grown = np.where(free, np.maximum(half_widths, np.minimum(alone, _halves(gaps))), half_widths)
    deviations = np.where(free, deviation_alone(joints, grown), widths.deviations)
    return Widths.of_hats(grown, deviations, widths.single | free)


def _with_kept(widths: Widths, kept: Widths) -> Widths:
    """Return the widths, those that are kept as they are."""
    count = len(kept.half_widths)
    # The others do not reach to the middle of those that are single.
    found = np.maximum(kept.deviations, widths.deviations[:count])
    deviations = np.where(kept.single, kept.deviations, found)
    return kept._replace(deviations=deviations).followed_by(widths.part(slice(count, None)))
