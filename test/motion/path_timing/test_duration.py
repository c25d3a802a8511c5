"""How long a path takes is told from an estimate and samples, without the plan of all of it."""

from __future__ import annotations

import numpy as np
import pytest
from motion_machine import WORKSPACE
from timed_paths import LIMITS, dense_path, random_path, seen

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path_timing import PathPlanner
from tri_glide_kinematics.motion.shaped import Planned

PLANNER = PathPlanner(WORKSPACE)


def square(speeds: list[float]) -> PlatformPath:
    """Return a square of 30 mm, driven so often, each time with one of the ``speeds`` [m/s]."""
    path = PlatformPath.start((0.0, 0.0, 0.3))
    for speed in speeds:
        for x, y in ((0.03, 0.0), (0.03, 0.03), (0.0, 0.03), (0.0, 0.0)):
            path = path.line_to((x, y, 0.3), 1e-4, speed)
    return path


def circles(speed: float) -> PlatformPath:
    path = PlatformPath.start((0.03, 0.0, 0.3))
    return path.arc_about((0.0, 0.0, 0.3), (0.0, 0.0, 1.0), 20.0, 1e-4, speed, 0.02)


PATHS = {
    "dense and slow": (dense_path(1500, 0.02), 1.5),
    "dense": (dense_path(6000, 0.1), 1.5),
    "dense, at the limits": (dense_path(2000), 0.0),
    "helix": (circles(0.03), 3.0),
    "corners": (square([0.01, 0.02]), 2.0),
    "corners, fast": (square([0.2]), 0.0),
    **{f"at random {seed}": (random_path(seed), 0.0) for seed in range(4)},
}


@pytest.mark.parametrize("name", PATHS)
def test_it_is_the_duration_of_the_motion_that_is_planned(name):
    path, sparing = PATHS[name]
    heights = seen(path)
    planning = PLANNER.to_the_end(heights, Planned(LIMITS))
    telling = PLANNER.duration(heights, LIMITS)
    motion, whole = counted(planning)
    told, some = counted(telling)
    assert told == pytest.approx(motion.duration, rel=0.004)
    # So many times less is done.
    assert whole >= sparing * some


def counted(computation):
    """Return the result of a computation, and in how many pieces it is found."""
    pieces = 0
    while True:
        try:
            next(computation)
        except StopIteration as end:
            return end.value, pieces
        pieces += 1


@pytest.mark.slow
@pytest.mark.parametrize(("half", "count", "sparing"), [(0.01, 100, 3.0), (0.03, 40, 3.0)])
def test_of_a_long_path_only_some_parts_are_planned(half, count, sparing):
    """Rows beside one another, each corner soon followed by the next, or driven steadily."""
    path = PlatformPath.start((-half, -0.03, 0.3))
    for number in range(1, count):
        x, y = (-half, half)[(number + 1) // 2 % 2], 2e-4 * (number // 2) - 0.03
        path = path.line_to((x, y, 0.3), 5e-5, (0.03, 0.04)[number // 20 % 2])
    heights = seen(path)
    motion, whole = counted(PLANNER.to_the_end(heights, Planned(LIMITS)))
    told, some = counted(PLANNER.duration(heights, LIMITS))
    assert told == pytest.approx(motion.duration, rel=0.01)
    assert whole > sparing * some


def test_it_is_the_same_where_the_platform_stops():
    """Stops, and rapid lines beside slow ones."""
    path = PlatformPath.start((0.0, 0.0, 0.3))
    for number in range(12):
        angle = 0.5 * number
        place = (0.03 * np.cos(angle), 0.03 * np.sin(angle), 0.3)
        path = path.line_to(place, 0.0 if number % 3 else 1e-3, None if number % 2 else 0.01)
    heights = seen(path)
    motion = at_once(PLANNER.to_the_end(heights, Planned(LIMITS)))
    told = at_once(PLANNER.duration(heights, LIMITS))
    assert told == pytest.approx(motion.duration, rel=0.01)


def layers(count: int) -> PlatformPath:
    """Return so many zigzags of short lines that reverse, above one another, each from a stop."""
    path = PlatformPath.start((0.0, 0.0, 0.28))
    for layer in range(count):
        z = 0.2802 + 2e-4 * layer
        path = path.line_to((0.0, 0.0, z), 0.0, 0.15)
        for row in range(2, 62):
            x, y = (2e-3, 0.0)[(row + 1) // 2 % 2], 3e-4 * (row // 2)
            path = path.line_to((x, y, z), 5e-5, 0.05)
    return path


def test_what_is_planned_does_not_grow_with_the_path():
    """Neither with its length nor with its stops."""
    few, some = counted(PLANNER.duration(seen(layers(20)), LIMITS))
    many, same = counted(PLANNER.duration(seen(layers(60)), LIMITS))
    assert same <= 1.5 * some
    assert many == pytest.approx(3.0 * few, rel=0.02)


@pytest.mark.slow
def test_samples_tell_the_duration_of_many_short_lines_between_stops():
    heights = seen(layers(4))
    motion, whole = counted(PLANNER.to_the_end(heights, Planned(LIMITS)))
    told, some = counted(PLANNER.duration(heights, LIMITS))
    assert told == pytest.approx(motion.duration, rel=0.01)
    assert whole > 1.2 * some
