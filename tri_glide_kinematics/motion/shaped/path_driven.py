"""Which plans are driven one after the other, and how much of the bends of their path is cut."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.shaped.bends import Bends
from tri_glide_kinematics.motion.trajectory import PathPlan, Trajectory
from tri_glide_kinematics.vectors import FloatArray

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
    parts: list[DrivenPart]

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
            assert isinstance(plan, PathPlan)
            (values, bounds), h = (
                plan.way_series(times[mine] - begin + skipped, half[mine]),
                half[mine],
            )
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
        last = self.parts[-1].plan
        assert isinstance(last, PathPlan)
        return int(last.heights.driven.segment_of(place)[0])

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


def path_driven(driven: Sequence[DrivenPart]) -> PathDriven | None:
    """Return what of a path is driven through; None if the last plan does not lead along one."""
    parts: list[DrivenPart] = []
    for part in reversed(driven):
        plan = part.plan
        if not isinstance(plan, PathPlan):
            break
        if parts:
            after, _, skipped = parts[0][:3]
            following = parts[0].plan
            assert isinstance(following, PathPlan)
            end = plan.place(after - part.begin + part.skipped)
            if not abs(end - following.place(skipped)) <= _SAME_PLACE:
                break
        parts.insert(0, part)
    if not parts:
        return None
    first, last = parts[0].plan, parts[-1].plan
    assert isinstance(first, PathPlan)
    assert isinstance(last, PathPlan)
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
