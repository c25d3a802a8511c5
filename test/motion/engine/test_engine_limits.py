"""Limits and scales of the motion engine that change on the way, and what waits for them."""

from __future__ import annotations

import numpy as np
import pytest
from motion_machine import (
    DT,
    HOME,
    LIMITS,
    MACHINE,
    OTHER,
    TARGET,
    RecordedEngine,
    assert_rests_at,
    each_kind,
    engine,
    peaks,
    place,
    platform_velocity,
    run,
    run_to_rest,
    under_way,
    within,
)

from tri_glide_kinematics import TriGlide, TriGlideGeometry, Workspace, WorkspaceLimits
from tri_glide_kinematics.motion import MotionEngine, MotionKind, MotionPhase, SliderLimits
from tri_glide_kinematics.workspace import OutsideWorkspaceError

FAR = (0.12, -0.05, 0.45)


def begun(kind: MotionKind = MotionKind.SLIDER, seconds: float = 0.15) -> RecordedEngine:
    """Return an engine that has been on its way to ``FAR`` for some time."""
    return under_way(FAR, seconds, kind)


@each_kind
@pytest.mark.parametrize("scale", [0.05, 0.3, 0.9])
def test_speed_scale_takes_hold_in_mid_motion_inside_all_limits(kind, scale):
    moving = begun(kind)
    moving.set_speed_scale(scale)
    while moving.limits_pending:
        run(moving, DT)
        assert len(moving.states) < 450
    assert peaks(run_to_rest(moving))[0] <= scale * (1.0 + 1e-6)
    assert moving.speed_scale == scale
    assert_rests_at(moving, FAR, near=1e-7)


@each_kind
def test_jog_is_scaled_and_goes_on_at_the_new_speed(kind):
    moving = engine(kind, speed_scale=0.5)
    moving.jog((0.1, 0.0, 0.0))
    run(moving, 0.3)
    assert platform_velocity(moving)[0] == pytest.approx(0.05, rel=1e-3)
    moving.set_speed_scale(1.0)
    run(moving, 0.3)
    assert platform_velocity(moving)[0] == pytest.approx(0.1, rel=1e-3)
    assert moving.phase is MotionPhase.JOGGING


@each_kind
def test_lower_limits_in_mid_motion_break_neither_the_old_nor_the_new(kind):
    lower = SliderLimits.uniform(0.3, 2.0, 30.0)
    for time in (0.02, 0.08, 0.15, 0.25):
        moving = begun(kind, time)
        moving.set_limits(lower)
        while moving.limits is not lower:
            run(moving, DT)
        assert within(run_to_rest(moving), lower)
        assert_rests_at(moving, FAR, near=1e-7)


@each_kind
def test_higher_limits_are_used_at_once(kind):
    slow = SliderLimits.uniform(0.1, 2.0, 30.0)
    moving = under_way(FAR, 0.3, kind, slow)
    before = moving.remaining
    moving.set_limits(LIMITS)
    assert moving.limits is LIMITS
    assert moving.remaining < 0.5 * before


@each_kind
def test_target_that_comes_while_limits_are_pending_is_reached(kind):
    moving = begun(kind)
    moving.set_limits(SliderLimits.uniform(0.05, 1.0, 20.0))
    assert moving.limits_pending
    run(moving, 0.01)
    moving.move_to(OTHER)
    assert moving.target == OTHER
    run_to_rest(moving)
    assert_rests_at(moving, OTHER, near=1e-7)
    assert moving.limits.velocity[0] == 0.05


@each_kind
@pytest.mark.parametrize("seconds", [0.24, 0.25, 0.26])
def test_a_target_that_waits_for_limits_is_not_taken_for_the_one_before(kind, seconds):
    """Near its end the motion to that one keeps the new limits."""
    moving = engine(kind, in_pieces=True)
    moving.move_to(TARGET)
    while moving.phase is MotionPhase.IDLE:
        moving.work(lambda: True)
    run(moving, seconds)
    moving.set_speed_scale(0.8)
    # Nothing is planned meanwhile.
    run(moving, 0.01, pieces=0)
    assert moving.limits_pending
    moving.move_to(OTHER)
    run_to_rest(moving)
    assert_rests_at(moving, OTHER)


