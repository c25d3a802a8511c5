"""The stamps of setpoints tell a lost one from a late one, and stay near the clock."""

import random

import pytest

from tri_glide_kinematics.control import NominalTime

PERIOD = 0.002
STEP = 2_000_000  # ns
MOVING, RESTING = (0.0, 0.1, -0.2), (0.0, 0.0, 0.0)


def test_stamps_are_one_period_apart_however_late_the_cycles_come():
    random.seed(1)
    times, now = NominalTime(PERIOD), 10**18
    first = times.stamp(RESTING, now)
    assert first == now
    for count in range(1, 1000):
        late = random.randrange(STEP)
        assert times.stamp(MOVING, now + count * STEP + late) == first + count * STEP


def test_setpoints_between_two_stamps_are_counted_while_stamps_catch_up_with_the_clock():
    random.seed(2)
    times, now, stamps, behind = NominalTime(PERIOD), 10**18, [], []
    times.stamp(RESTING, now)
    for count in range(20_000):
        # A computer that leaves one of fifty cycles out, and once half a second.
        now += STEP * (1 + (random.random() < 0.02)) + (500_000_000 if count == 3000 else 0)
        stamps.append(times.stamp(MOVING, now))
        behind.append(now - stamps[-1])
    for lost in range(1, 16):
        for earlier, later in zip(stamps, stamps[lost:]):
            assert (later - earlier) // STEP == lost
    assert max(behind[:3000]) < 20 * STEP
    assert max(behind[3000:]) < 600_000_000 and behind[-1] < 10 * STEP


def test_a_clock_that_is_set_is_followed_at_rest_and_not_before():
    times, now = NominalTime(PERIOD), 10**18
    for count in range(10):
        stamp = times.stamp(MOVING, now - 3600 * 10**9 * (count > 4))
        assert stamp == now + count * STEP
    set_back = now - 3600 * 10**9
    # The first one at rest ends the motion: it is a period after the one before it.
    assert times.stamp(RESTING, set_back) == now + 10 * STEP
    assert times.stamp(RESTING, set_back) == set_back
    assert times.stamp(MOVING, set_back + STEP // 2) == set_back + STEP


@pytest.mark.parametrize("ahead", [-STEP // 2, STEP // 2])
def test_little_jitter_sets_no_stamp_at_rest(ahead):
    times, now = NominalTime(PERIOD), 10**18
    times.stamp(RESTING, now)
    for count in range(1, 10):
        assert times.stamp(RESTING, now + count * STEP + ahead) == now + count * STEP
