"""Paths that tests of timing drive along, and a drive in windows."""

import math
from typing import NamedTuple

import numpy as np
from motion_machine import DT, LIMITS

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path_timing import plan_window
from tri_glide_kinematics.motion.trajectory import PathHeights, PathPlan, PathStart, TimeScaling
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY
from tri_glide_kinematics.vectors import FloatArray

AT_BEGIN = PathStart(0.0, 0.0, 0.0)

LOWER, UPPER = np.array((-0.1, -0.1, 0.26)), np.array((0.1, 0.1, 0.34))


def seen(path: PlatformPath) -> PathHeights:
    """Return the slider heights along a path, on the default machine."""
    return PathHeights(path.driven, DEFAULT_GEOMETRY)


def random_path(seed: int, most: int = 9) -> PlatformPath:
    """Return a path of lines and arcs through random points, with random tolerances."""
    chance = np.random.default_rng(seed)
    path = PlatformPath.start(chance.uniform(LOWER, UPPER))
    for _ in range(int(chance.integers(1, most))):
        tolerance = float(np.exp(chance.uniform(math.log(5e-5), math.log(1e-2))))
        if chance.random() < 0.3:
            via, end = chance.uniform(LOWER, UPPER, (2, 3))
            path = path.arc_to(0.5 * (via + end), end, tolerance=tolerance)
        else:
            path = path.line_to(chance.uniform(LOWER, UPPER), tolerance=tolerance)
    return path


def dense_path(count: int, speed: float | None = None) -> PlatformPath:
    """Return a smooth course of ``count`` segments of 0.1 mm, as a CAM program has them."""
    a = np.arange(count + 1) * 1e-4 / 0.08
    course = (0.08 * np.cos(a), 0.06 * np.sin(1.3 * a), 0.3 + 0.02 * np.sin(0.7 * a))
    return PlatformPath.through(np.stack(course, axis=1), tolerance=2e-5, speed=speed)


class Driven(NamedTuple):
    """A path that was driven in windows.

    Attributes:
        windows: one after the other.
        starts: where each began.
        motion: the way along it over time.
    """

    windows: list[PathPlan]
    starts: list[PathStart]
    motion: TimeScaling

    @property
    def duration(self) -> float:
        """Of all windows, each up to where the next one goes on [s]."""
        return float(self.motion.times[-1])

    @property
    def ways(self) -> FloatArray:
        """Place on the path at each cycle. Shape (n,) [m]."""
        return self.motion.evaluate(np.arange(0.0, self.duration, DT))[0]


def driven(curve: PathHeights, limits: SliderLimits = LIMITS) -> Driven:
    """Drive a path from its begin to its end; each window has to be found."""
    windows: list[PathPlan] = []
    starts = [AT_BEGIN]
    held: TimeScaling | None = None
    while starts[-1].place < curve.driven.length:
        found = at_once(plan_window(curve, starts[-1], limits, held))
        windows.append(found)
        until = found.continue_at
        starts.append(found.on_curve(until))
        held = found.scaling.since(until) if until < found.duration else None
    parts = [window.scaling.until(window.continue_at) for window in windows]
    return Driven(windows, starts[:-1], TimeScaling.joined(parts))
