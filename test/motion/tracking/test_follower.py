"""The promise: after each step there is a way to rest on which all limits hold."""

import math
from dataclasses import replace

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE, WORKSPACES
from motion_plans import LIMITS as UNEQUAL
from motion_plans import peaks
from soak import corners
from tracking_run import PERIODS, PLACE, TrackingRun, at_rest

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limits import (
    AT_REST,
    RELATIVE_ROUNDING,
    TRAVEL_ROUNDING,
    SliderLimits,
    SliderState,
)
from tri_glide_kinematics.motion.tracking import Follower, MovingTarget, WantedVelocity
from tri_glide_kinematics.motion.trajectory import SAME_TIME
from tri_glide_kinematics.workspace import TOLERANCE

SLOW = SliderLimits.uniform(0.3, 4.0, 60.0)
PLACES = {
    "plain": WORKSPACE,
    **{name: WORKSPACES[name] for name in ("conditioning", "box", "cylinder")},
}
ONE = 1.0 + RELATIVE_ROUNDING
STOP = WantedVelocity((0.0, 0.0, 0.0))


def is_inside(workspace, heights) -> bool:
    """Whether the place, or one so near to it as the tolerance of paths allows, is inside."""
    try:
        workspace.check_heights(heights)
    except KinematicsError:
        place = np.array(workspace.machine.forward(heights))
        inwards = np.array(PLACE) - place
        near = place + TOLERANCE * 2.0 * inwards / np.linalg.norm(inwards)
        try:
            workspace.check_position(near.tolist())
        except KinematicsError:
            return False
    return True


def check_promise(step, state, limits, period, workspace):
    """Check all of a step and of the braking behind it, by other means than those of the code."""
    plan = step.as_cubic()
    assert (peaks(plan) <= ONE * limits.table).all()
    lowest, highest = plan.height_extremes()
    assert (lowest >= np.array(workspace.limits.lower_heights) - TRAVEL_ROUNDING).all()
    assert (highest <= np.array(workspace.limits.upper_heights) + TRAVEL_ROUNDING).all()
    # It begins where the sliders are, passes the state after the step, and ends at rest.
    # A phase that is shorter than ``SAME_TIME`` is not told from its neighbour.
    for time, expected in ((0.0, state), (period, step.after)):
        roundings = 1e-15, 1e-13, 4.0 * SAME_TIME * max(limits.jerk)
        for values, wanted, rounding in zip(plan.at(time), expected, roundings):
            np.testing.assert_allclose(values, wanted, rtol=0.0, atol=rounding)
    assert plan.duration == pytest.approx(step.duration, abs=1e-9)
    before_end = plan.at(plan.duration - 1e-9)
    assert max(map(abs, before_end.velocities)) < 1e-9
    assert max(map(abs, before_end.accelerations)) < 2e-9 * max(limits.jerk)
    for heights in plan.sample(np.linspace(0.0, plan.duration, 60)).heights.tolist():
        assert is_inside(workspace, heights)


