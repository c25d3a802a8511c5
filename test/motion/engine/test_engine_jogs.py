"""Jogs and stops of the motion engine."""

import numpy as np
import pytest
from motion_machine import (
    DT,
    MACHINE,
    TARGET,
    WORKSPACE,
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

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionPhase, NoRoomError
from tri_glide_kinematics.workspace import WorkspaceLimits


@each_kind
def test_new_target_in_mid_motion_does_not_stop_in_between(kind):
    moving = under_way((0.12, 0.0, 0.3), 0.15, kind)
    moving.move_to((0.12, 0.1, 0.45))
    run_to_rest(moving)
    speeds = np.linalg.norm(np.diff(moving.heights_since(), axis=0), axis=1) / DT
    assert speeds[60:-60].min() > 0.05
    assert_rests_at(moving, (0.12, 0.1, 0.45), near=1e-7)


@each_kind
def test_renewed_twist_changes_nothing(kind):
    once, often = engine(kind), engine(kind)
    once.jog((0.1, 0.02, 0.0))
    often.jog((0.1, 0.02, 0.0))
    while once.phase is not MotionPhase.IDLE:
        often.jog((0.1, 0.02, 0.0))
        assert often.step(DT) == once.step(DT)
    assert often.phase is MotionPhase.IDLE
    assert often.plan_number == once.plan_number


@each_kind
def test_jog_runs_as_fast_as_the_sliders_allow(kind):
    moving = engine(kind)
    moving.jog((0.0, 0.0, 5.0))
    heights = run_to_rest(moving)
    assert within(heights)
    assert peaks(heights)[0] > 0.9


@each_kind
def test_jog_stops_at_the_edge_and_can_be_driven_back(kind):
    moving = engine(kind)
    moving.jog((0.2, 0.0, 0.0))
    assert within(run_to_rest(moving))
    edge = place(moving)
    WORKSPACE.check_position(edge.tolist())
    with pytest.raises(KinematicsError):
        WORKSPACE.check_position((edge[0] + 1e-3, edge[1], edge[2]))
    for outwards in (0.2, 0.3):  # the same twist renewed, and another one
        with pytest.raises(NoRoomError) as caught:
            moving.jog((outwards, 0.0, 0.0))
        assert "reach" in caught.value.reason
        assert moving.phase is MotionPhase.IDLE
    moving.jog((-0.2, 0.0, 0.0))
    run(moving, 0.6)
    assert platform_velocity(moving)[0] < -0.05


@each_kind
def test_twist_of_zero_is_a_stop(kind):
    moving = engine(kind)
    moving.jog((0.1, 0.0, 0.0))
    run(moving, 0.3)
    moving.jog((0.0, 0.0, 0.0))
    assert moving.phase is MotionPhase.STOPPING
    assert within(run_to_rest(moving))


@pytest.mark.slow
@each_kind
@pytest.mark.parametrize("change", [1e-6, 1e-3, 0.02])
def test_flood_of_differing_twists_still_makes_progress(kind, change):
    rng = np.random.default_rng(4)
    moving = engine(kind)
    for _ in range(200):
        moving.jog((np.array((0.1, 0.0, 0.0)) + change * rng.normal(size=3)).tolist())
        moving.step(DT)
    assert moving.kept_limits
    assert platform_velocity(moving)[0] > 0.07
    assert place(moving)[0] > 0.02


@each_kind
def test_stop_is_a_ramp_that_is_soon_over(kind):
    for time in np.linspace(0.01, 0.35, 18):
        moving = under_way((0.12, -0.05, 0.45), float(time), kind)
        held = moving.time_to_rest
        moving.stop()
        assert moving.phase in (MotionPhase.STOPPING, MotionPhase.IDLE)
        assert moving.target is None
        assert moving.time_to_rest <= held
        assert len(run_to_rest(moving)) * DT < 0.3
        assert moving.kept_limits


@each_kind
def test_target_after_a_stop_is_moved_to(kind):
    moving = under_way(TARGET, 0.1, kind)
    moving.stop()
    run(moving, 0.02)
    moving.move_to(TARGET)
    assert moving.phase is MotionPhase.MOVING
    run_to_rest(moving)
    assert_rests_at(moving, TARGET, near=1e-7)


@each_kind
def test_stop_outside_the_workspace_is_as_soon_over_as_inside(kind):
    """On the way back a jog may turn round; a stop there must not wait for its end."""
    box = WorkspaceLimits(
        (0.3,) * 3, (0.9,) * 3, 0.005, 20.0, box_lower=(-0.1, -0.1, 0.0), box_upper=(0.1, 0.1, 0.5)
    )
    moving = engine(kind, heights=MACHINE.inverse((0.0, 0.16, 0.3)), workspace_limits=box)
    moving.jog((0.0, -0.1, 0.0))
    run(moving, 0.4)
    moving.jog((0.0, 0.001, 0.0))
    run(moving, 0.5)
    assert place(moving)[1] > 0.1
    assert platform_velocity(moving)[1] > 0.0
    moving.stop()
    run_to_rest(moving, longest=0.2)
    assert moving.kept_limits
    assert moving.places_since()[:, 1].max() <= 0.16 + 1e-9


@pytest.mark.parametrize("horizon", [0.0, 0.045, 0.1])
def test_a_jog_that_turns_is_as_fast_as_it_is_told(horizon):
    moving = engine(heights=MACHINE.inverse((0.0, 0.0, 0.3)))
    moving.set_follow_horizon(horizon)
    speeds = []
    for step in range(500):
        if step % 5 == 0:
            angle = 4.0 * np.pi * step * DT
            moving.jog((0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.0))
        moving.step(DT)
        speeds.append(float(np.linalg.norm(platform_velocity(moving))))
    assert speeds[250:] == pytest.approx([0.1] * 250, rel=0.01)
