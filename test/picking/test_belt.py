"""What an encoder reports tells where the belt was and will be, whatever it rounds off or loses."""

import math
import random

import pytest
from soak import many, seed

from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.picking import BeltMotion, BeltUnknownError, SimulatedBelt
from tri_glide_kinematics.picking import belt as belt_room

PERIOD = 0.01  # s
STEP = 5e-5  # m


def belt_of(speed, *changes):
    """Return a belt that runs along x."""
    return SimulatedBelt((1.0, 0.0, 0.0), speed, changes)


def counted(position, step=STEP):
    """Return what an encoder makes of a position, in the middle of a step."""
    return step * (math.floor(position / step) + 0.5)


def told(motion, belt, begin, end, period=PERIOD, step=STEP):
    """Report a belt from one time to another; return whether each report was a jump."""
    count = round((end - begin) / period)
    times = [begin + number * period for number in range(count)]
    return [motion.report(time, counted(belt.at(time)[0], step)) for time in times]


def test_a_steady_belt_is_foreseen_within_little_more_than_a_step_of_its_encoder():
    drawn = random.Random(seed(1))
    for _ in range(many(40)):
        step, belt = drawn.choice((STEP, 2 * STEP)), belt_of(drawn.uniform(0.05, 0.5))
        motion, begin = BeltMotion(), drawn.uniform(0.0, PERIOD)
        told(motion, belt, begin, 1.5, step=step)
        for ahead in (0.02, 0.3, 0.8):
            state = motion.at(1.5 + ahead)
            assert abs(state.position - belt.at(1.5 + ahead)[0]) < 0.9 * step


def test_of_the_reports_of_a_quick_encoder_some_are_used_and_tell_as_much(monkeypatch):
    fits, belt, motion = [], belt_of(0.3), BeltMotion()
    fit = belt_room.fitted
    monkeypatch.setattr(belt_room, "fitted", lambda *data: fits.append(1) or fit(*data))
    told(motion, belt, 0.0, 1.0, period=0.001)
    assert len(fits) <= 334
    assert abs(motion.at(1.3).position - belt.at(1.3)[0]) < STEP


@pytest.mark.parametrize("speed, wanted", [(0.1, 0.22), (0.3, 0.42), (0.3, 0.18), (0.05, 0.17)])
def test_a_belt_that_speeds_up_without_notice_is_foreseen_until_the_grip(speed, wanted):
    drawn = random.Random(seed(2))
    begin = 1.5 + drawn.uniform(0.0, PERIOD)
    belt, motion = belt_of(speed, (begin, wanted, 0.2)), BeltMotion(STEP)
    told(motion, belt, 0.0, 1.4)
    worst = steady = 0.0
    for number in range(140, 280):
        now = number * PERIOD
        told(motion, belt, now, now + PERIOD)
        # Of the last update before the grip, with a report that came in late.
        near, far = now + 0.032, now + 0.3
        worst = max(worst, abs(motion.at(near).position - belt.at(near)[0]))
        if begin + 0.2 < now and far < begin + 0.6:
            steady = max(steady, abs(motion.at(far).position - belt.at(far)[0]))
    assert worst < 0.6e-3
    assert 0.0 < steady < 1e-3


@pytest.mark.parametrize("speed, wanted", [(0.1, 0.3), (0.3, 0.1)])
def test_an_acceleration_is_known_60_ms_after_it_has_begun(speed, wanted):
    drawn = random.Random(seed(4))
    for _ in range(many(6)):
        begin = 1.5 + drawn.uniform(0.0, PERIOD)
        belt, motion = belt_of(speed, (begin, wanted, 0.2)), BeltMotion(STEP)
        told(motion, belt, 0.0, begin + 0.06)
        # Without it, it would be 2.25 mm.
        grip = begin + 0.15
        assert abs(motion.at(grip).position - belt.at(grip)[0]) < 1e-3


@pytest.mark.parametrize("changes", [(0.3, 0.0), (0.0, 0.3), (0.3, -0.3), (0.05, 0.06)])
def test_a_belt_that_changes_its_speed_at_once_is_noticed_within_50_ms(changes):
    before, after = changes
    belt, motion = belt_of(before, (1.503, after, 1e6)), BeltMotion(STEP)
    assert not any(told(motion, belt, 0.0, 1.56))
    assert abs(motion.at(1.56).velocity - after) < 3e-3
    assert abs(motion.at(1.503).position - belt.at(1.503)[0]) < 1.5e-3


