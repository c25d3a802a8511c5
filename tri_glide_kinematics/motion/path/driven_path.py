r"""The path as driven: that as programmed, its joints rounded to their tolerances.

Both have the same parameter s, the way programmed: p(s) = g(s) + corrections (``corners``). So all
stays in closed form, and p is twice continuously differentiable wherever the platform need not
stop; its third derivative is bounded and jumps at the breaks alone. The way driven, which is
shorter in roundings, is the integral of |p'| (``ArcLength``), span by span.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.interruptible import (
    Interruptible,
    Kept,
    accumulated,
    any_of,
    blocks,
    column_of,
    columns_of,
    concatenated,
    indices_of,
)
from tri_glide_kinematics.motion.path.corners import (
    LEAST_RATE,
    MAX_ROUNDS,
    SMALLER,
    RoundedJoints,
    ShapedCorners,
    Widths,
    corrections_of,
    enveloped,
    joints_of,
    least_widths,
    lengths_of,
    widths_behind,
    widths_kept,
    widths_of,
)
from tri_glide_kinematics.motion.path.piecewise_path import PiecewisePath
from tri_glide_kinematics.motion.path.segments import Segments, check_count, check_joined, joined
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Indices
from tri_glide_kinematics.wording import number_text

# Nodes of the rule for spans on which the derivative of the curve changes by less than this.
RULES = ((0.05, 3), (0.3, 6), (1.0, 12), (np.inf, 32))
LARGEST_CHANGES = [change for change, _ in RULES[:-1]]

# Newton's method takes so many steps from the place on a straight line; each doubles the digits.
NEWTON_STEPS = 5


@dataclass(eq=False, repr=False)
class ArcLength:
    """Arc length of a curve that is smooth between breaks.

    Attributes:
        breaks: of the parameter. Shape (k + 1,).
        totals: arc lengths there, sums of the lengths before each break. Shape (k + 1,) [m].
        kinds: which rule is for each span (``rules_for``). Shape (k,).
        rates: returns the arc length per parameter, on spans, at parameters. Shape (n,).
    """

    breaks: FloatArray
    totals: FloatArray
    kinds: NDArray[np.int8]
    rates: Callable[[Indices, FloatArray], FloatArray]

    @property
    def total(self) -> float:
        """Arc length of the whole [m]."""
        return float(self.totals[-1])

    def at(self, spans: Indices, parameters: FloatArray) -> FloatArray:
        """Return the arc lengths at ``parameters`` on ``spans``. Shape (n,) [m]."""
        return np.asarray(self.totals[spans] + self._integrals(spans, parameters))

    def inverse(self, lengths: FloatArray) -> FloatArray:
        """Return the parameters at arc lengths, shape (n,) [m]. Shape (n,)."""
        count = len(self.breaks) - 1
        spans = np.clip(np.searchsorted(self.totals, lengths, "right") - 1, 0, count - 1)
        low, high = self.breaks[spans], self.breaks[spans + 1]
        start, end = self.totals[spans], self.totals[spans + 1]
        wanted = np.clip(lengths, 0.0, self.total) - start
        found = low + (high - low) * wanted / (end - start)
        for _ in range(NEWTON_STEPS):
            excess = self._integrals(spans, found) - wanted
            found = np.clip(found - excess / self.rates(spans, found), low, high)
        return np.asarray(found)

    def _integrals(self, spans: Indices, parameters: FloatArray) -> FloatArray:
        """Return the arc lengths from the breaks where ``spans`` begin to ``parameters``."""
        starts = self.breaks[spans]
        return integrals(self.rates, spans, self.kinds[spans], starts, parameters - starts)


def rules_for(changes: FloatArray) -> NDArray[np.int8]:
    """Return which rule is for each span.

    Args:
        changes: how much the derivative of the curve changes on each, at most. Shape (n,) [m].
    """
    return np.searchsorted(LARGEST_CHANGES, changes).astype(np.int8)


def integrals(
    rates: Callable[[Indices, FloatArray], FloatArray],
    spans: Indices,
    kinds: NDArray[np.int8],
    starts: FloatArray,
    steps: FloatArray,
) -> FloatArray:
    """Return the arc lengths on spans, from some of their places to others.

    Args:
        rates: returns the arc length per parameter, on spans, at parameters. Shape (n,).
        spans: indices of them. Shape (n,).
        kinds: which rule is for each. Shape (n,).
        starts: parameters from which on. Shape (n,).
        steps: of the parameter to the end. Shape (n,).
    """
    total = np.empty(len(spans))
    for kind, (_, nodes) in enumerate(RULES):
        some = np.flatnonzero(kinds == kind)
        if len(some):
            total[some] = _by_nodes(rates, spans[some], starts[some], steps[some], nodes)
    return total


def _by_nodes(
    rates: Callable[[Indices, FloatArray], FloatArray],
    spans: Indices,
    starts: FloatArray,
    steps: FloatArray,
    nodes: int,
) -> FloatArray:
    """Integrate by Gauss and Legendre's rule."""
    places, weights = _rule(nodes)
    total = np.zeros(len(steps))
    for place, weight in zip(places, weights):
        total += weight * rates(spans, starts + place * steps)
    return np.asarray(total * steps)


