"""The jerk of paths with a speed does not chatter, and a higher limit of it costs no time."""

import numpy as np
import pytest
from motion_machine import LIMITS
from timed_paths import driven, seen

from testing.jerk_on_paths import chatter, circle, polyline, square
from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.motion.path_timing.grid import MOST_CELLS
from tri_glide_kinematics.motion.path_timing.speed_estimate import SHORTEST_CELL
from tri_glide_kinematics.motion.trajectory import check_along


# Corners: of these a path has so many, the places where it begins and ends counted as one.
@pytest.mark.parametrize("speed", [0.05, 0.2])
@pytest.mark.parametrize(
    "shape, corners",
    [
        (lambda speed: circle(0.02, speed), 1),
        (lambda speed: square(0.04, speed), 4),
        (lambda speed: polyline(3, speed), 7),
    ],
)
def test_the_jerk_does_not_chatter(shape, corners, speed):
    curve = seen(shape(speed))
    found = driven(curve, LIMITS)
    fast, turns = chatter(curve, found.motion, LIMITS)
    assert fast < 0.1
    assert turns <= max(20.0 * found.duration, 6.0 * corners)


def test_the_speed_that_is_asked_for_is_reached():
    """But for what later parts of a window are planned with: half a percent at most."""
    curve = seen(circle(0.04, 0.1))
    scaling = driven(curve, LIMITS).motion
    _, speeds, _ = scaling.evaluate(np.arange(0.1, float(scaling.times[-1]) - 0.1, 0.001))
    assert np.median(speeds) > 0.0995


def uniform(jerk):
    return SliderLimits.uniform(1.0, 10.0, jerk)


def unequal(jerk):
    return SliderLimits((1.0, 0.3, 2.0), (10.0, 40.0, 5.0), (jerk, 300.0, 0.1 * jerk))


@pytest.mark.parametrize("limits_of", [uniform, unequal])
@pytest.mark.parametrize("path", [circle(0.02), polyline(1, points=4)])
def test_more_jerk_than_before_costs_no_time(path, limits_of):
    curve = seen(path)
    least = np.inf
    for jerk in (1000.0, 20_000.0, 1e6):
        found = driven(curve, limits_of(jerk))
        for window in found.windows:
            check_along(curve, window.scaling, limits_of(jerk))
        assert found.duration <= 1.01 * least
        least = min(least, found.duration)
        # A window that goes on does so behind two fifths of its cells.
        longest = 0.4 * MOST_CELLS * SHORTEST_CELL
        assert len(found.windows) <= 2 + found.duration / longest


def test_a_slow_slider_is_looked_ahead_for():
    """The one with the slowest jerk sets how far, whatever the other two could do."""
    limits = SliderLimits((2.5, 0.32, 0.64), (6.3, 80.3, 2.7), (1550.0, 20.0, 1886.0))
    curve = seen(polyline(109, points=4))
    found = driven(curve, limits)
    for window in found.windows:
        check_along(curve, window.scaling, limits)
    assert len(found.windows) < 6