def test_a_belt_that_slows_down_is_foreseen_to_stop_and_not_to_turn_round():
    belt, motion = belt_of(0.2, (1.0, 0.0, 0.2)), BeltMotion(STEP)
    told(motion, belt, 0.0, 1.6)
    state = motion.at(10.0)
    assert (state.velocity, state.acceleration) == (0.0, 0.0)
    assert state.position == pytest.approx(belt.at(2.0)[0], abs=1e-3)
    assert motion.at(1.7).acceleration == pytest.approx(-0.2, abs=0.01)


def test_the_past_is_kept_for_three_seconds_and_what_is_not_known_is_refused():
    belt, motion = belt_of(0.1, (2.0, 0.5, 1.0)), BeltMotion(STEP)
    with pytest.raises(BeltUnknownError, match="no report"):
        motion.at(0.0)
    told(motion, belt, 0.0, 6.0)
    for time in (2.99, 3.001, 4.4567, 5.98, 5.9899):
        position, velocity, _ = belt.at(time)
        assert motion.at(time).position == pytest.approx(position, abs=STEP)
        assert motion.at(time).velocity == pytest.approx(velocity, abs=2e-3)
    with pytest.raises(BeltUnknownError, match=r"time = 0\.5 s"):
        motion.at(0.5)
    for report in ((math.nan, 0.0), (7.0, math.inf)):
        with pytest.raises(NotFiniteError):
            motion.report(*report)
    with pytest.raises(OutOfBoundsError):
        BeltMotion(wrap=-1.0)


def test_a_silent_encoder_is_told_and_what_comes_late_or_twice_changes_nothing():
    belt, motion = belt_of(0.25), BeltMotion(STEP)
    assert motion.is_silent(0.0)
    told(motion, belt, 0.0, 1.0)
    assert not motion.is_silent(1.05) and motion.is_silent(1.15)
    before = motion.at(1.2)
    assert not motion.report(0.99, 7.0) and not motion.report(0.5, -3.0)
    assert motion.at(1.2) == before
    # After half a second without a report the belt is where it would be: no jump.
    assert not any(told(motion, belt, 1.5, 1.7))
    assert motion.at(1.25).position == pytest.approx(belt.at(1.25)[0], abs=STEP)


def test_a_counter_that_wraps_does_not_jump_and_a_long_silence_of_it_is_one():
    wrap, belt = 1024 * STEP, belt_of(0.5, (1.0, -0.5, 2.0))
    motion = BeltMotion(STEP, wrap)
    for number in range(300):
        time = number * PERIOD
        assert not motion.report(time, counted(belt.at(time)[0]) % wrap)
    assert motion.at(2.9).position == pytest.approx(belt.at(2.9)[0], abs=STEP)
    assert motion.report(3.2, 0.0)
    assert motion.at(3.2).position % wrap == pytest.approx(0.0, abs=1e-12)


def test_wild_motions_are_no_jumps_and_each_jump_is_told_with_the_next_report():
    drawn = random.Random(seed(3))
    for _ in range(many(40)):
        speed, wanted = drawn.uniform(-0.6, 0.6), drawn.choice((0.0, drawn.uniform(-0.6, 0.6)))
        change = 0.5 + drawn.uniform(0.0, PERIOD), wanted, drawn.choice((0.2, 5.0, 1e6))
        belt, motion = belt_of(speed, change), BeltMotion(STEP)
        # Soon after the change, too.
        number = drawn.choice((30, 54, 56, 60, 90))
        by = drawn.choice((-1, 1)) * drawn.uniform(0.003, 2)
        time, told_at = 0.0, []
        for count in range(100):
            time += PERIOD * (1 + (drawn.random() < 0.02)) + drawn.uniform(-0.002, 0.002)
            if motion.report(time, counted(belt.at(time)[0]) + by * (count >= number)):
                told_at.append(count)
        assert len(told_at) == 1 and told_at[0] in (number, number + 1)
        assert motion.at(time).position == pytest.approx(belt.at(time)[0] + by, abs=2 * STEP)


def test_one_wrong_report_moves_no_forecast_and_after_a_jump_the_time_before_is_unknown():
    belt, motion = belt_of(0.25), BeltMotion(STEP)
    told(motion, belt, 0.0, 1.0)
    assert not motion.report(1.0, 0.0)
    assert motion.at(1.6).position == pytest.approx(belt.at(1.6)[0], abs=STEP)
    assert not any(told(motion, belt, 1.01, 1.1))
    assert motion.at(1.0).position == pytest.approx(belt.at(1.0)[0], abs=STEP)
    jumped = [motion.report(1.1 + PERIOD * k, 0.0025 * k) for k in range(2)]
    assert jumped == [False, True]
    with pytest.raises(BeltUnknownError, match=r"kept is 0\.05 s later"):
        motion.at(1.05)
    assert motion.at(1.2).position == pytest.approx(0.025, abs=1e-9)
