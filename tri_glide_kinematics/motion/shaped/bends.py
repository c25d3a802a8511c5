r"""Bends of a path, which a shaper cuts: how fast the platform may be, and how much plans cut.

A shaped platform is at $\bar p = \sum_k A_k\,p(s_k)$, the mean of places of the path that it passed
at different instants. With $\bar s = \sum_k A_k s_k$ and a function $F$ whose second derivative is
nowhere less than $|p''|$,

$$|\bar p - p(\bar s)| = \Bigl|\sum_k A_k \int_{\bar s}^{s_k} (s_k - \sigma)\,p''(\sigma)\,d\sigma
\Bigr| \le \sum_k A_k F(s_k) - F(\bar s).$$

So the distance from the path as driven is bounded by how much more the mean of $F$ is than $F$ of
the mean, with numbers alone. $F'$ is how far the path has turned.

With a steady speed v of the place, $s_k = \bar s + v (t_m - t_k)$ with the mean time $t_m$ of the
impulses. The bound grows with v, and is convex in it: there is one speed at which it is what is
allowed. If the platform is nowhere faster up to the way $v\,t_n$ before and behind that place, with
the last time $t_n$, then the places $s_k$ are no farther from each other whenever their mean is
there, and the bound holds for any motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.path import DrivenPath
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.trajectory import PathPlan, SpeedSteps, Trajectory
from tri_glide_kinematics.vectors import FloatArray

# A path may be left by so much in any case [m].
NEGLIGIBLE = 1e-9

# No platform is as fast [m/s].
_FASTEST = 5.0

# Part of the allowed cut that is aimed at.
_AIM = 0.98

# Number of steps of Newton's method for the speed that belongs to the allowed cut.
_TURNS = 10

# In a bend that is longer than this [m], speeds are found at these parts of it, too.
_LONG = 5e-3
_PARTS = np.array((1.0 / 64.0, 1.0 / 16.0, 0.25, 0.75, 15.0 / 16.0, 63.0 / 64.0))

# No way is longer [m].
_LARGEST = 1e3

# Number of steps that are laid down between two breaks of the computation.
_PAINTED = 500


class Bends:
    """How much the spans of a part of a path turn; outside it the path is taken as straight.

    Attributes:
        breaks: between the spans. Shape (k + 1,) [m].
        allowed: by how much the path may be left in each span. Shape (k,) [m].
    """

    def __init__(self, driven: DrivenPath, spans: slice) -> None:
        """Look at some ``spans`` of a path as driven."""
        self.breaks = driven.breaks[spans.start : spans.stop + 1]
        self.allowed = np.maximum(driven.left_on(spans), NEGLIGIBLE)
        self._asked = driven.segments.speeds[driven.segment[spans]]
        self._steps = steps = np.diff(self.breaks)
        at_begin, at_end = driven.sharpness_on(spans)
        self._is_bent = np.maximum(at_begin, at_end) > 0.0
        # F over the way from the start of each span; beyond the last one the path is straight.
        turned = np.append(0.0, np.cumsum(0.5 * steps * (at_begin + at_end)))
        corners = np.cumsum(driven.corners_at(self.breaks[:-1]))
        turned += np.append(corners, corners[-1])
        grown = steps * (turned[:-1] + steps * (2.0 * at_begin + at_end) / 6.0)
        rows = np.zeros((4, len(self.breaks)))
        rows[0, 1:] = np.cumsum(grown)
        rows[1] = turned
        rows[2, :-1] = 0.5 * at_begin
        rows[3, :-1] = (at_end - at_begin) / (6.0 * steps)
        self._rows = rows

    def turned(self, ways: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return F and F' at ``ways`` [m], each of the same shape; at corners, F' behind them."""
        place = np.maximum(ways, self.breaks[0])
        span = np.searchsorted(self.breaks, place, "right") - 1
        x = place - self.breaks[span]
        f0, f1, f2, f3 = self._rows[:, span]
        slope = f1 + x * (2.0 * f2 + 3.0 * x * f3)
        return f0 + x * (f1 + x * (f2 + x * f3)) + np.minimum(ways - place, 0.0) * slope, slope

    def turned_before(self, ways: FloatArray) -> FloatArray:
        """Return F' at ``ways`` [m]; at corners, that before them."""
        place = np.maximum(ways, self.breaks[0])
        span = np.maximum(np.searchsorted(self.breaks, place, "left") - 1, 0)
        x = place - self.breaks[span]
        _, f1, f2, f3 = self._rows[:, span]
        return np.asarray(f1 + x * (2.0 * f2 + 3.0 * x * f3))

    def sharpest(self, begins: FloatArray, ends: FloatArray) -> FloatArray:
        """Return the largest second derivative of F from each of ``begins`` to ``ends`` [m]."""
        at_begin = 2.0 * self._rows[2]
        most = np.maximum(at_begin, at_begin + 6.0 * self._rows[3] * np.append(self._steps, 0.0))
        first = np.maximum(np.searchsorted(self.breaks, begins, "right") - 1, 0)
        last = np.searchsorted(self.breaks, ends, "left")
        pairs = np.stack((first, np.maximum(last, first + 1)), axis=-1).ravel()
        # Behind the last one stands one more, as reduceat needs an index.
        found = np.maximum.reduceat(np.append(most, 0.0), pairs)[::2]
        return np.asarray(found.reshape(begins.shape))

    def at(self, ways: FloatArray) -> FloatArray:
        """Return by how much the path may be left at ``ways`` [m]; at a break, the less."""
        last = len(self.allowed) - 1
        span = np.clip(np.searchsorted(self.breaks, ways, "right") - 1, 0, last)
        before = np.clip(np.searchsorted(self.breaks, ways, "left") - 1, 0, last)
        return np.asarray(np.minimum(self.allowed[span], self.allowed[before]))

    def speeds(self, shaper: Shaper, scale: float, cut: float) -> Interruptible[SpeedSteps]:
        """Return how fast the platform may be, so that a ``shaper`` cuts no more than allowed.

        Args:
            shaper: its impulses.
            scale: of the speeds that the path asks for.
            cut: the part of what is allowed that is cut.
        """
        places = self._places()
        steady = yield from self._steady(places, shaper, cut)
        span = np.searchsorted(self.breaks, places[:-1], "right") - 1
        # Each place counts alone where the path is straight.
        bent = self._is_bent[span]
        between = np.where(bent, np.minimum(steady[:-1], steady[1:]), steady[:-1])
        slow = between < _FASTEST
        asked = scale * self._asked
        is_asked = np.isfinite(asked)
        found = []
        # Wherever one of the places may be that are averaged, the platform must not be faster.
        for begins, ends, speeds in (
            (places[:-1][slow], places[np.arange(len(bent)) + bent][slow], between[slow]),
            (self.breaks[:-1][is_asked], self.breaks[1:][is_asked], asked[is_asked]),
        ):
            begins = begins - (shaper.duration - shaper.delay) * speeds
            ends = ends + shaper.delay * speeds
            found.append((begins, ends, speeds))
        edges = np.unique(np.concatenate([each for some in found for each in some[:2]]))
        yield
        bends = yield from _least_over(edges, *found[0])
        return SpeedSteps(edges, (yield from _least_over(edges, *found[1])), bends)

    def _places(self) -> FloatArray:
        """Return places where speeds are found, ascending; those of long bends next to the ends."""
        long = self._is_bent & (self._steps > _LONG)
        inside = self.breaks[:-1][long, np.newaxis] + np.outer(self._steps[long], _PARTS)
        middles = 0.5 * (self.breaks[:-1] + self.breaks[1:])[self._is_bent]
        return np.unique(np.concatenate((self.breaks, middles, inside.ravel())))

    def _steady(self, places: FloatArray, shaper: Shaper, cut: float) -> Interruptible[FloatArray]:
        """Return at which steady speed a part of what is allowed is cut. Shape (n,) [m/s]."""
        allowed = _AIM * cut * np.minimum(self.at(places), _LARGEST)
        amplitudes = np.array(shaper.amplitudes)
        ahead = (shaper.delay - np.array(shaper.times))[:, np.newaxis]
        here, _ = self.turned(places)

        # Newton's method comes from above, as the cut is convex in the speed.
        speeds = np.full(len(places), _FASTEST)
        for _ in range(_TURNS):
            value, slope = self.turned(places + ahead * speeds)
            over = amplitudes @ value - here - allowed
            growth = amplitudes @ (ahead * slope)
            with np.errstate(divide="ignore", invalid="ignore"):
                slower = np.maximum(speeds - over / growth, 0.0)
            speeds = np.where(over > 0.0, slower, speeds)
            yield
        value, _ = self.turned(places + ahead * speeds)
        # The remaining excess is small; it grows faster than the speed.
        return speeds * allowed / np.maximum(amplitudes @ value - here, allowed)


