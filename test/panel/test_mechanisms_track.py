"""Track: places along a branch, and the way that the crank goes along it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tri_glide_kinematics.panel.mechanisms.track import Track

# From 0 to 90 degrees and back, as past a turning point, with a key that rises all the way.
THERE_AND_BACK = np.radians([*range(0, 91), *range(89, -1, -1)])
KEYS = np.linspace(0.0, 1.0, THERE_AND_BACK.size)


@pytest.fixture
def swinging():
    return Track(THERE_AND_BACK, KEYS, closed=True)


@pytest.fixture
def turning():
    angles = math.radians(30.0) + np.linspace(0.0, math.tau, 361)
    return Track(angles, np.sin(angles), closed=True)


@pytest.fixture
def limited():
    return Track(np.radians(np.arange(-20.0, 41.0)), np.zeros(61), closed=False)


def test_a_crank_angle_that_is_passed_twice_is_found_where_it_is_near(swinging):
    angle = math.radians(45.5)
    assert swinging.place_of(angle, 30.0) == pytest.approx(45.5)
    assert swinging.place_of(angle, 100.0) == pytest.approx(134.5)
    # The end is the start again: from the end, the first passage is as near as the last.
    assert swinging.place_of(math.radians(1.5), 179.0) == pytest.approx(178.5)
    assert swinging.place_of(math.radians(1.5), 1.0) == pytest.approx(1.5)


def test_every_place_is_found_again(swinging, turning, limited):
    source = np.random.default_rng(7)
    for track in (swinging, turning, limited):
        for place in source.uniform(0.0, track.end, 200):
            angle = track.crank_angle(place)
            for turns in (-2, 0, 1):
                found = track.place_of(angle + turns * math.tau, place)
                assert track.crank_angle(found) == pytest.approx(angle)
                assert found == pytest.approx(place, abs=1e-6)


def test_beyond_the_limits_there_is_no_place(swinging, limited):
    assert limited.place_of(math.radians(41.0), 60.0) is None
    assert limited.place_of(math.radians(170.0), 60.0) is None
    assert swinging.place_of(math.radians(91.0), 90.0) is None
    assert swinging.place_of(math.radians(-90.0), 0.0) is None


@pytest.mark.parametrize("forward", [True, False])
def test_a_closed_branch_goes_round_for_ever(turning, forward):
    place = 355.0
    for _ in range(720):
        place, still_forward = turning.advanced(place, math.radians(1.0), forward)
        assert still_forward is forward
        assert 0.0 <= place < turning.end
    assert place == pytest.approx(355.0, abs=1e-6)


def test_a_branch_with_ends_is_gone_back(limited):
    place, forward = 55.0, True
    seen = []
    for _ in range(240):
        place, forward = limited.advanced(place, math.radians(1.0), forward)
        seen.append(round(place, 6))
    assert (min(seen), max(seen)) == (0.0, 60.0)
    # Twice the way there and back.
    assert seen[-1] == pytest.approx(55.0, abs=1e-6)
    assert np.abs(np.diff(seen)).max() <= 1.0 + 1e-6
    assert limited.advanced(30.0, 0.0, True) == (30.0, True)
    assert limited.advanced(30.0, 0.0, False) == (30.0, False)


def test_the_key_tells_both_ways_apart(swinging):
    angle = math.radians(45.5)
    there, back = (swinging.place_of(angle, near) for near in (30.0, 150.0))
    assert swinging.key(there) == pytest.approx(45.5 / 180.0)
    assert swinging.key(back) == pytest.approx(134.5 / 180.0)
