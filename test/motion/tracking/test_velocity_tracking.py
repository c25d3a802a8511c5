"""Steps towards velocities: straight, without lag, and to a halt before the edge."""

import math
from dataclasses import replace

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE, WORKSPACES
from soak import corners
from tracking_run import PERIODS, PLACE, TrackingRun

from benchmarks.bench_tracking import lag, turning, unchecked
from tri_glide_kinematics.motion.limits import EDGE_CLEARANCE, SliderLimits
from tri_glide_kinematics.motion.tracking import WantedVelocity
from tri_glide_kinematics.motion.tracking.straight_motion import (
    WayAhead,
    approach,
    slider_line,
    wanted_motion,
    way_to_rest,
)
from tri_glide_kinematics.vectors import FloatArray

BOX = WORKSPACES["box"]


def deviation(places: FloatArray, direction) -> float:
    """Return how far places are beside the line through the first of them [m]."""
    unit = np.array(direction) / np.linalg.norm(direction)
    ways = places - places[0]
    return float(np.linalg.norm(ways - np.outer(ways @ unit, unit), axis=1).max())


@corners("turns, period", (0.25, 0.5, 1.0, 2.0), (0.001, 0.002))
def test_lag_is_at_most_a_period_more_than_without_any_check(turns, period):
    run = TrackingRun()
    for cycle in range(round(1.0 / period)):
        assert run.step(WantedVelocity(turning(cycle * period, turns)), period=period)
    behind = lag(run.states[1:], turns, period)
    # It is less: what is wanted is foreseen for the place where the platform will be.
    assert behind <= lag(unchecked(turns, period, 1.0), turns, period) + period
    assert behind < 0.011 - period


@corners("velocity, period", ((0.1, 0.03, 0.02), (-0.1, 0.05, -0.05), (0.0, 0.0, 0.15)), PERIODS)
def test_from_rest_to_rest_on_one_straight_line(velocity, period):
    run = TrackingRun()
    run.run(lambda time: WantedVelocity(velocity), 0.6, period)
    np.testing.assert_allclose(run.velocities[-1], velocity, atol=1e-12)
    # Faster, slower, backwards, and to a halt.
    for factor in (1.5, 0.3, -1.0, 0.0):
        wanted = WantedVelocity(tuple(factor * value for value in velocity))
        run.run(lambda time, wanted=wanted: wanted, 0.4, period)
        np.testing.assert_allclose(run.velocities[-1], wanted.velocity, atol=1e-12)
    assert run.refused == 0
    assert run.rests
    assert deviation(run.places, velocity) < 1e-12


def test_after_a_turn_the_line_is_straight_again():
    run = TrackingRun()
    run.run(lambda time: WantedVelocity((0.1, 0.0, 0.0)), 0.3)
    run.run(lambda time: WantedVelocity((0.0, 0.1, 0.02)), 0.3)
    turned = len(run.states)
    run.run(lambda time: WantedVelocity((0.0, 0.1, 0.02)), 0.5)
    assert deviation(run.places[turned - 1 :], (0.0, 0.1, 0.02)) < 1e-12
    np.testing.assert_allclose(run.velocities[-1], (0.0, 0.1, 0.02), atol=1e-12)


def test_limits_reduce_the_size_and_not_the_direction():
    slow = SliderLimits((0.2, 0.05, 0.2), LIMITS.acceleration, LIMITS.jerk)
    direction = np.array((0.6, 0.0, 0.8))
    run = TrackingRun((-0.1, 0.0, 0.2))
    run.run(lambda time: WantedVelocity(tuple(0.5 * direction)), 1.0, limits=slow)
    assert deviation(run.places, direction) < 1e-9
    rates = np.abs([state.velocities for state in run.states[-300:]])
    # One slider is at its limit, less what its own bend may need.
    used = (rates / np.array(slow.velocity)).max(axis=1)
    assert used.min() > 0.99
    assert used.max() <= 1.0 + 1e-9


@corners(
    "direction, speed", ((1.0, 0.0, 0.0), (-0.6, 0.64, 0.48), (0.3, -0.3, 0.9)), (0.1, 0.03, 0.3)
)
def test_the_edge_ahead_is_a_halt_on_the_line(direction, speed):
    run = TrackingRun(workspace=BOX)
    unit = np.array(direction) / np.linalg.norm(direction)
    wanted = WantedVelocity(tuple((speed * unit).tolist()))
    way = BOX.exit_distance(PLACE, unit, 1.0)
    places = run.run(lambda time: wanted, way / speed + 0.6)
    assert run.rests
    assert deviation(places, unit) < 1e-6
    assert 0.0 <= way - float((places[-1] - PLACE) @ unit) < 2.0 * EDGE_CLEARANCE
    # And back again.
    back = WantedVelocity(tuple((-speed * unit).tolist()))
    run.run(lambda time: back, 0.5)
    np.testing.assert_allclose(run.velocities[-1], back.velocity, atol=1e-9)


