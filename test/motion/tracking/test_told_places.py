"""The velocity of a target of which only places are told."""

import numpy as np
import pytest

from tri_glide_kinematics.motion.tracking import ToldPlaces

STILL = (0.0, 0.0, 0.0)


def test_what_gets_faster_on_a_line_has_its_velocity_whatever_the_intervals_are():
    rng = np.random.default_rng(1)
    for _ in range(50):
        start, velocity = 0.1 * rng.normal(size=(2, 3))
        bend = 10.0 * rng.normal() * velocity
        places, time = ToldPlaces(), 0.0
        told = []
        for interval in rng.uniform(0.02, 0.05, 6):
            time += interval
            place = start + time * (velocity + 0.5 * time * bend)
            told.append(places.report(tuple(place), time))
        assert told[0] is None
        np.testing.assert_allclose(told[-1], velocity + time * bend, atol=1e-9)
        assert places.interval == pytest.approx(interval)


def test_on_a_circle_the_velocity_is_that_of_the_circle():
    """The parabola alone would be wrong by a third of the square of the angle, 1.5 %."""
    places, told = ToldPlaces(), None
    for angle in 0.21 * np.arange(5):
        told = places.report((0.02 * np.cos(angle), 0.02 * np.sin(angle), 0.3), angle / 6.28)
    velocity = 6.28 * 0.02 * np.array((-np.sin(angle), np.cos(angle), 0.0))
    assert np.linalg.norm(told - velocity) < 0.003 * np.linalg.norm(velocity)


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ((0.0, 0.03, 0.06), (0.1, 0.0, 0.0)),
        # Too long ago, and a clock that was set back.
        ((0.0, 0.03, 0.5), None),
        ((0.0, 0.03, -5.0), None),
    ],
)
def test_only_places_of_late_tell_a_velocity(times, expected):
    places = ToldPlaces()
    found = [places.report((0.1 * time, 0.0, 0.3), time) for time in times][-1]
    assert found == (None if expected is None else pytest.approx(expected))
    assert places.place == (0.1 * times[-1], 0.0, 0.3)


def test_after_a_jump_the_velocity_is_not_known_until_the_next_place():
    places = ToldPlaces()
    told = [
        places.report((x, 0.0, 0.3), 0.03 * index)
        for index, x in enumerate((0.0, 0.0, 0.0, 0.1, 0.1, 0.103, 0.106))
    ]
    assert told[1:5] == [STILL] * 4
    assert told[6] == pytest.approx((0.1, 0.0, 0.0))


def test_what_is_late_or_soon_is_told_apart():
    places = ToldPlaces()
    assert not places.is_late(0.0)
    assert not places.is_soon(0.0)
    places.report((0.0, 0.0, 0.3), 1.0)
    assert places.is_late(0.99)
    # By another clock, or a clock that was set back.
    assert not places.is_late(0.5)
    assert places.is_soon(1.015)
    assert not places.is_soon(1.018)
