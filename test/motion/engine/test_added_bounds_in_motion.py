"""A speed limit of the platform and force limits, in whatever the engine does."""

from __future__ import annotations

import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    HOME,
    LIMITS,
    MACHINE,
    SHAPER,
    WORKSPACE,
    RecordedEngine,
    each_kind,
    each_mode,
    engine,
    run,
    run_to_rest,
    speeds,
)
from soak import many, seed

from benchmarks.judge import SCENARIOS
from benchmarks.soak_bounds import TOLERANCE, soaked
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.motion import (
    CannotHoldError,
    ForceLimits,
    MotionKind,
    MotionPhase,
    PlatformPath,
    PlatformSpeedLimit,
    SliderLimits,
)

SLOW = PlatformSpeedLimit(MACHINE, 0.1)
MASSES = Masses.uniform(1.0, 0.1, 1.0)


def forces(payload: float = 0.0, up: float = 26.0, down: float = 26.0) -> ForceLimits:
    machine = SliderForces(MACHINE, MASSES.with_payload(payload))
    return ForceLimits(machine, (up,) * 3, (down,) * 3)


def test_force_limits_that_cannot_hold_the_weight_are_refused_where_the_platform_rests():
    weak, text = LIMITS.with_added(forces(up=14.0)), r"force_limit_up\[\d\] = 14 N cannot hold"
    fresh = RecordedEngine(WORKSPACE, weak)
    with pytest.raises(CannotHoldError, match=text):
        fresh.start(HOME)
    assert not fresh.started
    fresh.set_limits(LIMITS.with_added(forces()))
    fresh.start(HOME)
    with pytest.raises(CannotHoldError, match=text):
        fresh.set_limits(weak)
    # In motion they are in force from the next rest on.
    fresh.move_to((0.02, 0.0, 0.3))
    fresh.step(DT)
    fresh.set_limits(weak)
    run_to_rest(fresh)


def largest_force(moving: RecordedEngine, bound: ForceLimits, seconds: float = math.inf) -> float:
    """Step an engine to rest, or for some time; return the largest force it asks for [N]."""
    largest = 0.0
    for _ in range(round(min(seconds, 60.0) / DT)):
        if moving.phase is MotionPhase.IDLE:
            break
        largest = max(largest, *map(abs, bound.forces.forces(*moving.step(DT))))
    return largest


@pytest.mark.slow
@pytest.mark.parametrize("scenario", [SCENARIOS[1], SCENARIOS[6]], ids=str)
def test_no_sequence_of_commands_breaks_an_added_bound(scenario):
    use, phases = soaked(scenario, seed(36), many(600))
    assert max(use) <= 1.0 + TOLERANCE
    assert use.speed > 0.99
    assert use.force > 0.4
    assert phases["idle"] < many(360)


@pytest.mark.slow
def test_no_path_is_refused_for_the_forces_that_a_shaper_adds():
    bound = ForceLimits(
        SliderForces(MACHINE, Masses.uniform(1.0, 0.2, 1.0)), (45.0,) * 3, (20.0,) * 3
    )
    rng = np.random.default_rng(7)
    for _ in range(2):
        limits = SliderLimits.uniform(1.5, 30.0, 2000.0).with_added(bound)
        moving = engine(limits=limits, shaper=SHAPER)
        start = MACHINE.forward(moving.state.heights)
        places = (0.0, 0.0, 0.25) + rng.uniform(-1.0, 1.0, (4, 3)) * (0.08, 0.08, 0.06)
        moving.follow(PlatformPath.through([start, *places], 2e-3))
        asked = []
        while moving.phase is not MotionPhase.IDLE:
            asked.append(bound.forces.forces(*moving.step(DT)))
        assert moving.take_refusal() is None
        assert MACHINE.forward(moving.state.heights) == pytest.approx(places[-1], abs=1e-7)
        use = max(np.max(asked) / 45.0, -np.min(asked) / 20.0)
        assert 0.9 < use <= 1.0 + 1e-6


@each_kind
def test_a_lower_speed_of_the_platform_waits_until_the_motion_keeps_it(kind):
    moving = engine(kind)
    moving.move_to((0.12, -0.05, 0.45))
    before = run(moving, 0.15)
    assert speeds(before)[-1] > 0.3
    moving.set_limits(LIMITS.with_added(SLOW))
    assert moving.limits_pending
    steps = 0
    while moving.limits_pending:
        moving.step(DT)
        steps += 1
    assert steps < 150
    assert moving.limits.added == (SLOW,)
    assert moving.phase is MotionPhase.MOVING
    heights = run_to_rest(moving)
    assert speeds(heights).max() <= 0.1 * (1.0 + 1e-6)
    assert speeds(heights).max() > 0.08
    assert MACHINE.forward(moving.state.heights) == pytest.approx((0.12, -0.05, 0.45), abs=1e-7)


