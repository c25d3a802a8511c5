"""How long a path takes is told from an estimate and samples, without the plan of all of it."""

import numpy as np
import pytest
from motion_machine import LIMITS, WORKSPACE
from soak import some
from timed_paths import dense_path, random_path, seen

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


def rows(half: float, count: int) -> PlatformPath:
    """Return rows beside one another, each corner soon followed by the next, or driven steadily."""
    path = PlatformPath.start((-half, -0.03, 0.3))
    for number in range(1, count):
        x, y = (-half, half)[(number + 1) // 2 % 2], 2e-4 * (number // 2) - 0.03
        path = path.line_to((x, y, 0.3), 5e-5, (0.03, 0.04)[number // 20 % 2])
    return path


def with_stops(count: int) -> PlatformPath:
    """Return a path of so many lines with stops, and with rapid lines beside slow ones."""
    path = PlatformPath.start((0.0, 0.0, 0.3))
    for number in range(count):
        angle = 0.5 * number
        place = (0.03 * np.cos(angle), 0.03 * np.sin(angle), 0.3)
        path = path.line_to(place, 0.0 if number % 3 else 1e-3, None if number % 2 else 0.01)
    return path


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


# Each with how many times less is done, and how near the duration is.
PATHS = {
    "dense": (dense_path(2000, 0.1), 0.0, 0.004),
    "corners": (square([0.01]), 2.0, 0.004),
    "short rows": (rows(0.01, 40), 2.0, 0.01),
    "stops": (with_stops(4), 0.0, 0.01),
    "many short lines between stops": (layers(3), 1.2, 0.01),
    "dense, at the limits": (dense_path(1000), 0.0, 0.004),
    "helix": (circles(0.06), 1.3, 0.004),
    "at random": (random_path(0), 0.0, 0.004),
    "corners, fast": (square([0.2]), 0.0, 0.004),
    "more short rows": (rows(0.01, 100), 3.0, 0.01),
    "rows": (rows(0.03, 40), 3.0, 0.01),
    "dense and slow": (dense_path(1500, 0.02), 1.5, 0.004),
    "dense and long": (dense_path(6000, 0.1), 1.5, 0.004),
    "helix, slow": (circles(0.03), 3.0, 0.004),
    "more corners": (square([0.01, 0.02]), 2.0, 0.004),
    "many stops": (with_stops(12), 0.0, 0.01),
    **{f"at random {seed}": (random_path(seed), 0.0, 0.004) for seed in range(1, 8)},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", some(list(PATHS), 4))
def test_it_is_the_duration_of_the_motion_that_is_planned(name):
    path, sparing, near = PATHS[name]
    heights = seen(path)
    motion, whole = counted(PLANNER.to_the_end(heights, Planned(LIMITS)))
    (_, (*_, told)), some = counted(PLANNER.timed(heights, LIMITS))
    assert told == pytest.approx(motion.duration, rel=near)
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


def test_what_is_planned_does_not_grow_with_the_path():
    """Neither with its length nor with its stops."""
    (_, (*_, few)), some = counted(PLANNER.timed(seen(layers(5)), LIMITS))
    (_, (*_, many)), same = counted(PLANNER.timed(seen(layers(15)), LIMITS))
    assert same <= 1.5 * some
    assert many == pytest.approx(3.0 * few, rel=0.02)