@cache
def _rule(nodes: int) -> tuple[list[float], list[float]]:
    """Return places and weights of Gauss and Legendre's rule, from 0 to 1."""
    places, weights = np.polynomial.legendre.leggauss(nodes)
    return (0.5 * (places + 1.0)).tolist(), (0.5 * weights).tolist()


# Places in a span at which it is looked for where the way driven is too short.
SAMPLES_IN_SPAN = 9

# Numbers of spans that are worked on together: where they are looked at, and where measured.
SAMPLED_SPANS = 222
MEASURED_SPANS = 500

# Least distance [m] between the place up to which a path stays and its end, for no stop at that
# end.
LEAST_ROOM = 1e-6


# Bends that are less sharp than this are none [1/m].
STRAIGHT = 1e-6

# It is looked in such steps where a path leads [m]; one that takes more of them may lead anywhere.
STEP = 0.01
MOST_STEPS = 1000


class DeviationsPassed(NamedTuple):
    """How far a path as driven may be from the path as programmed, up to some place.

    Attributes:
        rounded: because of the first roundings up to each of them. Shape (m,) [m].
        reach: no rounding reaches farther to one side [m].
        left: what a shaper may add, up to the end of each segment. Shape (n,) [m]; empty without.
    """

    rounded: FloatArray
    reach: float
    left: FloatArray