def test_jogs_and_targets_are_as_fast_as_the_platform_may_be():
    moving = engine(limits=LIMITS.with_added(SLOW))
    moving.jog((0.3, 0.0, 0.0))
    run(moving, 0.2)
    moving.jog((0.0, 0.3, 0.0))
    turned = speeds(run(moving, 0.4))
    assert 0.09 < turned[-50:].min() and turned.max() <= 0.1 * (1.0 + 1e-6)
    moving.stop()
    run_to_rest(moving)
    x, y, z = MACHINE.forward(moving.state.heights)
    for step in range(100):
        moving.track((x - 0.05 + 0.0005 * step, y, z), (0.05, 0.0, 0.0))
        assert speeds(run(moving, 0.01)).max() <= 0.1 * (1.0 + 1e-6)
    assert moving.tracking_distance < 1e-3


@each_mode
def test_a_stop_at_the_largest_speed_of_the_platform_is_obeyed_at_once(in_pieces):
    """The bounds of each braking were a little above the limit: so it went on for 9.5 s."""
    limits = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.001))
    begin = MACHINE.inverse((-0.06, 0.04, 0.28))
    moving = engine(MotionKind.LINEAR, limits, heights=begin, in_pieces=in_pieces)
    moving.move_to((0.06, -0.04, 0.3))
    for _ in range(50):
        moving.step(DT)
        moving.work(lambda: False)
    moving.stop()
    driven = speeds(run_to_rest(moving, 0.2, pieces=1))
    assert driven.max() <= 0.001 * (1.0 + 1e-6)
    # The braking begins in the next cycle: it was not steady motion that went on.
    assert driven[5] < driven[0] * (1.0 - 1e-4)


def test_a_path_is_driven_at_the_speed_of_the_platform():
    moving = engine(limits=LIMITS.with_added(SLOW))
    x, y, z = MACHINE.forward(moving.state.heights)
    path = PlatformPath.start((x, y, z)).line_to((x + 0.05, y, z), 0.005, 0.5)
    moving.follow(path.line_to((x + 0.05, y + 0.05, z), speed=0.05))
    driven = speeds(run_to_rest(moving))
    assert 0.0995 < driven.max() <= 0.1 * (1.0 + 1e-6)
    assert np.median(driven[-250:-100]) == pytest.approx(0.05, rel=2e-3)


def test_a_payload_in_mid_path_slows_the_rest_of_it():
    """With the payload the same forces move the platform less: it brakes within them first."""
    ample = LIMITS.times(3.0, 10.0, 10.0)
    moving = engine(limits=ample.with_added(forces()))
    x, y, z = MACHINE.forward(moving.state.heights)
    path = PlatformPath.start((x, y, z))
    for turn in range(1, 9):
        path = path.line_to((x + 0.04 * (turn % 2), y, z + 0.006 * turn), 0.003)
    moving.follow(path)
    assert largest_force(moving, forces(), 0.2) == pytest.approx(26.0, rel=0.02)
    loaded = forces(0.6)
    moving.set_limits(ample.with_added(loaded))
    largest_force(moving, loaded, 0.15)
    assert not moving.limits_pending
    assert moving.phase is MotionPhase.FOLLOWING
    assert 25.0 < largest_force(moving, loaded) <= 26.0 * (1.0 + 1e-6)
    assert MACHINE.forward(moving.state.heights) == pytest.approx(path.end, abs=1e-7)


@each_kind
def test_a_stop_keeps_the_forces(kind):
    bound = forces(up=20.0, down=10.0)
    moving = engine(kind, limits=LIMITS.times(1.0, 10.0, 10.0).with_added(bound))
    for place in ((0.1, 0.05, 0.35), (-0.08, 0.06, 0.25)):
        moving.move_to(place)
        assert largest_force(moving, bound, 0.08) <= 20.0 * (1.0 + 1e-6)
        before = moving.time_to_rest
        moving.stop()
        assert moving.time_to_rest < before
        assert largest_force(moving, bound) <= 20.0 * (1.0 + 1e-6)


@each_kind
def test_in_a_storm_of_limits_those_hold_that_are_in_force(kind):
    """Lower ones come into force when the motion keeps them: until then it is faster than they."""
    rng = np.random.default_rng(5)
    moving = engine(kind)
    most = beyond = 0.0
    before = moving.state.heights
    for cycle in range(200):
        if cycle % 30 == 0:
            moving.move_to(np.array((0.0, 0.0, 0.3)) + rng.uniform(-0.07, 0.07, 3))
        if cycle % 15 == 10:
            values = tuple((10.0 ** rng.uniform(-3.0, 0.0, 3)).tolist())
            newest = SliderLimits(values, LIMITS.acceleration, LIMITS.jerk)
            slow = PlatformSpeedLimit(MACHINE, 10.0 ** rng.uniform(-4.0, 0.0))
            moving.set_limits(newest.with_added(slow), 1.0)
        heights = moving.step(DT).heights
        velocities = np.abs(np.subtract(heights, before)) / DT
        most = max(most, (velocities / moving.limits.velocity).max())
        for bound in moving.limits.added:
            most = max(most, speeds(np.array([before, heights])).max() / bound.speed)
        if moving.limits_pending:
            beyond = max(beyond, (velocities / newest.velocity).max())
        before = heights
    assert 0.9 < most <= 1.0 + 1e-6
    assert beyond > 2.0
