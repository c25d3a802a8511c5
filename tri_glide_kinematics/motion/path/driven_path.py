r"""The path as driven: that as programmed, its joints rounded to their tolerances.

Both have the same parameter s, the way programmed: p(s) = g(s) + corrections (``rounding``). So all
stays in closed form, and p is twice continuously differentiable wherever the platform need not
stop; its third derivative is bounded and jumps at the breaks alone. The way driven, which is
shorter in roundings, is the integral of |p'| (``arc_length``).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.interruptible import (
    Interruptible,
    any_of,
    at_once,
    blocks,
    column_of,
    columns_of,
)
from tri_glide_kinematics.motion.path.arc_length import ArcLength
from tri_glide_kinematics.motion.path.corners import (
    LEAST_RATE,
    RoundedJoints,
    Widths,
    corrections_of,
    enveloped,
    joints_of,
    least_widths,
    widths_behind,
    widths_kept,
    widths_of,
)
from tri_glide_kinematics.motion.path.extension import in_succession, stops_kept
from tri_glide_kinematics.motion.path.pieces import Indices, Pieces, segment_of_pieces
from tri_glide_kinematics.motion.path.segments import Segments
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text

# Where roundings that overlap would make the way driven too short, they are made smaller so often,
# each time to this part.
MAX_ROUNDS = 40
SMALLER = 0.7

# Two paths are driven alike as long as they differ by no more than this [m].
DRIVEN_ALIKE = 1e-12

# Places in a piece at which it is looked for where they do.
SAMPLES = 9

# So many pieces are worked on between two breaks of the computation.
AT_A_TIME = 2000


class DrivenPath(Pieces):
    """The path as driven, over the programmed way s; see ``Pieces``.

    Attributes:
        stops: ascending ways at which the platform has to stop, both ends included [m].
        rounded: joints that are rounded.
        widths: of their roundings.
    """

    def __init__(
        self,
        pieces: Pieces,
        stops: FloatArray,
        rounded: RoundedJoints,
        widths: Widths,
    ) -> None:
        """Use ``of`` or ``in_pieces``."""
        # What the pieces have is taken over, not worked out again.
        vars(self).update(vars(pieces))
        self.stops = stops
        self.rounded = rounded
        self.widths = widths

    def __repr__(self) -> str:
        """Return how many segments it has, where it stops, and how far it deviates."""
        stops = len(self.stops)
        bound = number_text(1e3 * self.deviation_bound, 3)
        return f"<DrivenPath, {len(self.segments)} segments, {stops} stops, within {bound} mm>"

    @classmethod
    def of(cls, segments: Segments) -> DrivenPath:
        """Round the joints of a path, at once."""
        return at_once(cls.in_pieces(segments))

    @classmethod
    def in_pieces(cls, segments: Segments) -> Interruptible[DrivenPath]:
        """Round the joints of a path, interruptibly."""
        rounded, stops = yield from joints_of(segments)
        yield
        widths = yield from widths_of(rounded)
        return (yield from cls._rounded(segments, stops, rounded, widths, None))

    def extended(self, more: Segments, place: float) -> Interruptible[DrivenPath]:
        """Return this path with more segments behind it, driven as before up to a ``place`` [m].

        Roundings that begin before the place stay as they are. Where this path ended there is a
        joint with the tolerance of its last segment: a stop if that is 0 (and the joint not
        smooth), or if the place is less than a micrometre before it. What comes before is put
        together again as well, so this takes as long as to round the whole path: some 20 to 30 ms
        for 10,000 dense points, 0.2 s for 10,000 corners that stand alone; interruptibly.

        Args:
            more: begin where this path ends.
            place: programmed way [m].

        Raises:
            ApartError: if they begin elsewhere.
            TooManySegmentsError: if they are too many together.
        """
        segments = yield from in_succession(self.segments, more)
        yield
        rounded, stops = yield from joints_of(segments, stops_kept(self.stops, place))
        yield
        kept = yield from widths_kept(self.rounded, self.widths, place)
        widths = yield from widths_behind(rounded, kept, place)
        least = yield from least_widths(rounded.ways, kept.half_widths)
        return (yield from self._rounded(segments, stops, rounded, widths, least))

    @classmethod
    def _rounded(
        cls,
        segments: Segments,
        stops: FloatArray,
        rounded: RoundedJoints,
        widths: Widths,
        least: FloatArray | None,
    ) -> Interruptible[DrivenPath]:
        """Put the path together; its roundings are made smaller where the way would be short."""
        for _ in range(MAX_ROUNDS):
            yield
            breaks, table = yield from corrections_of(segments.joints, rounded, widths)
            segment = yield from segment_of_pieces(segments, breaks)
            yield from _add_programmed(segments, breaks, table, segment)
            pieces = Pieces(segments, breaks, table, segment)
            slow = yield from _slow_places(pieces)
            if not len(slow):
                break
            smaller = yield from _smaller(widths, rounded, slow, least)
            if not (yield from _differ(smaller, widths)):
                break
            widths = smaller
        return cls(pieces, stops, rounded, widths)

    @property
    def tolerances(self) -> FloatArray:
        """Tolerances of the joints at the ends of all segments. Shape (n,) [m]."""
        return self.segments.tolerances

    @property
    def deviation_bound(self) -> float:
        """No place is farther from the path as programmed [m]."""
        return float(self.widths.deviations.max(initial=0.0))

    def segment_of(self, ways: ArrayLike) -> Indices:
        """Return the index of the segment that each programmed way lies on, of two the later."""
        found = np.searchsorted(self.joints, ways, "right") - 1
        return np.asarray(np.clip(found, 0, len(self.segments) - 1))

    def speed_limits(self, ways: ArrayLike) -> FloatArray:
        """Return the largest speeds of the platform; at a joint, the lower one. Shape (n,) [m/s].

        They are infinite where the path names none.
        """
        before = np.searchsorted(self.joints, ways, "left") - 1
        before = np.clip(before, 0, len(self.segments) - 1)
        speeds = self.segments.speeds
        return np.asarray(np.minimum(speeds[before], speeds[self.segment_of(ways)]))

    @cached_property
    def arc_length(self) -> ArcLength:
        """The way driven over the way programmed."""
        return at_once(self._measured())

    @property
    def is_measured(self) -> bool:
        """Whether ``arc_length`` has been worked out."""
        return "arc_length" in self.__dict__

    def measured(self) -> Interruptible[ArcLength]:
        """Return ``arc_length``, worked out interruptibly if it has not been yet."""
        if not self.is_measured:
            self.__dict__["arc_length"] = yield from self._measured()
        return self.arc_length

    def _measured(self) -> Interruptible[ArcLength]:
        turns = yield from column_of(len(self.segment), lambda some: self.bounds_on(some).turns)
        return (yield from ArcLength.measured(self.breaks, turns, self.rates))

    def ways(self, programmed: ArrayLike) -> FloatArray:
        """Return the way driven at programmed ways, shape (n,) [m]. Shape (n,) [m]."""
        places = np.asarray(programmed, dtype=np.float64)
        return self.arc_length.at(self.pieces_of(places), places)

    def place_of(self, driven: ArrayLike) -> FloatArray:
        """Return the programmed way at ways driven, shape (n,) [m]. Shape (n,) [m]."""
        return self.arc_length.inverse(np.asarray(driven, dtype=np.float64))

    def agrees_until(self, other: DrivenPath) -> float:
        """Return the programmed way up to which another path is driven as this one is [m].

        With segments added, a path is driven otherwise near its former end, where it stopped.
        """
        count = min(len(self.table), len(other.table))
        columns = min(self.table.shape[1], other.table.shape[1])
        steps = np.diff(self.breaks[: count + 1])[:, np.newaxis]
        apart = np.abs(self.table[:count, :columns] - other.table[:count, :columns]).max(axis=2)
        apart *= steps ** np.arange(columns)
        for path in (self, other):
            beyond = np.abs(path.table[:count, columns:]).max(axis=(1, 2), initial=0.0)
            apart[:, 0] += beyond * steps[:, 0] ** columns
        differs = (apart.max(axis=1) > DRIVEN_ALIKE) | (
            self.segment[:count] != other.segment[:count]
        )
        ends, other_ends = self.breaks[1 : count + 1], other.breaks[1 : count + 1]
        parted = differs | (np.abs(ends - other_ends) > DRIVEN_ALIKE)
        first = int(np.flatnonzero(np.append(parted, True))[0])
        # One of two equal pieces may be longer.
        if first < count and not differs[first]:
            return float(min(ends[first], other_ends[first]))
        return float(self.breaks[first])


def _add_programmed(
    segments: Segments, breaks: FloatArray, table: FloatArray, segment: Indices
) -> Interruptible[None]:
    """Add to corrections the path as programmed; of an arc, only the point where it begins."""
    starts = breaks[:-1]
    for first in range(0, len(table), AT_A_TIME):
        yield
        some = slice(first, first + AT_A_TIME)
        numbers = segment[some]
        along = segments.tangents[numbers]
        along[segments.curvatures[numbers] != 0.0] = 0.0
        table[some, 1] += along
        along *= (starts[some] - segments.joints[numbers])[:, np.newaxis]
        along += segments.points[numbers]
        table[some, 0] += along


def _slow_places(path: Pieces) -> Interruptible[FloatArray]:
    """Return programmed ways at which the way driven is too short [m]."""
    found = [np.zeros(0)]
    for part in blocks(len(path.segment)):
        yield
        # Most pieces are too short for it, or too nearly straight.
        near = part.start + np.flatnonzero(path.bounds_on(part).least_rates < LEAST_RATE)
        for first in range(0, len(near), AT_A_TIME // SAMPLES):
            some = near[first : first + AT_A_TIME // SAMPLES]
            pieces = np.repeat(some, SAMPLES)
            starts = path.breaks[pieces]
            parts = np.tile(np.linspace(0.0, 1.0, SAMPLES), len(some))
            ways = starts + parts * (path.breaks[pieces + 1] - starts)
            # A corner that is just not too sharp to be rounded is not too sharp.
            found.append(ways[path.rates(pieces, ways) < 0.99 * LEAST_RATE])
            yield
    return np.concatenate(found)


def _differ(some: Widths, others: Widths) -> Interruptible[bool]:
    """Return whether roundings reach farther with some widths than with others."""
    return (
        yield from any_of(
            lambda a, b, c, d: np.maximum(a, b) != np.maximum(c, d),
            *(some.half_widths, some.swing_widths),
            *(others.half_widths, others.swing_widths),
        )
    )


def _smaller(
    widths: Widths, rounded: RoundedJoints, slow: FloatArray, least: FloatArray | None
) -> Interruptible[Widths]:
    """Return widths that are smaller where the roundings reach over the ways ``slow`` [m].

    None becomes smaller than ``least``, shape (m,) [m].
    """
    half_widths, ways = widths.half_widths, rounded.ways
    places = np.sort(slow)

    def lowered(some: slice) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        part, at = widths.part(some), ways[some]
        first = np.searchsorted(places, at - part.reaches)
        over = np.searchsorted(places, at + part.reaches, "right") > first
        smaller = np.where(over, SMALLER * part.half_widths, part.half_widths)
        stays = np.zeros(len(at), dtype=bool)
        if least is not None:
            smaller = np.maximum(smaller, least[some])
            stays = part.half_widths <= least[some]
        swings = np.where(over & ~stays, SMALLER, 1.0) * part.swing_widths
        return smaller, swings, stays

    smaller, swing_widths, stays = yield from columns_of(len(ways), lowered)
    envelope = yield from enveloped(ways, smaller)
    # The envelope is exact but for rounding.
    found = yield from column_of(
        len(ways), lambda some: np.where(stays[some], half_widths[some], envelope[some])
    )
    return widths._replace(half_widths=found, swing_widths=swing_widths)