@each_kind
def test_stop_while_limits_are_pending_stays_a_stop(kind):
    moving = begun(kind)
    moving.set_limits(SliderLimits.uniform(0.05, 1.0, 20.0))
    run(moving, 0.01)
    moving.stop()
    run_to_rest(moving)
    run(moving, 0.1)
    assert_rests_at(moving, place(moving))
    assert not moving.limits_pending
    assert np.abs(place(moving) - FAR).max() > 1e-3


def test_start_adopts_limits_that_were_pending():
    moving = begun()
    moving.set_speed_scale(0.1)
    assert moving.limits_pending
    moving.start(HOME)
    assert not moving.limits_pending
    assert moving.speed_scale == 0.1
    assert moving.phase is MotionPhase.IDLE


def test_refusal_of_a_command_that_had_to_wait_is_told_once():
    start = MACHINE.inverse((0.03, -0.02, 0.51))
    moving = under_way((0.02, -0.02, 0.5), 0.02, MotionKind.LINEAR, heights=start)
    moving.set_limits(SliderLimits.uniform(0.001, 1.0, 20.0))
    assert moving.limits_pending
    # Until the new limits are in force it is only noted; its way turns out to be blocked.
    moving.move_to((-0.2, -0.09, 0.5))
    assert moving.target == (-0.2, -0.09, 0.5)
    run_to_rest(moving)
    assert moving.kept_limits
    assert isinstance(moving.take_refusal(), OutsideWorkspaceError)
    assert moving.take_refusal() is None
    assert moving.target is None


@each_kind
@pytest.mark.parametrize("pause", [0.0, 0.003, 0.05, 0.15, 0.2, 0.25, 0.5])
def test_limits_that_are_restored_while_braking_lead_on_to_the_target(kind, pause):
    """Whenever they come back: idle means that the target was reached, and stays the truth."""
    moving = begun(kind, 0.1)
    moving.set_speed_scale(0.001)
    run(moving, pause)
    moving.set_speed_scale(1.0)
    assert moving.phase is MotionPhase.MOVING
    run_to_rest(moving)
    resting = run(moving, 0.1)
    assert (resting == resting[0]).all()
    assert_rests_at(moving, FAR)


@each_kind
def test_floods_while_limits_are_pending_are_not_planned(kind):
    moving = begun(kind)
    moving.set_speed_scale(0.001)
    number = moving.plan_number
    for index in range(200):
        moving.move_to((0.1, 0.05, 0.35 + 1e-5 * index))
    assert moving.limits_pending
    assert moving.plan_number == number


@each_kind
@pytest.mark.parametrize("scale", [0.1, 0.5, 0.9])
def test_limits_that_come_before_the_first_step_of_a_move_are_in_force_at_once(kind, scale):
    """The setpoint still rests, though the plan that is held leads away."""
    geometry = TriGlideGeometry(((0.01, 0.21), (-0.18, -0.09), (0.165, -0.11)), (0.40, 0.42, 0.385))
    region = Workspace(TriGlide(geometry), WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 20.0))
    limits = SliderLimits((1.0, 0.6, 0.8), (10.0, 12.0, 6.0), (200.0, 150.0, 300.0))
    lower = SliderLimits(
        (0.020756295, 0.004516448, 0.023673605),
        (2.851608623, 8.710345924, 2.843409260),
        (168.063922643, 63.439411472, 186.004994717),
    )
    target = (0.22196027661811796, -0.017065512732373833, 0.4149286260073027)
    moving = MotionEngine(region, limits, kind=kind)
    moving.start((0.5100189499963259, 0.5723104349834996, 0.6171819881843261))
    moving.move_to(target)
    moving.set_limits(lower, scale)
    assert not moving.limits_pending
    assert moving.phase is MotionPhase.MOVING
    moving.step(moving.remaining)
    reached = region.machine.forward(moving.state.heights)
    assert reached == pytest.approx(target, abs=1e-8)
