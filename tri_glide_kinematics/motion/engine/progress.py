"""How far a path is driven, and how long the rest may take."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.path import ArcLength, DrivenPath
from tri_glide_kinematics.motion.trajectory import PathHeights, PathPlan, Trajectory


class PathMeasuring:
    """Measures one path after the other; the motion does not need their lengths."""

    def __init__(self) -> None:
        """Begin with none."""
        self._under_way: tuple[DrivenPath, Interruptible[ArcLength]] | None = None

    def work(self, driven: DrivenPath | None, may_go_on: Callable[[], bool]) -> None:
        """Go on with the length of a path, unless it is known, while ``may_go_on``."""
        if driven is None or driven.is_measured:
            self._under_way = None
            return
        if self._under_way is None or self._under_way[0] is not driven:
            self._under_way = driven, driven.measured()
        _, measuring = self._under_way
        for _ in measuring:
            if not may_go_on():
                return


class PathProgress(NamedTuple):
    """How far a path is driven.

    Attributes:
        segment: number of the present one, from 0.
        way: driven from the start of the path [m].
        way_remaining: to its end [m].
        time_remaining: as far as it is planned; beyond that, at the mean speed of what is; NaN
            where nothing of it is planned [s].
        deviation: the largest distance from the path as programmed may be this, up to here [m].
    """

    segment: int
    way: float
    way_remaining: float
    time_remaining: float
    deviation: float


def progress(heights: PathHeights, place: float, plan: Trajectory, time: float) -> PathProgress:
    """Return how far the path is driven.

    Args:
        heights: on the path.
        place: where the platform is, or left it [m].
        plan: that is carried out.
        time: that has passed in it [s].
    """
    driven = heights.driven
    way = _way(heights, place)
    remaining = max(plan.duration - time, 0.0)
    left = driven.arc_length.total - way
    if not isinstance(plan, PathPlan):
        # It leads to where the path begins, or stands still on it.
        remaining = math.nan if left > 0.0 else 0.0
    elif plan.heights.driven is heights.driven and not plan.ends_path:
        planned = _way(heights, plan.place(plan.duration)) - way
        rest = left - planned
        speed = planned / remaining if remaining > 0.0 else 0.0
        remaining = remaining + rest / speed if speed > 0.0 else math.nan
    segment = int(driven.segment_of(place))
    return PathProgress(segment, way, left, remaining, driven.deviation_up_to(place))


def _way(heights: PathHeights, place: float) -> float:
    return float(heights.driven.ways(np.array([place]))[0])
