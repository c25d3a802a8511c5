import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from motion_plans import (
    HOME,
    LIMITS,
    assert_states_are_samples,
    dense,
    heights,
    motion_of_ruckig,
    moving_plan,
)
from strategies import reproducible

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.errors import PlanningError, SliderLimitError
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import SliderMotion, own_stop
from tri_glide_kinematics.motion.trajectory import (
    CubicPlan,
    RuckigPlanner,
    SequencePlan,
    ruckig_planner,
)


def assert_same(state: SliderState, other: SliderState, tolerance: float) -> None:
    for values, expected in zip(state, other):
        assert np.allclose(values, expected, rtol=0.0, atol=tolerance)


@reproducible
@given(heights(), heights(), st.floats(0.0, 1.0))
def test_plan_in_motion_is_the_trajectory_of_ruckig(first, second, part):
    motion = SliderMotion()
    start = at_once(motion.move(HOME, first, LIMITS)).at(0.4 * part)
    # What ruckig refuses is slower than anything that moves.
    assume(max(map(abs, start.velocities)) > 1e-12)
    plan = at_once(motion.move(start, second, LIMITS))
    trajectory = motion_of_ruckig(start, second, LIMITS)
    assert plan.duration == pytest.approx(trajectory.duration, abs=1e-10)
    for time in np.linspace(0.0, 0.999 * plan.duration, 15).tolist():
        expected = SliderState(*(tuple(row) for row in trajectory.at_time(time)))
        assert_same(plan.at(time), expected, 1e-9)


@reproducible
@given(heights(), heights(), st.floats(0.0, 0.95))
def test_sample_is_state_and_derivatives_fit(first, second, part):
    plan = moving_plan(first, second, part)
    sampled = dense(plan, 2001)
    assert_states_are_samples(plan, sampled.times[::100], (1e-12, 1e-12, 1e-12))
    if plan.duration > 0.01:
        step = sampled.times[1]
        mean = 0.5 * (sampled.velocities[1:] + sampled.velocities[:-1])
        rates = np.diff(sampled.heights, axis=0) / step
        assert np.abs(rates - mean).max() <= 400.0 * step * step
        mean = 0.5 * (sampled.accelerations[1:] + sampled.accelerations[:-1])
        rates = np.diff(sampled.velocities, axis=0) / step
        assert np.abs(rates - mean).max() <= 400.0 * step


def test_plan_rests_after_its_end_where_it_was_led():
    plan = moving_plan((0.7, 0.4, 0.6), (0.35, 0.8, 0.55), 0.5)
    for time in (plan.duration, plan.duration + 1e-9, 1e9):
        state = plan.at(time)
        assert state.velocities == state.accelerations == AT_REST
        assert np.allclose(state.heights, (0.35, 0.8, 0.55), rtol=0.0, atol=2e-8)
    sampled = plan.sample(np.array([plan.duration, 1e9]))
    assert np.array_equal(sampled.heights, [plan.at(1e9).heights] * 2)


def test_end_is_no_step():
    """Ruckig misses this target in mid-motion by 1e-8 m; to snap to it would be a jerk."""
    state = SliderState(
        (0.5, 0.5, 0.5),
        (0.02625128496680294, -0.1760679873281716, 0.5557534701287135),
        (7.891207693933964, -8.872119722708497, 8.722133179282629),
    )
    target = (0.4811138063811846, 0.471937172377226, 0.4481806230797481)
    plan = at_once(SliderMotion().move(state, target, SliderLimits.uniform(1.0, 10.0, 200.0)))
    heights = plan.sample(plan.duration + 0.001 * np.arange(-5.0, 5.0)).heights
    assert np.abs(np.diff(heights, 3, axis=0)).max() / 1e-9 <= 200.0 * (1.0 + 1e-4)
    assert np.abs(heights[-1] - target).max() > 9e-9
    heights[5:] = target
    assert np.abs(np.diff(heights, 3, axis=0))[2:].max() / 1e-9 > 10.0


def test_rest_is_a_plan_of_no_duration():
    plan = CubicPlan(HOME, ((), (), ()))
    assert plan.duration == 0.0
    assert plan.at(0.0) == plan.at(5.0) == HOME
    assert np.array_equal(plan.sample(np.arange(3.0)).heights, [HOME.heights] * 3)
    lowest, highest = plan.height_extremes()
    assert tuple(lowest) == tuple(highest) == HOME.heights
    plan.check_limits(LIMITS)


def test_sequence_runs_one_plan_after_the_other():
    motion = SliderMotion()
    one = at_once(motion.move(HOME, (0.7, 0.4, 0.6), LIMITS))
    two = at_once(motion.move(one.at(one.duration), (0.35, 0.8, 0.55), LIMITS))
    both = SequencePlan((one, two))
    assert both.duration == one.duration + two.duration
    later = SequencePlan((SequencePlan((both,), 0.1),), 0.05)
    assert later.duration == pytest.approx(both.duration - 0.15)
    times = np.linspace(0.0, both.duration + 0.1, 777)
    for plan, skipped in ((both, 0.0), (later, 0.15)):
        sampled = plan.sample(times)
        for row, time in enumerate(times.tolist()):
            first = time + skipped < one.duration
            expected = (one if first else two).at(time + skipped - (0.0 if first else one.duration))
            assert_same(plan.at(time), expected, 1e-12)
            assert np.allclose(sampled.heights[row], expected.heights, rtol=0.0, atol=1e-12)
    past = SequencePlan((both,), one.duration + 0.01)
    assert past.parts(0.0) == [(two, pytest.approx(0.01))]
    assert past.duration == pytest.approx(two.duration - 0.01)
    assert past.parts(10.0) == []


def test_round_numbers_that_ruckig_fails_on_are_planned(monkeypatch):
    """0.05 m from rest is where two kinds of profile meet for these limits."""
    limits = SliderLimits.uniform(1.0, 10.0, 200.0)
    target = (0.65, 0.6, 0.45)
    plan = at_once(SliderMotion().move(HOME, target, limits))
    assert plan.duration == pytest.approx(0.2, abs=1e-6)
    monkeypatch.setattr(ruckig_planner, "JERK_FACTORS", (1.0,))
    with pytest.raises(PlanningError, match="step 1"):
        at_once(SliderMotion().move(HOME, target, limits))


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
@pytest.mark.parametrize("phase", [0, 1])
def test_a_motion_of_numbers_that_are_none_keeps_no_limit(number, phase):
    phases = [(0.1, 0.0), (0.1, 0.0)]
    phases[phase] = (0.1, number)
    plan = CubicPlan(HOME, [[], phases, []])
    with pytest.raises(SliderLimitError):
        plan.check_sliders(LIMITS)


def test_impossible_input_of_ruckig_is_a_planning_error():
    planner = RuckigPlanner(1)
    with pytest.raises(PlanningError):
        planner.to_rest_at([float("nan")], [0.0], [0.0], [0.0], ([1.0], [1.0], [1.0]))


def test_brake_never_goes_faster_nor_farther_than_needed():
    held = at_once(SliderMotion().move(HOME, (0.9, 0.4, 0.55), LIMITS))
    for time in np.linspace(0.0, held.duration, 40).tolist():
        state = held.at(time)
        plan = CubicPlan(state, own_stop(state, LIMITS).ways)
        assert plan.duration <= held.duration - time + 1e-9
        lowest, highest = plan.height_extremes()
        held_lowest, held_highest = held.height_extremes(time)
        assert (lowest >= held_lowest - 1e-9).all()
        assert (highest <= held_highest + 1e-9).all()