@dataclass(eq=False, repr=False)
class DrivenPath(PiecewisePath):
    """The path as driven, over the programmed way s; see ``PiecewisePath``. Use ``of``.

    Attributes:
        stops: ascending ways at which the platform has to stop, both ends included [m].
        rounded: joints that are rounded.
        widths: of their roundings.
        shaped: how corners are driven with a shaper; None without one.
    """

    stops: FloatArray
    rounded: RoundedJoints
    widths: Widths
    shaped: ShapedCorners | None

    def __repr__(self) -> str:
        """Return how many segments it has, where it stops, and how far it deviates."""
        stops = len(self.stops)
        bound = number_text(1e3 * self.deviation_bound, 3)
        return f"<DrivenPath, {len(self.segments)} segments, {stops} stops, within {bound} mm>"

    def places(self) -> FloatArray | None:
        """Return places on it, near to each other. Shape (n, 3) [m]; None if it is too long."""
        steps = ceil(self.length / STEP)
        if steps > MOST_STEPS:
            return None
        return np.asarray(self.derivatives(np.linspace(0.0, self.length, steps + 1), 0)[0])

    @classmethod
    def of(
        cls, segments: Segments, shaped: ShapedCorners | None = None
    ) -> Interruptible[DrivenPath]:
        """Round the joints of a path, interruptibly.

        Args:
            segments: of the path.
            shaped: how corners are driven with a shaper, which needs a part of the tolerances; no
                rounding swings out then, as a shaper cuts short bends by no more than long ones.
        """
        rounded, stops = yield from joints_of(segments, shaped=shaped)
        rounded = yield from _with_part(rounded, shaped)
        widths = yield from widths_of(rounded)
        return (yield from cls._rounded(segments, stops, rounded, widths, None, shaped))

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
        check_count(len(self.segments) + len(more))
        check_joined(self.segments, more)
        segments = yield from joined((self.segments, more))
        stays = self.stops[-1] - place < LEAST_ROOM
        stops = self.stops[1:] if stays else self.stops[1:-1]
        rounded, stops = yield from joints_of(segments, stops, self.shaped)
        rounded = yield from _with_part(rounded, self.shaped)
        kept = yield from widths_kept(self.rounded, self.widths, place)
        widths = yield from widths_behind(rounded, kept, place)
        least = yield from least_widths(rounded.ways, kept.half_widths)
        return (yield from self._rounded(segments, stops, rounded, widths, least, self.shaped))

    @classmethod
    def _rounded(
        cls,
        segments: Segments,
        stops: FloatArray,
        rounded: RoundedJoints,
        widths: Widths,
        least: FloatArray | None,
        shaped: ShapedCorners | None,
    ) -> Interruptible[DrivenPath]:
        """Put the path together; its roundings are made smaller where the way would be short."""
        for _ in range(MAX_ROUNDS):
            breaks, table = yield from corrections_of(segments.joints, rounded, widths)
            segment = np.empty(len(table), dtype=np.intp)
            for some in blocks(len(table)):
                segment[some] = np.searchsorted(segments.joints, breaks[some], "right") - 1
                add_programmed(segments, breaks[some], table[some], segment[some])
                yield
            spans = PiecewisePath(segments, breaks, table, segment)
            slow = yield from _slow_ways(spans)
            if not len(slow):
                break
            smaller = yield from _smaller(widths, rounded, slow, least)
            if not (yield from _differ(smaller, widths)):
                break
            widths = smaller
        return cls(segments, breaks, table, segment, stops, rounded, widths, shaped)

    @property
    def tolerances(self) -> FloatArray:
        """Tolerances of the joints at the ends of all segments. Shape (n,) [m]."""
        return self.segments.tolerances

    @property
    def part(self) -> float:
        """The part of the tolerances that roundings use; the rest is left to a shaper."""
        return 1.0 if self.shaped is None else self.shaped.part

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

    def corners_at(self, ways: FloatArray) -> FloatArray:
        """Return by how much the tangent jumps at ascending ``ways``: only where it stops."""
        first, last = np.searchsorted(self.stops, (ways[0], ways[-1]), side="left").tolist()
        stops = self.stops[max(first, 1) : min(last + 1, len(self.stops) - 1)]
        behind = np.searchsorted(self.joints, stops)
        jumps = self.segments.tangents[behind] - self.segments.end_tangents[behind - 1]
        turns = np.zeros(len(ways))
        at = np.searchsorted(ways, stops)
        inside = at < len(ways)
        turns[at[inside]] = lengths_of(jumps[inside])
        return turns

    def left_on(self, spans: slice) -> FloatArray:
        """Return what roundings leave of the tolerance in each of some ``spans``. Shape (k,) [m].

        Of the tolerances of the joints before and behind that are rounded or stops, the larger
        counts.
        """
        middles = 0.5 * (self.breaks[:-1][spans] + self.breaks[1:][spans])
        stop = np.searchsorted(self.stops, middles)
        before, behind = self._at_stops(stop - 1), self._at_stops(stop)
        ways = self.rounded.ways
        if len(ways):
            own = self.rounded.tolerances
            joint = np.searchsorted(ways, middles)
            last, following = np.maximum(joint - 1, 0), np.minimum(joint, len(ways) - 1)
            is_last = (ways[last] > self.stops[stop - 1]) & (ways[last] < middles)
            before = np.where(is_last, own[last] / self.part, before)
            is_next = (ways[following] < self.stops[stop]) & (ways[following] > middles)
            behind = np.where(is_next, own[following] / self.part, behind)
        return np.asarray((1.0 - self.part) * np.maximum(before, behind))

    def _at_stops(self, numbers: Indices) -> FloatArray:
        """Return the tolerances of stops; the start of the path has none. Shape (k,) [m]."""
        segment = np.searchsorted(self.joints, self.stops[numbers]) - 1
        return np.where(segment < 0, 0.0, self.tolerances[np.maximum(segment, 0)])

    def bend_without_tolerance(self) -> Interruptible[int | None]:
        """Return the index of the first segment that bends and leaves a shaper no tolerance."""
        for some in blocks(len(self.segment), SAMPLED_SPANS):
            bent = self.sharpness_on(some).max(axis=0) > STRAIGHT
            found = np.flatnonzero(bent & ~(self.left_on(some) > 0.0))
            if len(found):
                return int(self.segment[some][found[0]])
            yield
        return None

    @Kept
    def arc_length(self) -> Interruptible[ArcLength]:
        """The way driven over the way programmed."""

        def without_bends(some: slice) -> tuple[FloatArray, NDArray[np.int8], BoolArray]:
            turns = self.bounds_on(some).turns
            steps = np.diff(self.breaks[some.start : some.stop + 1])
            return steps, rules_for(turns), turns > 0.0

        lengths, kinds, is_bent = yield from columns_of(len(self.segment), without_bends)
        bent = yield from indices_of(is_bent)
        for some in blocks(len(bent), MEASURED_SPANS):
            spans = bent[some]
            starts, steps = self.breaks[spans], lengths[spans]
            lengths[spans] = integrals(self.rates, spans, kinds[spans], starts, steps)
            yield
        lengths = yield from concatenated((np.zeros(1), lengths))
        totals = yield from accumulated(np.add, lengths)
        return ArcLength(self.breaks, totals, kinds, self.rates)

    @Kept
    def deviations_passed(self) -> Interruptible[DeviationsPassed]:
        """How far it may be from the path as programmed, up to each joint."""
        rounded = yield from accumulated(np.maximum, self.widths.deviations)
        reach = 0.0
        for some in blocks(len(rounded)):
            reach = max(reach, float(self.widths.part(some).reaches.max()))
            yield
        # A shaper leaves the path as driven by no more than roundings leave of the tolerances.
        left = np.zeros(0)
        if self.part < 1.0:
            left = yield from accumulated(np.maximum, self.tolerances)
            left *= 1.0 - self.part
        return DeviationsPassed(rounded, reach, left)

    def deviation_up_to(self, place: float) -> float:
        """Return a bound of the distance from the path as programmed, up to a ``place`` [m]."""
        passed, ways = self.deviations_passed, self.rounded.ways
        first, last = np.searchsorted(ways, (place, place + passed.reach)).tolist()
        near = self.widths.part(slice(first, last))
        begun = ways[first:last] - near.reaches < place
        deviation = float(near.deviations[begun].max(initial=0.0))
        if first:
            deviation = max(deviation, float(passed.rounded[first - 1]))
        if len(passed.left):
            deviation += float(passed.left[int(self.segment_of(place))])
        return deviation

    @property
    def is_measured(self) -> bool:
        """Whether all that tells how far it is driven has been worked out."""
        return DrivenPath.deviations_passed.is_kept(self) and DrivenPath.arc_length.is_kept(self)

    def measured(self) -> Interruptible[ArcLength]:
        """Return ``arc_length``; what tells how far it is driven is worked out interruptibly."""
        yield from DrivenPath.deviations_passed.in_pieces(self)
        return (yield from DrivenPath.arc_length.in_pieces(self))

    def ways(self, programmed: ArrayLike) -> FloatArray:
        """Return the way driven at programmed ways, shape (n,) [m]. Shape (n,) [m]."""
        places = np.asarray(programmed, dtype=np.float64)
        return self.arc_length.at(self.spans_of(places), places)

    def place_of(self, driven: ArrayLike) -> FloatArray:
        """Return the programmed way at ways driven, shape (n,) [m]. Shape (n,) [m]."""
        return self.arc_length.inverse(np.asarray(driven, dtype=np.float64))


