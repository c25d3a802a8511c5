"""The bounds of a line plan hold between all samples, and are not much too large."""

import numpy as np
import pytest
from motion_machine import MACHINE, WORKSPACE
from soak import many

from benchmarks.soak import random_place
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.errors import PlanningError, SliderLimitError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.moves import LinearMotion, LineJoining, LineToPosition
from tri_glide_kinematics.motion.trajectory import (
    LinePlan,
    StraightLine,
    TimeScaling,
    derivative_bounds,
)
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY

LIMITS = SliderLimits((1.0, 0.8, 0.9), (10.0, 9.0, 8.0), (200.0, 250.0, 180.0))
JOINING = LineJoining(MACHINE)
SAMPLES = 100

# Of velocity, acceleration and jerk. The last is a difference over as little as 0.3 us here.
ROUNDING = (1e-7, 1e-7, 1e-5)


def plans(count: int, seed: int, blended: bool):
    """Yield line plans from rest, or such as begin in the middle of another one."""
    motion = LinearMotion(MACHINE)
    rng = np.random.default_rng(seed)
    while count:
        start, middle, end = (
            random_place(rng, WORKSPACE, (-0.2, -0.2, -0.1), (0.2, 0.2, 0.7)) for _ in range(3)
        )
        try:
            WORKSPACE.check_segment(start, middle)
            plan = motion.from_rest(StraightLine.between(DEFAULT_GEOMETRY, start, middle), LIMITS)
            if blended:
                state = plan.at(float(rng.random()) * plan.duration)
                builder = LineToPosition(WORKSPACE, end)
                plan = at_once(at_once(JOINING.blending(state, builder, LIMITS, 0.3)).plan())
        except KinematicsError:
            continue
        if blended and plan.blend is None:
            continue
        count -= 1
        yield plan


def jerks(plan: LinePlan, times):
    """Return the jerk between neighbouring ``times``, exact but for its change in between."""
    accelerations = plan.sample(times).accelerations
    return np.diff(accelerations, axis=0) / np.diff(times)[:, np.newaxis]


@pytest.mark.slow
@pytest.mark.parametrize("blended", [False, True])
def test_bounds_hold_between_the_knots_and_are_tight(blended):
    excesses = []
    for plan in plans(many(20), 3, blended):
        bounds = derivative_bounds(plan.line, plan.scaling, plan.blend)
        knots = plan.scaling.times
        for piece in range(len(knots) - 1):
            times = np.linspace(knots[piece], knots[piece + 1], SAMPLES)
            sampled = plan.sample(times[:-1])
            peaks = (
                np.abs(sampled.velocities).max(axis=0),
                np.abs(sampled.accelerations).max(axis=0),
                np.abs(jerks(plan, times[:-1])).max(axis=0),
            )
            for values, peak, rounding in zip(bounds, peaks, ROUNDING):
                assert (peak <= values[:, piece] * (1.0 + 1e-6) + rounding).all()
        sampled = plan.sample(np.linspace(0.0, plan.duration, 5001))
        excesses.append(
            (
                (bounds.velocity.max(axis=1) / np.abs(sampled.velocities).max(axis=0)).min(),
                (bounds.acceleration.max(axis=1) / np.abs(sampled.accelerations).max(axis=0)).min(),
            )
        )
    assert (np.median(excesses, axis=0) < (1.002, 1.01)).all()


def test_slower_by_the_slowdown_just_keeps_the_limits():
    for plan in plans(20, 4, blended=False):
        scaling = plan.scaling.slower(0.6)
        factor = float(derivative_bounds(plan.line, scaling).slowdown(LIMITS).max())
        assert factor > 1.0
        LinePlan(plan.line, scaling.slower(factor)).check_limits(LIMITS)
        with pytest.raises(SliderLimitError) as caught:
            LinePlan(plan.line, scaling.slower(factor * 0.999)).check_limits(LIMITS)
        assert 1.0 < caught.value.slowdown <= 1.0 / 0.999 + 1e-9


def test_nan_is_never_inside_the_limits():
    line = StraightLine.between(DEFAULT_GEOMETRY, (0.0, 0.0, 0.3), (0.1, 0.0, 0.3))
    scaling = TimeScaling(*np.array(([0.0, 1.0], [0.0, 0.1], [0.0, np.nan], [0.0, 0.0])))
    with pytest.raises((SliderLimitError, PlanningError)):
        LinePlan(line, scaling).check_limits(LIMITS)