class RandomWishes:
    """Velocities and targets at random that change at random times."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._wanted = WantedVelocity((0.0, 0.0, 0.0))

    def next(self, period: float) -> WantedVelocity | MovingTarget:
        if isinstance(self._wanted, MovingTarget):
            self._wanted = self._wanted.after(period)
        if self._rng.random() > 0.03:
            return self._wanted
        rng = self._rng
        vector = rng.normal(size=3) * 10.0 ** rng.uniform(-3.0, 0.5)
        if rng.random() < 0.1:
            vector = np.zeros(3)
        if rng.random() < 0.5:
            self._wanted = WantedVelocity(tuple(vector.tolist()))
        else:
            # Anywhere: inside, outside, and where there is no pose at all.
            place = rng.uniform((-0.25, -0.25, 0.0), (0.25, 0.25, 0.6))
            self._wanted = MovingTarget(tuple(place.tolist()), tuple(vector.tolist()))
        return self._wanted


@corners("name, period", PLACES, PERIODS)
def test_whatever_is_wanted_each_step_leaves_a_way_to_rest(name, period):
    workspace = PLACES[name]
    rng = np.random.default_rng(round(1e4 * period))
    wishes = RandomWishes(rng)
    run = TrackingRun(workspace=workspace)
    limits, taken = UNEQUAL, 0
    for cycle in range(300):
        before = run.state
        if cycle % 60 == 59:
            limits = (UNEQUAL, LIMITS, SLOW)[rng.integers(3)]
        if run.step(wishes.next(period), limits, period):
            taken += 1
            # All of them would take minutes.
            if taken % 7 == 0:
                check_promise(run.held, before, limits, period, workspace)
        assert np.isfinite(np.array(run.state)).all()
    assert taken > 60
    assert 0 < run.refused


@pytest.mark.parametrize(
    "wanted", (WantedVelocity((0.2, 0.1, 0.0)), MovingTarget((0.1, 0.0, 0.3), (0.0, 0.0, 0.0)))
)
def test_limits_that_the_state_cannot_keep_are_refused(wanted):
    run = TrackingRun()
    for _ in range(40):
        assert run.step(wanted)
    limits = LIMITS.table
    state = np.array(run.state)
    for order, name in enumerate(("velocity", "acceleration")):
        fastest = np.abs(state[order + 1]).max()
        too_low = replace(LIMITS, **{name: (0.9 * fastest,) * 3})
        assert run.follower.step(run.state, wanted, too_low, 0.002) is None
        assert limits[order].min() > fastest


@pytest.mark.parametrize(
    "wanted", (STOP, WantedVelocity((0.1, 0.0, 0.0)), MovingTarget(PLACE, AT_REST))
)
def test_a_velocity_that_will_be_passed_is_foreseen(wanted):
    """An acceleration has to be taken back: until then the velocity goes on."""
    heights = MACHINE.inverse(PLACE)
    for velocity, acceleration, name, enough, too_low in (
        (0.9, 5.0, "jerk", 200.0, 100.0),
        # Against the motion, too: it is passed on the other side.
        (-0.1, 10.0, "velocity", 0.16, 0.14),
    ):
        state = SliderState(heights, (0.0, velocity, 0.0), (0.0, acceleration, 0.0))
        for value, possible in ((enough, True), (too_low, False)):
            values = list(getattr(LIMITS, name))
            values[1] = value
            limits = replace(LIMITS, **{name: tuple(values)})
            step = Follower(WORKSPACE).step(state, wanted, limits, 0.002)
            assert (step is not None) is possible
    assert (
        Follower(WORKSPACE).step(
            SliderState(heights, (math.nan, 0.0, 0.0), AT_REST), wanted, LIMITS, 0.002
        )
        is None
    )


@pytest.mark.parametrize("bad", (math.nan, math.inf, -math.inf, 1e300))
def test_what_is_no_number_is_refused(bad):
    run = TrackingRun()
    for wanted in (
        WantedVelocity((bad, 0.0, 0.0)),
        MovingTarget((0.0, bad, 0.3), (0.0, 0.0, 0.0)),
        MovingTarget((0.0, 0.0, 0.3), (0.0, 0.0, bad)),
        MovingTarget((0.0, 0.0, 0.3), (0.0, 0.0, 0.0), (bad, 0.0, 0.0)),
    ):
        step = run.follower.step(run.state, wanted, LIMITS, 0.002)
        # A velocity without bounds is one that the limits reduce.
        assert step is None or np.isfinite(np.array(step.after)).all()


def test_a_step_is_a_plan_and_at_rest_exactly():
    run = TrackingRun()
    run.step(WantedVelocity((0.1, 0.0, 0.0)))
    step = run.held
    assert step.at(0.002) is step.after
    assert step.at(0.0) is run.states[0]
    assert step.duration > 0.002
    assert not step.ends_at_rest
    assert step.as_cubic() is step.as_cubic()
    sampled = step.sample(np.array([0.0, 0.001, step.duration, 9.0]))
    assert not sampled.velocities[-2:].any()
    still = Follower(WORKSPACE).step(at_rest(), WantedVelocity((0.0, 0.0, 0.0)), LIMITS, 0.002)
    assert still.ends_at_rest
    assert still.after == at_rest()
