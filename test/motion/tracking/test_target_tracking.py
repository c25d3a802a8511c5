"""Steps towards moving targets: caught up with, then followed without an error."""

import math

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE
from soak import corners
from tracking_run import PERIODS, TrackingRun, at_rest

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.tracking import FOLLOW_HORIZON, MovingTarget, TargetMotion
from tri_glide_kinematics.motion.tracking.target_tracking import TargetTracking, straight_towards

STILL = (0.0, 0.0, 0.0)
RADIUS = 0.02


@corners("rate, period", (5.0, 30.0, 100.0, 200.0), PERIODS)
def test_a_target_on_a_straight_line_is_followed_without_an_error(rate, period):
    start, velocity = np.array((-0.1, -0.05, 0.3)), np.array((0.25, 0.15, 0.063))
    assert np.linalg.norm(velocity) == pytest.approx(0.3, abs=0.005)

    def target(time: float) -> MovingTarget:
        told = math.floor(time * rate + 1e-9) / rate
        report = MovingTarget(tuple(start + told * velocity), tuple(velocity))
        return report.after(time - told)

    run = TrackingRun()
    places = run.run(target, 0.7, period)
    times = period * np.arange(len(places))[:, np.newaxis]
    errors = np.linalg.norm(places - (start + times * velocity), axis=1)
    # Caught up with in less than 0.2 s, from a tenth of a metre away.
    assert errors[0] > 0.1
    assert errors[times[:, 0] > 0.2].max() < 1e-12
    assert run.refused <= 2


@pytest.mark.parametrize("period", (0.001, 0.004))
def test_a_circle_that_is_told_30_times_a_second_with_jitter(period):
    rng = np.random.default_rng(1)
    reports = [(n / 30.0, n / 30.0 + rng.uniform(0.0, 0.005)) for n in range(30)]

    def place(time: float) -> MovingTarget:
        angle = math.tau * time
        x, y = RADIUS * math.cos(angle), RADIUS * math.sin(angle)
        return MovingTarget((x, y, 0.3), (-math.tau * y, math.tau * x, 0.0))

    def largest_error(wanted) -> float:
        run = TrackingRun((RADIUS, 0.0, 0.3))
        errors = []
        motion = TargetMotion(place(0.0), 0.0)
        waiting = list(reports)
        for cycle in range(round(1.0 / period)):
            while waiting and waiting[0][1] <= cycle * period:
                stamp, _ = waiting.pop(0)
                motion.report(place(stamp), stamp)
            end = (cycle + 1) * period
            run.step(wanted(motion, end), period=period)
            errors.append(math.dist(MACHINE.forward(run.state.heights), place(end).position))
        return max(errors[round(0.5 / period) :])

    followed = largest_error(lambda motion, end: motion.at(end))
    blind = largest_error(lambda motion, end: MovingTarget(motion.at(motion.time).position, STILL))
    assert followed < 0.3e-3
    assert followed < blind / 10.0


@corners("place, period", ((0.1, 0.05, 0.35), (-0.08, 0.06, 0.25), (0.0, 0.0, 0.3 + 1e-7)), PERIODS)
def test_a_target_at_rest_is_reached_and_the_sliders_rest_exactly(place, period):
    run = TrackingRun()
    run.run(lambda time: MovingTarget(place, STILL), 0.6, period)
    assert run.rests
    assert run.held.ends_at_rest
    assert math.dist(run.places[-1], place) < 1e-12
    # Nothing changes after that.
    rested = run.state
    run.step(MovingTarget(place, STILL), period=period)
    assert run.state == rested


def test_places_everywhere_in_the_workspace_are_reached():
    """Next to the edges as well, where many steps are refused on the way."""
    rng, refused = np.random.default_rng(5), 0
    for _ in range(7):
        while True:
            place = tuple(rng.uniform((-0.25, -0.25, 0.0), (0.25, 0.25, 0.6)).tolist())
            if WORKSPACE.exit_distance(place, (0.0, 0.0, 1.0), 1.0) > 0.0:
                break
        run = TrackingRun()
        while not (run.held and run.held.ends_at_rest and run.held.after is run.state):
            run.step(MovingTarget(place, STILL))
            assert len(run.states) < 2000
        assert math.dist(run.places[-1], place) < 1e-12
        refused += run.refused
    assert refused > 0


