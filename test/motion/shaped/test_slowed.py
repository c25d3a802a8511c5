"""A plan that is slowed down on its own way to rest."""

import numpy as np
import pytest
from motion_machine import KINDS, LIMITS, MACHINE, TARGET, WORKSPACE

from tri_glide_kinematics.motion import MotionKind, SliderLimits, plan_move
from tri_glide_kinematics.motion.shaped.slowed import SlowedPlan

BEGIN, DURATION = 0.2, 0.12


@pytest.fixture(params=KINDS, ids=str)
def slowed(request) -> tuple:
    kind: MotionKind = request.param
    start = MACHINE.forward((0.6, 0.6, 0.6))
    plan = plan_move(WORKSPACE, LIMITS, start, TARGET, kind=kind)
    return plan, SlowedPlan(MACHINE, plan, BEGIN, DURATION)


def test_it_goes_the_same_way_never_faster_and_rests(slowed):
    plan, slow = slowed
    begin, end = plan.at(BEGIN), slow.at(DURATION)
    assert slow.at(0.0) == begin
    assert end.velocities == end.accelerations == (0.0, 0.0, 0.0)
    assert end.heights == plan.at(BEGIN + 0.5 * DURATION).heights
    times = np.linspace(0.0, DURATION, 400)
    # By the midpoint rule, the time in the other plan is the integral of the rate.
    u = (np.arange(100_000) + 0.5) / 100_000
    passed = np.cumsum(1.0 - 3.0 * u**2 + 2.0 * u**3) * DURATION / 100_000
    there = np.interp(times / DURATION, np.append(0.0, u + 0.5e-5), np.append(0.0, passed)) + BEGIN
    assert slow.sample(times).heights == pytest.approx(plan.sample(there).heights, abs=1e-8)


def test_its_setpoints_and_its_series_are_derivatives_of_its_heights(slowed):
    _, slow = slowed
    knots = slow.knots()
    middles = 0.5 * (knots[:-1] + knots[1:])
    step = 1e-5
    ahead, here, behind = (slow.sample(middles + shift).heights for shift in (step, 0.0, -step))
    seen = slow.sample(middles)
    assert seen.velocities == pytest.approx((ahead - behind) / (2.0 * step), abs=1e-6)
    assert seen.accelerations == pytest.approx((ahead - 2.0 * here + behind) / step**2, abs=2e-4)
    half = np.minimum(0.4 * np.diff(knots), 0.002)
    series = slow.platform_series(MACHINE, middles, half)
    for part in (-1.0, 1.0):
        powers = (part * half) ** np.arange(6.0)[:, np.newaxis]
        places = MACHINE.forward_batch(slow.sample(middles + part * half).heights).T
        values = series.values * powers[:, np.newaxis]
        beyond = np.abs(places - values[:5].sum(axis=0))
        assert (beyond <= series.bounds[5] * np.abs(powers[5]) + 1e-12).all()


def test_its_limits_are_judged_by_what_differences_show(slowed):
    _, slow = slowed
    times = np.linspace(0.0, DURATION, 12_001)
    accelerations = slow.sample(times).accelerations
    largest = np.abs(accelerations).max()
    jerk = np.abs(np.diff(accelerations, axis=0)).max() / (times[1] - times[0])
    assert slow.keeps_limits(SliderLimits.uniform(1.0, 1.01 * largest, 1.01 * jerk))
    assert not slow.keeps_limits(SliderLimits.uniform(1.0, 0.999 * largest, 1.01 * jerk))
    assert not slow.keeps_limits(SliderLimits.uniform(1.0, 1.01 * largest, 0.99 * jerk))
