"""More segments behind a path that is being driven, which stays as it is up to a place."""

from __future__ import annotations

from math import dist

from tri_glide_kinematics.interruptible import Interruptible
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