def test_slider_line_against_differences():
    position, velocity = np.array((0.05, -0.08, 0.25)), np.array((0.3, 0.2, -0.1))
    line = slider_line(MACHINE, tuple(position), tuple(velocity))
    h = 1e-3
    heights = [MACHINE.inverse(tuple(position + k * h * velocity)) for k in (-2, -1, 0, 1, 2)]
    a, b, c, d, e = np.array(heights)
    np.testing.assert_allclose(line.heights, c)
    np.testing.assert_allclose(line.rates, (a - 8 * b + 8 * d - e) / (12 * h), rtol=1e-8)
    np.testing.assert_allclose(
        line.accelerations, (-a + 16 * b - 30 * c + 16 * d - e) / (12 * h * h), rtol=1e-6
    )
    np.testing.assert_allclose(
        line.jerks, (-a + 2 * b - 2 * d + e) / (2 * h**3), rtol=1e-4, atol=1e-6
    )


@pytest.mark.parametrize("limit", ("velocity", "acceleration", "jerk", "none"))
def test_wish_keeps_each_limit_where_the_platform_passes(limit):
    rng = np.random.default_rng(3)
    ahead = WayAhead(WORKSPACE)
    values = {"velocity": 0.1, "acceleration": 0.05, "jerk": 0.3}
    limits = LIMITS if limit == "none" else replace(LIMITS, **{limit: (values[limit],) * 3})
    bound = 0
    for _ in range(100):
        place = rng.uniform((-0.08, -0.08, 0.2), (0.08, 0.08, 0.3))
        direction = rng.normal(size=3)
        velocity = direction / np.linalg.norm(direction) * 0.4
        wish = wanted_motion(MACHINE, ahead, tuple(place), tuple(velocity), limits)
        np.testing.assert_allclose(np.cross(wish.direction, velocity), 0.0, atol=1e-12)
        assert 0.0 < wish.speed <= 0.4 + 1e-12
        bound += int(wish.speed < 0.39)
        passing = slider_line(MACHINE, tuple(place), tuple(wish.speed * np.array(wish.direction)))
        assert (np.abs(passing.rates) <= np.array(limits.velocity) * (1.0 + 1e-12)).all()
        assert (np.abs(passing.accelerations) <= np.array(limits.acceleration)).all()
        assert (np.abs(passing.jerks) <= np.array(limits.jerk)).all()
    assert (bound > 50) is (limit != "none")


def test_slope_of_a_wish_is_how_the_speed_changes():
    slow = replace(LIMITS, velocity=(0.1, 1.0, 1.0))
    ahead, direction = WayAhead(WORKSPACE), np.array((1.0, 0.0, 0.0))
    place, h = np.array((0.05, 0.02, 0.3)), 1e-5
    before, here, after = (
        wanted_motion(MACHINE, ahead, tuple(place + k * h * direction), (2.0, 0.0, 0.0), slow)
        for k in (-1, 0, 1)
    )
    assert here.speed < 1.0
    slope = (after.speed - before.speed) / (2.0 * h) * here.speed
    assert here.slope == pytest.approx(slope, rel=1e-4)


def test_approach_is_a_motion_to_rest_with_the_acceleration_that_is_meant():
    distance, acceleration, jerk = 0.05, 4.0, 60.0
    speeds, slowdowns, h = [], [], 1e-4
    time = 0.0
    while distance > EDGE_CLEARANCE * 1.2:
        speed, slowdown = approach(distance, acceleration, jerk)
        speeds.append(speed)
        slowdowns.append(slowdown)
        distance -= h * speed + 0.5 * h * h * slowdown
        time += h
        assert time < 3.0
    assert max(np.abs(slowdowns)) <= acceleration
    np.testing.assert_allclose(np.diff(speeds) / h, slowdowns[1:], atol=0.02)
    assert max(np.abs(np.diff(slowdowns))) / h <= 2.0 * jerk
    assert approach(EDGE_CLEARANCE, acceleration, jerk) == (0.0, 0.0)
    assert approach(math.inf, acceleration, jerk).speed == math.inf
    needed = way_to_rest(0.5, acceleration, jerk)
    assert approach(needed + EDGE_CLEARANCE, acceleration, jerk).speed == pytest.approx(0.5)


def test_way_ahead_is_the_exit_distance_wherever_one_stands():
    rng = np.random.default_rng(4)
    ahead = WayAhead(BOX)
    seen = 0
    for _ in range(30):
        place = rng.uniform((-0.08, -0.1, 0.1), (0.08, 0.08, 0.35))
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        for step in range(20):
            here = place + 1e-4 * step * direction
            found = ahead.distance(tuple(here), tuple(direction), 0.06)
            right = BOX.exit_distance(here, direction, 1.0)
            if right > 0.06:
                assert found == math.inf
            else:
                assert found == pytest.approx(right, abs=2e-5)
                seen += 1
    assert 25 < seen < 550