def test_a_target_that_jumps_reverses_stops_and_leaves():
    run = TrackingRun()
    forth, back = (0.2, 0.0, 0.0), (-0.2, 0.0, 0.0)
    run.run(lambda time: MovingTarget((0.2 * time - 0.05, 0.0, 0.3), forth), 0.5)
    run.run(lambda time: MovingTarget((0.05 - 0.2 * time, 0.0, 0.3), back), 0.3)
    assert math.dist(run.places[-1], (-0.01, 0.0, 0.3)) < 1e-12
    run.run(lambda time: MovingTarget((0.0, 0.08 + 0.1 * time, 0.3), (0.0, 0.1, 0.0)), 0.4)
    assert math.dist(run.places[-1], (0.0, 0.12, 0.3)) < 1e-12
    # On it goes and out of the workspace, while the platform comes to rest inside.
    run.run(lambda time: MovingTarget((0.0, 0.12 + 0.1 * time, 0.3), (0.0, 0.1, 0.0)), 3.0)
    assert run.rests
    WORKSPACE.check_heights(run.state.heights)
    assert run.places[-1][1] > 0.15
    # It comes back.
    run.run(lambda time: MovingTarget((0.0, 0.1 - 0.1 * time, 0.3), (0.0, -0.1, 0.0)), 1.0)
    assert math.dist(run.places[-1], (0.0, 0.0, 0.3)) < 1e-12


def test_a_target_faster_than_the_sliders_is_run_after_within_the_limits():
    slow = SliderLimits.uniform(0.1, 2.0, 40.0)
    run = TrackingRun((-0.1, 0.0, 0.3))
    for cycle in range(800):
        x = min(-0.1 + 0.4 * cycle * 0.002, 0.1)
        velocity = (0.4, 0.0, 0.0) if x < 0.1 else STILL
        run.step(MovingTarget((x, 0.0, 0.3), velocity), slow)
    rates = np.abs([state.velocities for state in run.states])
    assert rates.max() == pytest.approx(0.1, rel=1e-6)
    assert run.refused == 0
    assert math.dist(run.places[-1], (0.1, 0.0, 0.3)) < 1e-12


def test_a_target_with_an_acceleration_is_followed_without_an_error():
    acceleration = (0.3, -0.2, 0.1)
    first = MovingTarget((-0.05, 0.05, 0.3), (0.0, 0.0, 0.0), acceleration)
    run = TrackingRun((-0.05, 0.05, 0.3))
    run.run(first.after, 0.6)
    assert run.refused == 0
    assert math.dist(run.places[-1], first.after(0.6).position) < 1e-12


def test_each_slider_on_the_shortest_way_goes_on_as_it_was_planned():
    """A target at rest far away: what is planned anew in each cycle is the plan of the first."""
    target = MovingTarget((0.05, -0.03, 0.33), STILL)
    tracking, state, period = TargetTracking(WORKSPACE), at_rest(), 0.002
    ways = tracking.step_towards(state, target, LIMITS, 0.5)
    durations = [sum(length for length, jerk in way.phases if jerk) for way in ways]
    run = TrackingRun()
    run.run(lambda time: target, max(durations) + 2.0 * period, period)
    assert run.rests


def test_straight_towards_a_target():
    target = MovingTarget((0.1, 0.0, 0.3), (0.0, 0.02, 0.0))
    x, y, z = straight_towards((0.0, 0.0, 0.3), target, LIMITS)
    assert (y, z) == (0.02, 0.0)
    assert 0.3 < x < 1.0
    assert straight_towards(target.position, target, LIMITS) == target.velocity


REPORT = MovingTarget((0.0, 0.0, 0.3), (0.1, 0.0, 0.0))


