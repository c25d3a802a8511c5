"""More segments behind a path that is being driven, which stays as it is up to a place."""

from __future__ import annotations

from dataclasses import replace
from math import dist

import numpy as np

from tri_glide_kinematics.interruptible import (
    Interruptible,
    blocks,
    column_of,
    columns_of,
    indices_of,
)
from tri_glide_kinematics.motion.path.corners import RoundedJoints, Widths, widths_of
from tri_glide_kinematics.motion.path.errors import ApartError
from tri_glide_kinematics.motion.path.input_checks import check_count
from tri_glide_kinematics.motion.path.segments import JOINED_WITHIN, Segments, joined_in_pieces
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
    if not distance <= JOINED_WITHIN:
        raise ApartError(end, start, distance, JOINED_WITHIN)
    return (yield from joined_in_pieces((segments, more)))


def stops_kept(stops: FloatArray, place: float) -> FloatArray:
    """Return at which of the ``stops`` of a path it still stops with more behind it [m]."""
    return stops[1:] if stops[-1] - place < LEAST_ROOM else stops[1:-1]


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
    (``swinging``).
    """
    ways = joints.ways[: len(kept.half_widths)]
    begin, first = place, 0
    for some in blocks(len(ways)):
        part = kept.part(some)
        middles = ways[some] + np.maximum(0.5 * part.half_widths, part.swing_widths)
        begin = max(begin, float(middles[part.single].max(initial=place)))
        # What has ended before does not matter.
        first += int(np.count_nonzero(ways[some] + part.reaches <= place))
        yield
    near = joints.part(slice(first, None))
    rooms, swing_rooms = yield from columns_of(
        len(near.ways),
        lambda some: (
            np.minimum(near.rooms_before[some], np.maximum(near.ways[some] - begin, 0.0)),
            np.minimum(near.rooms_before[some], np.maximum(near.ways[some] - place, 0.0)),
        ),
    )
    widths = yield from widths_of(
        replace(near, rooms_before=rooms), kept.part(slice(first, None)), swing_rooms
    )

    def all_of(some: slice) -> Widths:
        behind = slice(max(some.start - first, 0), max(some.stop - first, 0))
        return kept.part(slice(first)).part(some).followed_by(widths.part(behind))

    return Widths(*(yield from columns_of(len(joints.ways), all_of, spare_zeros=True)))
