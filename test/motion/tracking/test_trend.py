"""What is told now and then: what it is, how it changes, and what of that is noise."""

import math

import numpy as np
import pytest

from tri_glide_kinematics.motion.tracking import MovingTarget, TargetMotion, ToldVelocity
from tri_glide_kinematics.motion.tracking.trend import Trend

STILL = (0.0, 0.0, 0.0)
INTERVAL = 0.01


def turning(time: float, turns: float = 1.0, speed: float = 0.1) -> tuple[float, float, float]:
    """Return a velocity that turns so often a second [m/s]."""
    angle = math.tau * turns * time
    return speed * math.cos(angle), speed * math.sin(angle), 0.0


def test_a_steady_change_is_known_exactly_from_three_reports_on():
    rng = np.random.default_rng(1)
    for _ in range(50):
        value, rate, bend = rng.normal(size=(3, 3)) * ((0.1,), (1.0,), (5.0,))
        trend, time = Trend(tuple(value)), 0.0
        for interval in rng.uniform(0.009, 0.011, 1).repeat(5):
            time += interval
            told = value + time * (rate + 0.5 * time * bend)
            trend.report(tuple(told), interval)
        now = trend.now.after(0.02)
        at = time + 0.02
        np.testing.assert_allclose(now.value, value + at * (rate + 0.5 * at * bend), atol=1e-9)
        np.testing.assert_allclose(now.rate, rate + at * bend, atol=1e-7)


def test_noise_is_kept_out_and_what_stays_of_it_is_not_late():
    rng = np.random.default_rng(2)
    trend, off, raw = Trend(turning(0.0)), [], []
    for number in range(1, 400):
        noise = 1e-3 * rng.normal(size=3)
        trend.report(tuple(np.add(turning(number * INTERVAL), noise)), INTERVAL)
        if number > 50:
            off.append(np.subtract(trend.now.value, turning(number * INTERVAL)))
            raw.append(noise)
    assert np.sqrt(np.square(off).mean()) < 0.95 * np.sqrt(np.square(raw).mean())
    # In the mean it is where the velocity is, along it and across.
    assert np.abs(np.mean(off, axis=0)).max() < 2e-4


def test_something_new_is_taken_as_it_is_told_however_much_noise_there_was():
    rng = np.random.default_rng(3)
    trend = Trend((0.1, 0.0, 0.0))
    for _ in range(100):
        trend.report(tuple(np.add((0.1, 0.0, 0.0), 1e-4 * rng.normal(size=3))), INTERVAL)
    trend.report(STILL, INTERVAL)
    assert trend.now.value == STILL
    assert trend.now.bend == STILL


def test_reports_that_are_far_apart_tell_a_rate_and_no_more():
    trend = Trend(STILL)
    for number in range(1, 6):
        trend.report((0.1 * number * number, 0.0, 0.0), 0.05)
    assert trend.now.value[0] == pytest.approx(2.5)
    assert trend.now.rate[0] == pytest.approx((2.5 - 1.6) / 0.05)
    assert trend.now.bend == STILL


@pytest.mark.parametrize("turns", [0.25, 0.5, 1.0])
def test_a_twist_that_turns_is_led(turns):
    velocity = ToldVelocity(turning(0.0), 0.0)
    for number in range(1, 60):
        velocity.report(turning(number * INTERVAL, turns), number * INTERVAL)
    for ahead in (0.0, 0.005, 0.01):
        time = 59 * INTERVAL + ahead
        found, rate = velocity.at(time)
        size = 0.1 * math.tau * turns
        assert math.dist(found, turning(time, turns)) < 0.07 * size * INTERVAL
        assert math.hypot(*rate) == pytest.approx(size, rel=0.05)