@pytest.mark.parametrize(
    ("position", "velocity", "interval", "acceleration"),
    [
        ((0.0105, 0.0, 0.3), (0.11, 0.0, 0.0), 0.1, (0.1, 0.0, 0.0)),
        # It jumped; it is another motion; reports too far apart, too near, or out of order.
        ((0.0205, 0.0, 0.3), (0.11, 0.0, 0.0), 0.1, STILL),
        ((0.0, 0.0, 0.3), (-0.9, 0.0, 0.0), 0.1, STILL),
        ((0.0525, 0.0, 0.3), (0.11, 0.0, 0.0), 0.5, STILL),
        ((0.000105, 0.0, 0.3), (0.11, 0.0, 0.0), 0.001, STILL),
        ((0.0105, 0.0, 0.3), (0.11, 0.0, 0.0), -0.1, STILL),
        ((0.0, 0.0, 0.3), (0.1, 0.0, 0.0), 0.0, STILL),
    ],
)
def test_two_reports_tell_the_acceleration(position, velocity, interval, acceleration):
    motion = TargetMotion(REPORT, 5.0)
    np.testing.assert_allclose(motion.at(5.1).position, (0.01, 0.0, 0.3), atol=1e-12)
    motion.report(MovingTarget(position, velocity), 5.0 + interval)
    assert motion.time == 5.0 + interval
    now = motion.at(motion.time)
    assert now.position == position
    np.testing.assert_allclose(now.acceleration, acceleration, atol=1e-12)
    # It lasts for as long again, and then the velocity is steady.
    if any(acceleration):
        later = motion.at(motion.time + interval)
        np.testing.assert_allclose(later.velocity, (0.12, 0.0, 0.0))
        last = motion.at(motion.time + 2.0 * interval)
        np.testing.assert_allclose(last.velocity, (0.12, 0.0, 0.0))
        assert not any(last.acceleration)
        np.testing.assert_allclose(last.position[0], later.position[0] + 0.012)
        # It lasts longer where that is foreseen.
        ahead = motion.at(motion.time + 2.0 * interval, foreseen=interval)
        np.testing.assert_allclose(ahead.velocity, (0.13, 0.0, 0.0))
        beyond = motion.at(motion.time + 3.0 * interval, foreseen=interval)
        np.testing.assert_allclose(beyond.velocity, (0.13, 0.0, 0.0))


@pytest.mark.parametrize("velocity", [-0.1, 0.0])
def test_where_a_target_turns_or_rests_of_a_sudden_no_acceleration_is_led(velocity):
    motion, interval = TargetMotion(REPORT, 0.0), 0.0498
    for number in range(1, 18):
        # Rounding is nothing new, and does not hide what is.
        time = number * interval
        place = 0.1 * time
        assert not motion.report(MovingTarget((place, 0.0, 0.3), (0.1, 0.0, 0.0)), time)
    end = (place + 0.5 * interval * (0.1 + velocity), 0.0, 0.3)
    assert motion.report(MovingTarget(end, (velocity, 0.0, 0.0)), 18 * interval)
    later = motion.at(18.7 * interval)
    np.testing.assert_allclose(later.velocity, (velocity, 0.0, 0.0), atol=1e-12)
    assert not any(later.acceleration)


def to_and_fro(time: float, way: float, turns: float) -> MovingTarget:
    """Return a target that goes to and fro along a line so many times a second."""
    rate, (x, y, z) = math.tau * turns, (0.8, 0.6, 0.0)
    place, speed = way * math.sin(rate * time), way * rate * math.cos(rate * time)
    return MovingTarget((x * place, y * place, 0.3), (x * speed, y * speed, z))


@pytest.mark.parametrize(
    ("way", "turns", "told", "largest"),
    [(0.02, 1.0, 0.01, 2e-6), (0.05, 0.5, 0.01, 1e-6), (0.05, 0.5, 1.0 / 30.0, 1e-5)],
)
def test_a_target_that_goes_to_and_fro_is_foreseen_and_followed_where_it_turns(
    way, turns, told, largest
):
    """Its change goes through zero there, which is no noise, and its velocity, which is no turn."""
    motion, run, reports = TargetMotion(to_and_fro(0.0, way, turns), 0.0), TrackingRun(), 1
    run.follower.horizon, period, errors = FOLLOW_HORIZON, 0.002, []
    for cycle in range(round(2.5 / turns / period)):
        while reports * told <= cycle * period:
            motion.report(to_and_fro(reports * told, way, turns), reports * told)
            reports += 1
        end = (cycle + 1) * period
        run.step(motion.at(end), period=period)
        place = MACHINE.forward(run.state.heights)
        errors.append(math.dist(place, to_and_fro(end, way, turns).position))
    assert max(errors[round(1.0 / turns / period) :]) < largest


