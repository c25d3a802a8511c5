"""How wide the rounding of each joint is, so that the path keeps its tolerances."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.paths.crowded_widths import shared_widths
from tri_glide_kinematics.motion.paths.deviations import (
    CONVEX_BEND,
    LARGEST_BEND,
    SPARE,
    Weights,
    deviation_alone,
    deviation_bounds,
    width_alone,
)
from tri_glide_kinematics.motion.paths.joints import RoundedJoints
from tri_glide_kinematics.motion.paths.swinging import swung
from tri_glide_kinematics.motion.paths.tapering import LOWER, tapered
from tri_glide_kinematics.motion.paths.widths import NONE_KEPT, Widths
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
    count = len(kept.half_widths)
    if swing_rooms is None:
        swing_rooms = joints.rooms_before
    with np.errstate(divide="ignore", over="ignore"):
        most = np.minimum(joints.rooms, WIDEST_BEND / joints.bends)
        alone = np.minimum(width_alone(joints, joints.distances, LARGEST_BEND), most)
    yield
    alone[:count] = kept.half_widths
    gaps = np.diff(joints.ways)
    crowded = np.zeros(len(alone), dtype=bool)
    too_near = alone[1:] + alone[:-1] > gaps
    crowded[1:] |= too_near
    crowded[:-1] |= too_near
    crowded[:count] = ~kept.single
    if not crowded.any():
        deviations = deviation_alone(joints, alone)
        found = _with_kept(Widths.of_hats(alone, deviations, ~crowded), kept)
        return swung(joints, tapered(joints, found, count), count, swing_rooms)
    yield
    weights = Weights(
        np.where(crowded, joints.turns, joints.distances),
        np.where(crowded, CONVEX_BEND, LARGEST_BEND) * joints.bends,
    )
    yield
    # What swings out the others do not overlap.
    weights.turns[:count] *= (1.0 - LOWER * kept.tapers) / (1.0 + kept.swings)
    shared = yield from shared_widths(joints, weights, alone)
    least = least_widths(joints.ways, kept.half_widths)
    shared = np.maximum(np.where(crowded, shared, alone), least)
    shared[:count] = kept.half_widths
    yield
    half_widths = enveloped(joints.ways, shared)
    yield
    # Of those that stay, a sum in another order may be larger by rounding.
    allowed = joints.tolerances * np.where(least > 0.0, 1.0, 1.0 - 0.5 * SPARE)
    for _ in range(MAX_ROUNDS):
        deviations = yield from deviation_bounds(joints.ways, weights, half_widths)
        excess = deviations / allowed
        if not (excess > 1.0).any():
            break
        shared = np.where(excess > 1.0, half_widths * np.maximum(0.97 / excess, 0.5), shared)
        over = (excess > 1.0) & (least > 0.0)
        if over.any():
            far = joints.ways[over]
            reaching = joints.ways - half_widths < far[-1]
            reaching &= joints.ways + half_widths > far[0]
            shared = np.where(reaching, np.minimum(shared, SMALLER * half_widths), shared)
        smaller = enveloped(joints.ways, np.maximum(shared, least))
        if (smaller == half_widths).all():
            break
        half_widths = smaller
    else:
        # Roundings that do not overlap hold their tolerances in any case.
        half_widths = np.maximum(np.minimum(half_widths, _halves(gaps)), least)
        deviations = yield from deviation_bounds(joints.ways, weights, half_widths)
    yield
    found = Widths.of_hats(half_widths, deviations, ~crowded)
    found = _grown(joints, alone, found, gaps)
    yield
    found = _with_kept(found, kept)
    yield
    found = tapered(joints, found, count)
    yield
    return swung(joints, found, count, swing_rooms)


def least_widths(ways: FloatArray, kept: FloatArray) -> FloatArray:
    """Return what the widths must not be less than if the first ones stay as they are.

    Those that stay have this width, and no other rounding ends before they do.

    Args:
        ways: of all joints. Shape (m,) [m].
        kept: half widths of the first ones. Shape (k,) [m].

    Returns:
        Shape (m,) [m].
    """
    count = len(kept)
    least = np.zeros(len(ways))
    if count:
        least = np.maximum((ways[:count] + kept).max() - ways, 0.0)
        least[:count] = kept
    return least


def enveloped(ways: FloatArray, widths: FloatArray) -> FloatArray:
    """Return the largest widths below ``widths`` that differ by no more than the ways do.

    So of two roundings the one that begins first also ends first.
    """
    forwards = np.minimum.accumulate(widths - ways) + ways
    backwards = np.minimum.accumulate((widths + ways)[::-1])[::-1] - ways
    return np.asarray(np.minimum(np.minimum(forwards, backwards), widths))


def _halves(gaps: FloatArray) -> FloatArray:
    """Return half the way to the nearer neighbour. Shape (m,) [m]."""
    open_end = (np.inf,)
    both = np.minimum(np.concatenate((open_end, gaps)), np.concatenate((gaps, open_end)))
    return np.asarray(0.5 * both)


def _grown(joints: RoundedJoints, alone: FloatArray, widths: Widths, gaps: FloatArray) -> Widths:
    """Return the widths, larger where the roundings do not overlap and so are known better."""
    half_widths = widths.half_widths
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
