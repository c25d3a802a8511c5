"""More segments behind a path that is being driven, which stays as it is up to a place."""

from __future__ import annotations

from dataclasses import replace
from math import dist

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.paths.errors import ApartError
from tri_glide_kinematics.motion.paths.inputs import check_count
from tri_glide_kinematics.motion.paths.joints import RoundedJoints
from tri_glide_kinematics.motion.paths.rounding import widths_of
from tri_glide_kinematics.motion.paths.segments import SAME_PLACE, Segments, joined_in_pieces
from tri_glide_kinematics.motion.paths.widths import Widths
from tri_glide_kinematics.vectors import FloatArray

# Where a path ended there is a stop still, if the place up to which it stays is not so far before.
LEAST_ROOM = 1e-6


def in_succession(segments: Segments, more: Segments) -> Interruptible[Segments]:
    """Return ``segments`` with ``more`` behind them, interruptibly.

    Raises:
        ApartError: if they begin elsewhere.
        TooManySegmentsError: if they are too many together.
    """
    check_count(len(segments) + len(more))
    end, start = segments.points[-1].tolist(), more.points[0].tolist()
    distance = dist(end, start)
    if not distance <= SAME_PLACE:
        raise ApartError(end, start, distance, SAME_PLACE)
    return (yield from joined_in_pieces((segments, more)))


def stops_kept(stops: FloatArray, place: float) -> FloatArray:
    """Return at which of the ``stops`` of a path it still stops with more behind it [m]."""
    return stops[1:] if stops[-1] - place < LEAST_ROOM else stops[1:-1]


def widths_kept(joints: RoundedJoints, widths: Widths, place: float) -> Widths:
    """Return the widths of the first joints: those whose roundings begin before a ``place`` [m]."""
    begun = np.flatnonzero(joints.ways - widths.reaches < place)
    return widths.part(slice(int(begun[-1]) + 1 if len(begun) else 0))


def widths_behind(joints: RoundedJoints, kept: Widths, place: float) -> Interruptible[Widths]:
    """Return the widths of all roundings, of which the first ones are kept.

    All others begin at the ``place`` [m] or behind it. A rounding that was known better, as no
    other overlapped it, they overlap at its outer half at most: there its deviation is convex. One
    that swings out they do not overlap. What swings out itself may overlap both, as in any path
    (``swinging``).
    """
    count = len(kept.half_widths)
    ways = joints.ways[:count]
    middles = ways + np.maximum(0.5 * kept.half_widths, kept.swing_widths)
    begin = float(middles[kept.single].max(initial=place))
    rooms = np.minimum(joints.rooms_before, np.maximum(joints.ways - begin, 0.0))
    # What has ended before does not matter.
    first = int(np.count_nonzero(ways + kept.reaches <= place))
    near = replace(joints, rooms_before=rooms).part(slice(first, None))
    swing_rooms = np.minimum(joints.rooms_before, np.maximum(joints.ways - place, 0.0))[first:]
    widths = yield from widths_of(near, kept.part(slice(first, None)), swing_rooms)
    return kept.part(slice(first)).followed_by(widths)