def test_a_turn_that_ends_is_overshot_by_what_was_led_until_the_first_report_that_shows_it():
    velocity = ToldVelocity(turning(0.0), 0.0)
    for number in range(1, 60):
        velocity.report(turning(number * INTERVAL), number * INTERVAL)
    time, last = 59 * INTERVAL, turning(59 * INTERVAL)
    rate = 0.1 * math.tau
    # Nothing comes any more: it is led for one and a half of an interval.
    most = max(math.dist(velocity.at(time + 1e-3 * n).velocity, last) for n in range(40))
    assert 0.9 * rate * INTERVAL < most < 1.05 * rate * 1.5 * INTERVAL
    assert velocity.at(time + 1.6 * INTERVAL) == (last, STILL)
    # It is sent on without a turn.
    for number in range(60, 64):
        velocity.report(last, number * INTERVAL)
        assert velocity.at((number + 0.6) * INTERVAL) == (last, STILL)


def test_a_twist_that_is_repeated_when_another_one_is_due_is_led_no_more():
    velocity = ToldVelocity(turning(0.0), 0.0)
    for number in range(1, 60):
        velocity.report(turning(number * INTERVAL), number * INTERVAL)
    time = 59 * INTERVAL
    velocity.repeat(time + 0.8 * INTERVAL)
    assert any(velocity.at(time + INTERVAL).acceleration)
    velocity.repeat(time + INTERVAL)
    assert velocity.at(time + INTERVAL) == (turning(time), STILL)


def test_a_stick_that_is_held_or_pushed_at_once_is_not_led():
    rng = np.random.default_rng(5)
    velocity, time = ToldVelocity(STILL, 0.0), 0.0
    push = (0.1, 0.0, 0.0)
    for _ in range(5):
        time += INTERVAL
        velocity.report(push, time)
        assert velocity.at(time + INTERVAL) == (push, STILL)
    # Between two steps of 1/127 of 0.1 m/s.
    sizes = []
    for _ in range(500):
        time += INTERVAL
        told = (0.1 * (100 + rng.integers(2)) / 127.0, 0.0, 0.0)
        velocity.report(told, time)
        sizes.append(math.dist(velocity.at(time + INTERVAL).velocity, told))
    assert max(sizes) < 1.2 * 0.1 / 127.0
    assert np.mean(sizes) < 0.5 * 0.1 / 127.0


@pytest.mark.parametrize("sent", [0.001, 0.002, 0.005])
def test_a_twist_that_is_sent_more_often_than_it_is_made_is_led_all_the_same(sent):
    velocity, most = ToldVelocity(turning(0.0), 0.0), 0.0
    for number in range(1, round(1.0 / sent)):
        time = number * sent
        made = INTERVAL * math.floor(time / INTERVAL + 1e-6)
        velocity.report(turning(made), time)
        if time > 0.2:
            most = max(most, math.dist(velocity.at(time + sent).velocity, turning(time + sent)))
    assert most < 0.1 * math.tau * 0.25 * INTERVAL


@pytest.mark.parametrize("sent", [0.0005, 0.001, 0.002])
def test_reports_that_are_near_together_tell_the_newest_and_how_it_changes(sent):
    target = TargetMotion(MovingTarget(STILL, turning(0.0)), 0.0)
    velocity = ToldVelocity(turning(0.0), 0.0)
    for number in range(1, round(0.5 / sent)):
        time = number * sent
        rate = math.tau
        place = 0.1 / rate * math.sin(rate * time), 0.1 / rate * (1 - math.cos(rate * time)), 0.0
        target.report(MovingTarget(place, turning(time)), time)
        velocity.report(turning(time), time)
    now = target.at(time)
    assert now.position == pytest.approx(place, abs=1e-8)
    assert math.dist(now.velocity, turning(time)) < 1e-5
    assert math.hypot(*now.acceleration) == pytest.approx(0.1 * rate, rel=0.01)
    assert math.dist(velocity.at(time + 0.002).velocity, turning(time + 0.002)) < 1e-4


def test_twists_out_of_order_or_far_apart_are_taken_as_they_are():
    velocity = ToldVelocity(turning(0.0), 0.0)
    for time in (0.01, 0.02, 0.03, 0.02, 0.02, 0.52, 1.02):
        velocity.report(turning(time), time)
    assert velocity.at(1.05) == (turning(1.02), STILL)
