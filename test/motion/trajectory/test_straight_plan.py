"""Slider moves from rest: straight in slider space, and no slower than that takes."""

import math

import numpy as np
import pytest
from motion_machine import skip_if_too_long_for_ruckig
from motion_plans import LIMITS as UNEQUAL
from motion_plans import assert_states_are_samples, motion_of_ruckig
from ruckig import Synchronization
from soak import many

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.limits import AT_REST, QUANTITIES, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import SliderMotion
from tri_glide_kinematics.motion.trajectory import StraightPlan

HOME = (0.6, 0.55, 0.5)

# Heights are below 1 m; a height, and its distance from a line, is a few operations on them.
ROUNDING = 2e-15


def from_rest(start, target, limits: SliderLimits = UNEQUAL) -> StraightPlan:
    plan = at_once(SliderMotion().move(SliderState(start, AT_REST, AT_REST), target, limits))
    assert isinstance(plan, StraightPlan)
    return plan


def random_moves(count: int):
    """Yield start, target and unequal limits."""
    generator = np.random.default_rng(2)

    def three(lower: float, upper: float):
        return tuple(generator.uniform(lower, upper, 3).tolist())

    for _ in range(count):
        limits = SliderLimits(three(0.2, 2.0), three(2.0, 20.0), three(50.0, 500.0))
        yield three(0.3, 0.9), three(0.3, 0.9), limits


def least_duration(start, target, limits: SliderLimits) -> float:
    """Return the least time from rest to rest on the straight line in slider space.

    Of the fraction of the way: a jerk phase lasts until acceleration, velocity or half of the way
    is reached, constant acceleration then until velocity or half of the way is.
    """
    ways = [abs(end - begin) for begin, end in zip(start, target)]
    velocity, acceleration, jerk = (
        min(bound / way for bound, way in zip(getattr(limits, quantity), ways) if way > 0.0)
        for quantity, _ in QUANTITIES
    )
    rise = min(acceleration / jerk, math.sqrt(velocity / jerk), (0.5 / jerk) ** (1.0 / 3.0))
    by_way = 0.5 * (math.sqrt(rise * rise + 4.0 / (jerk * rise)) - 3.0 * rise)
    steady = max(min(by_way, velocity / (jerk * rise) - rise), 0.0)
    cruise = max(1.0 / (jerk * rise * (rise + steady)) - (2.0 * rise + steady), 0.0)
    return 4.0 * rise + 2.0 * steady + cruise


def distance_from_line(heights, start, target) -> float:
    way = np.subtract(target, start)
    offsets = np.subtract(heights, start)
    along = offsets @ way / (way @ way)
    return float(np.abs(offsets - along[:, np.newaxis] * way).max())


def ruckig_by_phases(start, target, limits: SliderLimits) -> tuple[float, float]:
    """Return the duration of ruckig's own motion, and its distance from the line."""
    state = SliderState(start, AT_REST, AT_REST)
    trajectory = motion_of_ruckig(state, target, limits, Synchronization.Phase)
    times = np.linspace(0.0, trajectory.duration, 13)
    heights = [trajectory.at_time(time)[0] for time in times.tolist()]
    return trajectory.duration, distance_from_line(heights, start, target)


@pytest.mark.slow
def test_moves_with_unequal_limits_are_straight_inside_them_and_as_fast_as_can_be():
    kept = 0
    for start, target, limits in random_moves(many(500)):
        plan = from_rest(start, target, limits)
        # Between the ends of pieces the quantities that are limited have no extremes.
        times = np.concatenate((plan.starts, [plan.duration], np.linspace(0.0, plan.duration, 13)))
        states = np.array([plan.at(time) for time in times.tolist()])
        for sampled in (states.transpose(1, 0, 2), plan.sample(times)[1:]):
            heights, velocities, accelerations = sampled
            assert distance_from_line(heights, start, target) <= ROUNDING
            assert (np.abs(velocities).max(axis=0) <= np.multiply(limits.velocity, 1 + 1e-14)).all()
            peaks = np.abs(accelerations).max(axis=0)
            assert (peaks <= np.multiply(limits.acceleration, 1 + 1e-14)).all()
        jerks = np.abs(plan.pieces[3]).max(axis=0)
        assert (jerks <= np.multiply(limits.jerk, 1 + 1e-14)).all()
        assert plan.duration == pytest.approx(least_duration(start, target, limits), rel=1e-8)
        theirs, distance = ruckig_by_phases(start, target, limits)
        if distance < 1e-9:
            kept += 1
            assert plan.duration <= theirs * (1.0 + 1e-12)
        for time in (plan.duration, math.nextafter(plan.duration, 0.0)):
            assert plan.at(time).heights == pytest.approx(target, rel=0.0, abs=ROUNDING)
        end = plan.at(plan.duration)
        assert end.velocities == end.accelerations == AT_REST
    # Ruckig itself keeps to the line in some of these moves, and leaves it in others.
    assert 0 < kept < many(500)


