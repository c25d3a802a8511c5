"""Forces of setpoints, and their root mean square over a window."""

import math

import pytest

from tri_glide_kinematics.control import FeedForward
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide

PERIOD, WINDOW = 0.002, 1.0
STILL = (0.0, 0.0, 0.0)
HELD = SliderState((0.6, 0.61, 0.62), STILL, STILL)
RISING = SliderState((0.6, 0.61, 0.62), (0.1, 0.1, 0.1), (5.0, 5.0, 5.0))
FORCES = SliderForces(TriGlide(DEFAULT_GEOMETRY), Masses.uniform(2.0, 0.3, 1.0))


def weighed():
    feed_forward = FeedForward(PERIOD, WINDOW)
    feed_forward.forces = FORCES
    return feed_forward


def test_without_masses_nothing_is_known():
    feed_forward = FeedForward(PERIOD, WINDOW)
    assert feed_forward.of(HELD) is None
    assert feed_forward.continuous is None


def test_forces_are_those_of_the_setpoint():
    assert weighed().of(RISING) == FORCES.forces(*RISING)


def test_where_no_force_holds_the_platform_none_is_told_and_none_counts():
    feed_forward = weighed()
    # The arms of two sliders would have to be longer.
    assert feed_forward.of(SliderState((0.1, 0.9, 0.9), STILL, STILL)) is None
    assert feed_forward.continuous is None


def test_the_continuous_force_is_the_root_mean_square_over_the_window():
    feed_forward = weighed()
    cycles = round(WINDOW / PERIOD)
    held, rising = FORCES.forces(*HELD), FORCES.forces(*RISING)
    for _ in range(cycles):
        feed_forward.of(HELD)
    assert feed_forward.continuous == pytest.approx(held, rel=1e-12)
    for _ in range(cycles // 4):
        feed_forward.of(RISING)
    mixed = [math.sqrt(0.75 * h * h + 0.25 * r * r) for h, r in zip(held, rising)]
    assert feed_forward.continuous == pytest.approx(mixed, rel=1e-12)
    # What is older than the window does not count any more.
    for _ in range(cycles):
        feed_forward.of(RISING)
    assert feed_forward.continuous == pytest.approx(rising, rel=1e-12)