def _least_over(
    edges: FloatArray, begins: FloatArray, ends: FloatArray, values: FloatArray
) -> Interruptible[FloatArray]:
    """Return the least of the ``values`` that hold from ``begins`` to ``ends``, between ``edges``.

    Returns:
        Infinite where none holds, and so before the first edge and behind the last one. Of n + 1
        edges, shape (n + 2,).
    """
    result = np.full(len(edges) + 1, inf)
    order = np.argsort(-values)
    firsts = np.searchsorted(edges, begins[order]) + 1
    lasts = np.searchsorted(edges, ends[order]) + 1
    numbers = zip(firsts.tolist(), lasts.tolist(), values[order].tolist())
    for number, (first, last, value) in enumerate(numbers, 1):
        result[first:last] = value
        if number % _PAINTED == 0:
            yield
    return result


# Largest distance between the end of one part of a path and the begin of the next [m].
_SAME_PLACE = 1e-9


class PathDriven(NamedTuple):
    """Which places of a path are driven through, and when.

    Attributes:
        bends: of the path there.
        begins: when each plan takes over. Shape (m,) [s].
        parts: plans on the path, one after the other; before the first one it rests where that
            begins.
    """

    bends: Bends
    begins: FloatArray
    parts: list[PathPart]

    def ways(self, times: FloatArray, half: FloatArray) -> FloatArray:
        """Return the ways in cells of time: six rows for each.

        Args:
            times: middles of cells. Shape (n,) [s].
            half: of the lengths of the cells. Shape (n,) [s].

        Returns:
            In the middle, where the cell begins and where it ends; speed in the middle; bounds of
            the speed and of the acceleration. Shape (6, n).
        """
        owner = np.maximum(np.searchsorted(self.begins, times, side="right") - 1, 0)
        rows = np.empty((6, len(times)))
        for index in sorted(set(owner.tolist())):
            begin, plan, skipped = self.parts[index]
            mine = owner == index
            h = half[mine]
            values, bounds = plan.way_series(times[mine] - begin + skipped, h)
            values, bounds = values[:, 0], bounds[:, 0]
            powers = h ** np.arange(6.0)[:, np.newaxis]
            even, odd = (values * powers)[::2].sum(axis=0), (values * powers)[1::2].sum(axis=0)
            first, last = float(plan.scaling.ways[0]), float(plan.scaling.ways[-1])
            ends = np.clip((even - odd, even + odd), first, last)
            rows[:, mine] = values[0], *ends, values[1], bounds[1], 2.0 * bounds[2]
        return rows

    def segment(self, time: float) -> int:
        """Return the index of the segment where the platform is at a ``time`` [s]."""
        when = np.array([time])
        place = self.ways(when, np.zeros(1))[0]
        return int(self.parts[-1].plan.heights.driven.segment_of(place)[0])

    def cut(
        self, times: FloatArray, half: FloatArray, amplitudes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return how much bends are cut, as part of what is allowed.

        With J for how much more the mean of F is than F of the mean, about the middle of a cell
        |J| is at most that there, plus its slope and half of the largest second derivative.

        Args:
            times: of the places that are averaged. Shape (k, n) [s].
            half: of the lengths of the cells. Shape (n,) [s].
            amplitudes: of the places. Shape (k,).

        Returns:
            In the middle of each cell, and a bound for all of it. Each of the shape (n,).
        """
        bends = self.bends
        ways = self.ways(times.ravel(), np.tile(half, len(times))).reshape(6, *times.shape)
        place, begin, end, speed, fastest, hardest = ways
        middle, first, last = (
            np.clip(amplitudes @ each, each.min(axis=0), each.max(axis=0))
            for each in (place, begin, end)
        )
        grown, turned = bends.turned(place)
        mean_grown, mean_turned = bends.turned(middle)
        gap = amplitudes @ grown - mean_grown
        slope = amplitudes @ ((turned - mean_turned) * speed)
        # How far the path turns between a place and the mean, anywhere in the cell.
        lowest, highest = bends.turned(begin)[1], bends.turned_before(end)
        turn = np.maximum(
            np.abs(highest - bends.turned(first)[1]), np.abs(bends.turned_before(last) - lowest)
        )
        second = amplitudes @ (bends.sharpest(begin, end) * fastest**2 + turn * hardest)
        bound = gap + half * np.abs(slope) + 0.5 * half**2 * second
        # In the middle of two spans, what either of them allows.
        allowed = np.minimum(np.minimum(bends.at(first), bends.at(last)), bends.at(middle))
        return gap / allowed, np.maximum(bound, gap) / allowed


def along_one_path(driven: Sequence[DrivenPart], apart: float) -> list[PathPart]:
    """Return the last parts that lead along one path.

    Args:
        driven: all of them.
        apart: each ends so near to where the next one begins [m].
    """
    parts: list[PathPart] = []
    for begin, plan, skipped in reversed(driven):
        if not isinstance(plan, PathPlan):
            break
        if parts:
            following = parts[0]
            end = plan.place(following.begin - begin + skipped)
            if not abs(end - following.plan.place(following.skipped)) <= apart:
                break
        parts.insert(0, PathPart(begin, plan, skipped))
    return parts


def path_driven(driven: Sequence[DrivenPart]) -> PathDriven | None:
    """Return what of a path is driven through; None if the last plan does not lead along one."""
    parts = along_one_path(driven, _SAME_PLACE)
    if not parts:
        return None
    first, last = parts[0].plan, parts[-1].plan
    path = last.heights.driven
    ends = np.array((first.scaling.ways[0], last.scaling.ways[-1]))
    begin, end = path.spans_of(ends).tolist()
    bends = Bends(path, slice(begin, end + 1))
    return PathDriven(bends, np.array([part.begin for part in parts]), parts)


class DrivenPart(NamedTuple):
    """A plan, and when it is driven.

    Attributes:
        begin: when it takes over; past instants are negative [s].
        plan: that is driven, until the next one takes over or to its end.
        skipped: how much of it is past when it takes over [s].
    """

    begin: float
    plan: Trajectory
    skipped: float


class PathPart(NamedTuple):
    """A ``DrivenPart`` that leads along a path."""

    begin: float
    plan: PathPlan
    skipped: float