def test_a_target_that_goes_elsewhere_twice_is_something_new_both_times():
    motion, interval, place = TargetMotion(REPORT._replace(lead=5e-5), 0.0), 0.05, 0.0
    new, velocity = [], 0.1
    for number, told in enumerate([0.1] * 12 + [0.4, 0.2, 0.2, 0.2], 1):
        place += 0.5 * interval * (velocity + told)
        velocity = told
        report = MovingTarget((place, 0.0, 0.3), (told, 0.0, 0.0))
        new.append(motion.report(report, number * interval))
    assert new[:12] == [False] * 12
    assert new[12:14] == [True, True]
    assert not new[-1]


def test_right_velocities_are_not_corrected_by_noise_nor_by_a_jump():
    rng, right = np.random.default_rng(3), (0.1, 0.0, 0.0)
    motion = TargetMotion(MovingTarget((0.0, 0.0, 0.3), right), 0.0)
    wrong = []
    for number in range(1, 300):
        time = 0.01 * number
        x, y, z = 1e-4 * rng.normal(size=3) + (0.02 * (number > 150), 0.0, 0.0)
        motion.report(MovingTarget((x + 0.1 * time, y, 0.3 + z), right), time)
        wrong.append(math.dist(motion.at(time).velocity, right))
    # The noise of a velocity that positions tell is 14 mm/s.
    assert np.mean(wrong) < 5e-4


def test_a_follower_takes_no_run_up():
    # Before the platform has moved, the target is as fast as it only becomes on a long way.
    target = MovingTarget((0.001, 0.0, 0.3), (0.3, 0.0, 0.0), lead=5e-5)
    run = TrackingRun((0.0, 0.0, 0.3))
    places = run.run(target.after, 0.1, 0.02)
    assert places[:, 0].min() > -1e-5


def test_the_lead_grows_with_the_way_and_ends_where_the_target_rests_or_turns():
    motion = TargetMotion(REPORT, 0.0)
    assert motion.at(0.0).lead == math.inf
    steps = [
        ((0.1, 0.0, 0.3), STILL, 0.0),
        ((0.2, 0.0, 0.3), (0.1, 0.0, 0.0), 0.0),
        ((0.3, 0.0, 0.3), (0.1, 0.01, 0.0), 1e-3),
        ((0.5, 0.0, 0.3), (0.1, 0.0, 0.0), 3e-3),
        ((0.6, 0.0, 0.3), (0.0, 0.1, 0.0), 0.0),
        ((0.7, 0.0, 0.3), (0.0, 0.1, 0.0), 1e-3),
        ((0.8, 0.0, 0.3), (0.0, -0.1, 0.0), 0.0),
        ((0.9, 0.0, 0.3), (0.0, math.nan, 0.0), 0.0),
    ]
    for number, (position, velocity, more) in enumerate(steps):
        motion.report(MovingTarget(position, velocity), 0.01 * (number + 1))
        assert motion.at(0.5).lead == pytest.approx(5e-5 + more)


@pytest.mark.parametrize(
    ("speed", "kept", "reports"),
    [(0.1, 0.97, 9000), *((speed, 1.0, 50) for speed in (1e-82, 1e-90, 1e-150, 1e-160, 1e-300))],
)
def test_a_target_is_followed_however_small_its_speed_becomes(speed, kept, reports):
    motion, x, interval = TargetMotion(MovingTarget((0.0, 0.0, 0.3), STILL), 0.0), 0.0, 0.005
    for number in range(1, reports):
        x += speed * interval
        speed *= kept
        motion.report(MovingTarget((x, 0.0, 0.3), (speed, 0.0, 0.0)), number * interval)
    now = motion.at(reports * interval)
    assert now.position == pytest.approx((x, 0.0, 0.3), abs=max(speed, 1e-12))
    assert now.velocity == pytest.approx((speed, 0.0, 0.0), abs=1e-12)