def test_states_are_samples_whatever_the_order():
    generator = np.random.default_rng(3)
    for start, target, limits in random_moves(50):
        plan = from_rest(start, target, limits)
        times = generator.uniform(0.0, 1.1 * plan.duration, 200)
        times = np.concatenate((times, plan.starts, plan.starts[::-1], [plan.duration]))
        assert_states_are_samples(plan, times, (1e-14, 2e-14, 2e-13))


def test_places_over_the_way_are_those_over_time():
    for start, target, limits in random_moves(50):
        plan = from_rest(start, target, limits)
        assert plan.length == pytest.approx(max(abs(b - a) for a, b in zip(start, target)))
        leading = int(np.argmax(np.abs(np.subtract(target, start))))
        for time in np.linspace(0.0, plan.duration, 20).tolist():
            state = plan.at(time)
            distance = abs(state.heights[leading] - start[leading])
            place = plan.at_way(distance)
            assert place.heights == pytest.approx(state.heights, rel=0.0, abs=ROUNDING)
            speed = abs(state.velocities[leading])
            expected = np.multiply(place.velocities, speed)
            assert state.velocities == pytest.approx(expected.tolist(), rel=1e-12, abs=1e-15)
            assert place.accelerations == AT_REST


def test_what_is_left_of_a_plan_goes_on_from_its_state():
    plan = from_rest(HOME, (0.9, 0.45, 0.55))
    for part in (0.1, 0.5, 0.9):
        since = part * plan.duration
        lengths, pieces = plan.pieces_since(since)
        assert lengths.sum() == pytest.approx(plan.duration - since, rel=1e-14)
        assert np.array_equal(pieces[:3, 0], plan.at(since))
        lowest, highest = plan.height_extremes(since)
        ends = (plan.at(since).heights, plan.at(plan.duration).heights)
        assert lowest == pytest.approx(np.min(ends, axis=0), abs=ROUNDING)
        assert highest == pytest.approx(np.max(ends, axis=0), abs=ROUNDING)


@pytest.mark.parametrize("way", [1e6, 1e3, 1.0, 1e-3, 1e-6, 1e-9, 1e-12, 3e-14])
@pytest.mark.parametrize("ratios", [(1.0, -1.0 / 3.0, 0.0), (0.0, 1e-7, -1.0), (0.0, 1.0, 1e-300)])
def test_tiny_and_huge_ways_and_sliders_that_stay(way, ratios):
    skip_if_too_long_for_ruckig(way / max(UNEQUAL.velocity))
    target = tuple(way * ratio for ratio in ratios)
    plan = from_rest(AT_REST, target)
    assert plan.duration == pytest.approx(least_duration(AT_REST, target, UNEQUAL), rel=1e-8)
    times = np.linspace(0.0, plan.duration, 50)
    states = np.array([plan.at(time) for time in times.tolist()])
    assert states[-1, 0] == pytest.approx(target, rel=1e-15)
    assert (states[-1, 1:] == 0.0).all()
    for values, expected in zip(states.transpose(1, 0, 2), plan.sample(times)[1:]):
        assert values == pytest.approx(expected, rel=1e-12, abs=1e-14 * np.abs(expected).max())
        assert (values[:, np.equal(target, 0.0)] == 0.0).all()


@pytest.mark.parametrize("way", [0.0, 5e-324, 1e-16, 1e-14])
def test_where_the_sliders_are_there_is_no_way_to_go(way):
    """Ruckig takes less than 1e-14 m for no way at all."""
    state = SliderState((0.0, 0.55, 0.5), AT_REST, AT_REST)
    plan = at_once(SliderMotion().move(state, (way, 0.55, 0.5), UNEQUAL))
    assert plan.duration == 0.0
    for time in (0.0, 1e-3, 1e9):
        assert plan.at(time) == state
    assert np.array_equal(plan.sample(np.arange(3.0)).heights, [state.heights] * 3)
