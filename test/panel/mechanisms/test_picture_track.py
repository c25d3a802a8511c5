"""Track: places along a branch, and the way that the crank goes along it."""

import math

import numpy as np
import pytest

from tri_glide_kinematics.panel.mechanisms.questions import Track

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


def test_the_first_place_at_a_crank_angle_whatever_the_full_turns(swinging, turning, limited):
    source = np.random.default_rng(7)
    for track in (swinging, turning, limited):
        for place in source.uniform(0.0, track.end, 200):
            angle = track.crank_angle(place)
            for turns in (-2, 0, 1):
                found = track.place_of(angle + turns * math.tau)
                offset = math.remainder(track.crank_angle(found) - angle, math.tau)
                assert offset == pytest.approx(0.0, abs=1e-9)
                assert found <= place + 1e-6
    # Never there: the nearest.
    assert limited.place_of(math.radians(41.0)) == 60.0
    assert limited.place_of(math.radians(-150.0)) == 0.0
    assert swinging.place_of(math.radians(91.0)) == 90.0


def test_turning_stays_on_the_same_side_of_a_turning_point(swinging):
    # At 30 degrees on the way there, and at 30 on the way back.
    for place, sign in ((30.0, 1.0), (150.0, -1.0)):
        for degrees in (-30.0, -29.5, 0.0, 12.25, 60.0):
            found = swinging.turned(place, math.radians(degrees))
            assert found % swinging.end == pytest.approx((place + sign * degrees) % swinging.end)
        assert swinging.turned(place, math.radians(61.0)) is None
        assert swinging.turned(place, math.radians(-31.0)) is None
    # The start of a closed branch is no end of it, but here the crank turns back.
    assert swinging.turned(2.0, math.radians(-3.0)) is None
    assert swinging.turned(90.0, math.radians(-10.0)) in (80.0, 100.0)
    assert swinging.turned(90.0, math.radians(1.0)) is None


def test_the_end_of_a_closed_branch_is_passed(turning):
    assert turning.turned(350.0, math.radians(20.0)) == pytest.approx(10.0)
    assert turning.turned(10.0, math.radians(-20.0)) == pytest.approx(350.0)
    for by in (-359.0, 359.0):
        assert turning.turned(10.5, math.radians(by)) == pytest.approx((10.5 + by) % 360.0)


def test_a_branch_over_more_than_a_turn_is_not_jumped_on():
    # To 400 degrees and back: 50 degrees is passed, but not 10 degrees beyond the turning point.
    track = Track(np.radians([*range(0, 401), *range(399, -1, -1)]), np.zeros(801), closed=True)
    assert track.turned(390.0, math.radians(20.0)) is None
    assert track.turned(390.0, math.radians(-340.0)) == pytest.approx(50.0)


def test_turning_changes_the_crank_angle_by_as_much(swinging, turning, limited):
    source = np.random.default_rng(11)
    found = 0
    for track in (swinging, turning, limited):
        for place in source.uniform(0.0, track.end, 200):
            by = source.uniform(-2.0, 2.0)
            if (end := track.turned(place, by)) is None:
                continue
            found += 1
            change = track.crank_angle(end) - track.crank_angle(place)
            assert math.remainder(change - by, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert found > 250


def test_beyond_the_limits_there_is_no_place(limited):
    assert limited.turned(60.0, math.radians(1.0)) is None
    assert limited.turned(0.0, math.radians(-1.0)) is None
    assert limited.turned(20.0, math.radians(40.0)) == pytest.approx(60.0)


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
    assert swinging.crank_angle(45.5) == pytest.approx(swinging.crank_angle(134.5))
    assert swinging.key(45.5) == pytest.approx(45.5 / 180.0)
    assert swinging.key(134.5) == pytest.approx(134.5 / 180.0)