def _with_part(
    rounded: RoundedJoints, shaped: ShapedCorners | None
) -> Interruptible[RoundedJoints]:
    """Return joints that use the part of their tolerances that a shaper leaves; none swings out."""
    if shaped is None:
        return rounded
    tolerances = yield from column_of(
        len(rounded.ways), lambda some: shaped.part * rounded.tolerances[some]
    )
    return replace(rounded, tolerances=tolerances, free=np.zeros(len(rounded.free), dtype=bool))


def add_programmed(
    segments: Segments, starts: FloatArray, table: FloatArray, numbers: Indices
) -> None:
    """Add to corrections the path as programmed; of an arc, only the point where it begins.

    Args:
        segments: of the path.
        starts: ways at which spans begin. Shape (n,) [m].
        table: coefficients of the corrections on these spans. Shape (n, degree + 1, 3).
        numbers: indices of their segments. Shape (n,).
    """
    along = segments.tangents[numbers]
    along[segments.curvatures[numbers] != 0.0] = 0.0
    table[:, 1] += along
    along *= (starts - segments.joints[numbers])[:, np.newaxis]
    along += segments.points[numbers]
    table[:, 0] += along


def _slow_ways(path: PiecewisePath) -> Interruptible[FloatArray]:
    """Return programmed ways at which the way driven is too short [m]."""
    # Most spans are too short for it, or too nearly straight.
    near = yield from column_of(
        len(path.segment), lambda some: path.bounds_on(some).least_rates < LEAST_RATE
    )
    spans = yield from indices_of(near)
    found = [np.zeros(0)]
    for some in blocks(len(spans), SAMPLED_SPANS):
        # A corner that is just not too sharp to be rounded is not too sharp.
        found.append(path.slow_ways(spans[some], 0.99 * LEAST_RATE, SAMPLES_IN_SPAN))
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

    def lowered(some: slice) -> tuple[FloatArray, FloatArray, BoolArray]:
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
