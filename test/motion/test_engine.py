"""The motion engine as its users see it; what it never does is in test_soak.py."""

from __future__ import annotations

import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    HOME,
    KINDS,
    LIMITS,
    MACHINE,
    WORKSPACE,
    engine,
    peaks,
    place,
    platform_velocity,
    run,
    run_to_rest,
    within,
)

from tri_glide_kinematics.errors import (
    KinematicsError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)
from tri_glide_kinematics.motion.engine import MotionEngine, MotionKind, MotionPhase, SliderLimits
from tri_glide_kinematics.motion.errors import NoRoomError, NotStartedError
from tri_glide_kinematics.tri_glide.errors import ArmTooShortError, NoPoseError
from tri_glide_kinematics.workspace.errors import OutsideWorkspaceError
from tri_glide_kinematics.workspace.workspace import WorkspaceLimits

TARGET = (0.1, 0.05, 0.35)
OTHER = (-0.08, 0.06, 0.25)
each_kind = pytest.mark.parametrize("kind", KINDS)


def test_every_command_needs_a_start():
    fresh = MotionEngine(WORKSPACE, LIMITS)
    assert not fresh.started
    assert fresh.phase is MotionPhase.IDLE
    assert fresh.remaining == 0.0
    for command in (
        lambda: fresh.move_to(TARGET),
        lambda: fresh.jog((0.1, 0.0, 0.0)),
        fresh.stop,
        lambda: fresh.step(DT),
        lambda: fresh.state,
        lambda: fresh.sample_plan(np.zeros(1)),
    ):
        with pytest.raises(NotStartedError):
            command()
    fresh.set_limits(SliderLimits.uniform(0.5, 5.0, 100.0))
    fresh.set_speed_scale(0.5)
    assert (fresh.limits.velocity[0], fresh.speed_scale) == (0.5, 0.5)
    assert not fresh.limits_pending


@each_kind
def test_starts_at_measured_heights_without_a_step(kind):
    measured = (0.512345, 0.498765, 0.555555)
    started = engine(kind, heights=measured)
    assert started.started
    assert started.state.heights == started.step(DT).heights == measured
    assert started.phase is MotionPhase.IDLE
    started.move_to(TARGET)
    heights = run_to_rest(started)
    assert np.abs(heights[1] - measured).max() < 1e-6
    assert within(heights)


@each_kind
def test_move_reaches_its_target(kind):
    moving = engine(kind)
    moving.move_to(TARGET)
    assert moving.phase is MotionPhase.MOVING
    assert moving.target == TARGET
    expected = moving.remaining
    heights = run_to_rest(moving)
    assert len(heights) - 1 == pytest.approx(expected / DT, abs=1.0)
    assert moving.remaining == 0.0
    assert np.abs(place(moving) - TARGET).max() < 1e-9
    assert within(heights)
    assert moving.state.velocities == moving.state.accelerations == (0.0, 0.0, 0.0)


def test_linear_moves_are_straight_and_slider_moves_straight_in_the_sliders():
    for kind in KINDS:
        moving = engine(kind)
        begin = place(moving)
        moving.move_to(TARGET)
        heights = run_to_rest(moving)
        platform = MACHINE.forward_batch(heights) - begin
        way = np.subtract(TARGET, begin)
        bent = np.linalg.norm(np.cross(platform, way), axis=1).max() / np.linalg.norm(way)
        sliders = heights - HOME
        end = sliders[-1]
        apart = np.linalg.norm(np.cross(sliders, end), axis=1).max() / np.linalg.norm(end)
        straight, crooked = (bent, apart) if kind is MotionKind.LINEAR else (apart, bent)
        assert straight < 1e-9
        assert crooked > 1e-3


@each_kind
def test_setpoints_hold_velocities_and_accelerations_of_the_heights(kind):
    moving = engine(kind)
    moving.move_to(TARGET)
    states = [moving.step(1e-4) for _ in range(2000)]
    heights, velocities, accelerations = (np.array(values) for values in zip(*states))
    rates = (heights[2:] - heights[:-2]) / 2e-4
    assert np.abs(rates - velocities[1:-1]).max() < 1e-5
    rates = (velocities[2:] - velocities[:-2]) / 2e-4
    assert np.abs(rates - accelerations[1:-1]).max() < 0.02


@each_kind
def test_new_target_in_mid_motion_does_not_stop_in_between(kind):
    moving = engine(kind)
    moving.move_to((0.12, 0.0, 0.3))
    parts = [run(moving, 0.15)]
    moving.move_to((0.12, 0.1, 0.45))
    parts.append(run_to_rest(moving)[1:])
    heights = np.concatenate(parts)
    speeds = np.linalg.norm(np.diff(heights, axis=0), axis=1) / DT
    assert speeds[60:-60].min() > 0.05
    assert within(heights)
    assert np.abs(place(moving) - (0.12, 0.1, 0.45)).max() < 1e-7


@each_kind
def test_same_target_again_changes_nothing(kind):
    once, often = engine(kind), engine(kind)
    once.move_to(TARGET)
    for _ in range(600):
        often.move_to(TARGET)
        assert often.step(DT) == once.step(DT)
    assert often.phase is MotionPhase.IDLE


@each_kind
def test_refused_targets_leave_the_motion_as_it_was(kind):
    moving, undisturbed = engine(kind), engine(kind)
    for one in (moving, undisturbed):
        one.move_to(TARGET)
    refused = (
        ((math.nan, 0.0, 0.3), NotFiniteError),
        ((0.0, math.inf, 0.3), NotFiniteError),
        ((0.0, 0.3), WrongShapeError),
        ((0.5, 0.0, 0.3), OutsideWorkspaceError),
        ((0.0, 0.0, 0.8), OutsideWorkspaceError),
        ((0.0, 0.0, -2.0), OutsideWorkspaceError),
    )
    for position, error in refused:
        with pytest.raises(error) as caught:
            moving.move_to(position)
        assert str(caught.value)
        assert moving.step(DT) == undisturbed.step(DT)
    for velocity in ((math.nan, 0.0, 0.0), (0.0, -math.inf, 0.0), (0.1,), (0.1, 0.0, 0.0, 0.0)):
        with pytest.raises((NotFiniteError, WrongShapeError)):
            moving.jog(velocity)
        assert moving.step(DT) == undisturbed.step(DT)
    for scale in (0.0, -1.0, 1.1, math.nan, math.inf):
        with pytest.raises((OutOfBoundsError, NotFiniteError)):
            moving.set_speed_scale(scale)
        assert moving.step(DT) == undisturbed.step(DT)
    for heights in ((math.nan, 0.6, 0.6), (0.6, 0.6)):
        with pytest.raises((NotFiniteError, WrongShapeError)):
            moving.start(heights)
        assert moving.step(DT) == undisturbed.step(DT)
    with pytest.raises(NoPoseError):
        moving.start((0.1, 0.9, 0.9))
    for dt in (0.0, -DT, math.nan, math.inf):
        with pytest.raises(OutOfBoundsError):
            moving.step(dt)
    while undisturbed.phase is not MotionPhase.IDLE:
        assert moving.step(DT) == undisturbed.step(DT)


def test_move_whose_way_leaves_the_workspace_is_refused_with_the_place():
    # Both ends are inside, but in between the second slider would have to be above its travel.
    start, end = (0.03, -0.02, 0.51), (-0.2, -0.09, 0.5)
    WORKSPACE.check_position(start)
    WORKSPACE.check_position(end)
    moving = engine(MotionKind.LINEAR, heights=MACHINE.inverse(start))
    with pytest.raises(OutsideWorkspaceError, match="upper end of slider travel of arm 2"):
        moving.move_to(end)
    assert moving.phase is MotionPhase.IDLE


@each_kind
def test_jog_goes_in_its_direction_at_its_speed(kind):
    moving = engine(kind)
    moving.jog((0.06, -0.03, 0.02))
    assert moving.phase is MotionPhase.JOGGING
    run(moving, 0.4)
    assert np.allclose(platform_velocity(moving), (0.06, -0.03, 0.02), rtol=2e-3)
    moving.jog((0.0, 0.05, -0.05))
    assert moving.target is None
    run(moving, 0.5)
    assert np.allclose(platform_velocity(moving), (0.0, 0.05, -0.05), atol=1e-4)


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
    rows = [moving.state.heights]
    for _ in range(400):
        moving.jog((np.array((0.1, 0.0, 0.0)) + change * rng.normal(size=3)).tolist())
        rows.append(moving.step(DT).heights)
    assert within(np.array(rows))
    assert platform_velocity(moving)[0] > 0.07
    assert place(moving)[0] > 0.02


@pytest.mark.slow
@each_kind
def test_flood_of_differing_targets_still_makes_progress(kind):
    rng = np.random.default_rng(4)
    moving = engine(kind)
    rows = [moving.state.heights]
    for _ in range(800):
        moving.move_to((np.array(TARGET) + 1e-4 * rng.normal(size=3)).tolist())
        rows.append(moving.step(DT).heights)
    assert within(np.array(rows))
    assert np.linalg.norm(place(moving) - TARGET) < 2e-3


@each_kind
def test_stop_is_a_ramp_that_is_soon_over(kind):
    for time in np.linspace(0.01, 0.35, 18):
        moving = engine(kind)
        moving.move_to((0.12, -0.05, 0.45))
        before = run(moving, float(time))
        held = moving.remaining
        moving.stop()
        assert moving.phase in (MotionPhase.STOPPING, MotionPhase.IDLE)
        assert moving.target is None
        assert moving.remaining <= held
        after = run_to_rest(moving)
        assert within(np.concatenate((before, after[1:])))
        assert len(after) * DT < 0.3


def test_stop_of_a_linear_move_stays_on_its_line():
    moving = engine(MotionKind.LINEAR)
    begin = place(moving)
    moving.move_to(TARGET)
    run(moving, 0.12)
    moving.stop()
    platform = MACHINE.forward_batch(run_to_rest(moving)) - begin
    way = np.subtract(TARGET, begin)
    assert np.linalg.norm(np.cross(platform, way), axis=1).max() / np.linalg.norm(way) < 1e-9


def test_stop_at_rest_is_nothing():
    resting = engine()
    resting.stop()
    assert resting.phase is MotionPhase.IDLE
    assert resting.step(DT).heights == HOME


@each_kind
def test_target_after_a_stop_is_moved_to(kind):
    moving = engine(kind)
    moving.move_to(TARGET)
    run(moving, 0.1)
    moving.stop()
    run(moving, 0.02)
    moving.move_to(TARGET)
    assert moving.phase is MotionPhase.MOVING
    assert within(run_to_rest(moving))
    assert np.abs(place(moving) - TARGET).max() < 1e-7


@each_kind
@pytest.mark.parametrize("scale", [0.05, 0.3, 0.9])
def test_speed_scale_takes_hold_in_mid_motion_inside_all_limits(kind, scale):
    moving = engine(kind)
    moving.move_to((0.12, -0.05, 0.45))
    rows = [run(moving, 0.15)]
    moving.set_speed_scale(scale)
    slow_since = None
    while moving.phase is not MotionPhase.IDLE:
        if not moving.limits_pending and slow_since is None:
            slow_since = sum(map(len, rows)) - 1
        rows.append(run(moving, DT)[1:])
    heights = np.concatenate(rows)
    assert slow_since is not None and slow_since < 450
    assert within(heights)
    assert peaks(heights[slow_since:])[0] <= scale * (1.0 + 1e-6)
    assert moving.speed_scale == scale
    assert np.abs(place(moving) - (0.12, -0.05, 0.45)).max() < 1e-7


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
        moving = engine(kind)
        moving.move_to((0.12, -0.05, 0.45))
        rows = [run(moving, time)]
        moving.set_limits(lower)
        new_since = None
        while moving.phase is not MotionPhase.IDLE:
            if moving.limits is lower and new_since is None:
                new_since = sum(map(len, rows)) - 1
            rows.append(run(moving, DT)[1:])
        heights = np.concatenate(rows)
        assert within(heights)
        assert within(heights[new_since:], lower)
        assert np.abs(place(moving) - (0.12, -0.05, 0.45)).max() < 1e-7


@each_kind
def test_higher_limits_are_used_at_once(kind):
    slow = SliderLimits.uniform(0.1, 2.0, 30.0)
    moving = engine(kind, slow)
    moving.move_to((0.12, -0.05, 0.45))
    run(moving, 0.3)
    before = moving.remaining
    moving.set_limits(LIMITS)
    assert moving.limits is LIMITS
    assert moving.remaining < 0.5 * before


@each_kind
def test_target_that_comes_while_limits_are_pending_is_reached(kind):
    moving = engine(kind)
    moving.move_to((0.12, -0.05, 0.45))
    run(moving, 0.15)
    moving.set_limits(SliderLimits.uniform(0.05, 1.0, 20.0))
    assert moving.limits_pending
    run(moving, 0.01)
    moving.move_to(OTHER)
    assert moving.target == OTHER
    assert within(run_to_rest(moving))
    assert np.abs(place(moving) - OTHER).max() < 1e-7
    assert moving.limits.velocity[0] == 0.05


@each_kind
def test_stop_while_limits_are_pending_stays_a_stop(kind):
    moving = engine(kind)
    moving.move_to((0.12, -0.05, 0.45))
    run(moving, 0.15)
    moving.set_limits(SliderLimits.uniform(0.05, 1.0, 20.0))
    run(moving, 0.01)
    moving.stop()
    assert within(run_to_rest(moving))
    run(moving, 0.1)
    assert moving.phase is MotionPhase.IDLE
    assert not moving.limits_pending
    assert np.abs(place(moving) - (0.12, -0.05, 0.45)).max() > 1e-3


def test_start_adopts_limits_that_were_pending():
    moving = engine()
    moving.move_to((0.12, -0.05, 0.45))
    run(moving, 0.15)
    moving.set_speed_scale(0.1)
    assert moving.limits_pending
    moving.start(HOME)
    assert not moving.limits_pending
    assert moving.speed_scale == 0.1
    assert moving.phase is MotionPhase.IDLE


@each_kind
def test_held_plan_can_be_sampled_as_it_will_be_stepped(kind):
    moving = engine(kind)
    moving.move_to(TARGET)
    run(moving, 0.1)
    moving.move_to(OTHER)
    run(moving, 0.005)
    times = DT * np.arange(1, 400)
    sampled = moving.sample_plan(times)
    assert np.array_equal(sampled.times, times)
    for row in range(399):
        state = moving.step(DT)
        assert np.allclose(sampled.heights[row], state.heights, rtol=0.0, atol=1e-11)
        assert np.allclose(sampled.velocities[row], state.velocities, rtol=0.0, atol=1e-9)
        assert np.allclose(sampled.accelerations[row], state.accelerations, rtol=0.0, atol=1e-6)


@each_kind
def test_machine_outside_the_workspace_comes_back_and_goes_no_farther(kind):
    """An encoder that reads a little beyond the end of travel must not lock the machine."""
    outside = (0.9004, 0.89, 0.9001)
    moving = engine(kind, heights=outside)
    with pytest.raises(KinematicsError):
        moving.jog((0.0, 0.0, 0.1))
    moving.move_to(TARGET)
    heights = run_to_rest(moving)
    assert within(heights)
    assert (heights[:, 0].max(), heights[:, 2].max()) == (outside[0], outside[2])
    back = engine(kind, heights=outside)
    back.jog((0.0, 0.0, -0.1))
    run(back, 0.3)
    assert platform_velocity(back)[2] == pytest.approx(-0.1, rel=1e-2)


def test_refusal_of_a_command_that_had_to_wait_is_told_once():
    moving = engine(MotionKind.LINEAR, heights=MACHINE.inverse((0.03, -0.02, 0.51)))
    moving.move_to((0.02, -0.02, 0.5))
    run(moving, 0.02)
    moving.set_limits(SliderLimits.uniform(0.001, 1.0, 20.0))
    assert moving.limits_pending
    # Until the new limits are in force it is only noted; its way turns out to be blocked.
    moving.move_to((-0.2, -0.09, 0.5))
    assert moving.target == (-0.2, -0.09, 0.5)
    heights = run_to_rest(moving)
    assert within(heights)
    assert isinstance(moving.take_refusal(), OutsideWorkspaceError)
    assert moving.take_refusal() is None
    assert moving.target is None


@each_kind
def test_stop_outside_the_workspace_is_as_soon_over_as_inside(kind):
    """On the way back a jog may turn round; a stop there must not wait for its end."""
    box = WorkspaceLimits(
        (0.3,) * 3, (0.9,) * 3, 0.005, 20.0, box_lower=(-0.1, -0.1, 0.0), box_upper=(0.1, 0.1, 0.5)
    )
    moving = engine(kind, heights=MACHINE.inverse((0.0, 0.16, 0.3)), workspace_limits=box)
    moving.jog((0.0, -0.1, 0.0))
    rows = [run(moving, 0.4)]
    moving.jog((0.0, 0.001, 0.0))
    rows.append(run(moving, 0.5)[1:])
    assert place(moving)[1] > 0.1
    assert platform_velocity(moving)[1] > 0.0
    moving.stop()
    rows.append(run_to_rest(moving, longest=0.2)[1:])
    heights = np.concatenate(rows)
    assert within(heights)
    assert MACHINE.forward_batch(heights)[:, 1].max() <= 0.16 + 1e-9


@each_kind
def test_a_tiny_move_does_not_hide_the_one_after_it(kind):
    """Idle is said only when nothing more comes, however soon the second target came."""
    for pause in range(8):
        moving = engine(kind)
        here = place(moving)
        moving.move_to((here[0] + 3e-7, here[1], here[2]))
        rows = [run(moving, pause * DT)]
        moving.move_to(TARGET)
        assert moving.phase is MotionPhase.MOVING
        rows.append(run_to_rest(moving)[1:])
        assert np.abs(place(moving) - TARGET).max() < 1e-9
        assert within(np.concatenate(rows))


@each_kind
@pytest.mark.parametrize("pause", [0.0, 0.003, 0.05, 0.15, 0.2, 0.25, 0.5])
def test_limits_that_are_restored_while_braking_lead_on_to_the_target(kind, pause):
    """Whenever they come back: idle means that the target was reached, and stays the truth."""
    target = (0.12, -0.05, 0.45)
    moving = engine(kind)
    moving.move_to(target)
    rows = [run(moving, 0.1)]
    moving.set_speed_scale(0.001)
    rows.append(run(moving, pause)[1:])
    moving.set_speed_scale(1.0)
    assert moving.phase is MotionPhase.MOVING
    rows.append(run_to_rest(moving)[1:])
    assert np.abs(place(moving) - target).max() < 1e-9
    resting = run(moving, 0.1)
    assert (resting == resting[0]).all()
    assert within(np.concatenate(rows))


@each_kind
def test_each_new_plan_has_a_new_number(kind):
    moving = engine(kind)
    numbers = [moving.plan_number]

    def is_new() -> bool:
        numbers.append(moving.plan_number)
        return numbers[-1] != numbers[-2]

    moving.move_to(TARGET)
    assert is_new()
    run(moving, 0.1)
    moving.move_to(TARGET)
    moving.set_limits(LIMITS)
    assert not is_new()
    moving.move_to(OTHER)
    assert is_new()
    run(moving, 0.1)
    moving.stop()
    assert is_new()
    moving.stop()
    run_to_rest(moving)
    moving.stop()
    assert not is_new()


@each_kind
def test_floods_while_limits_are_pending_are_not_planned(kind):
    moving = engine(kind)
    moving.move_to((0.12, -0.05, 0.45))
    run(moving, 0.15)
    moving.set_speed_scale(0.001)
    number = moving.plan_number
    for index in range(200):
        moving.move_to((0.1, 0.05, 0.35 + 1e-5 * index))
    assert moving.limits_pending
    assert moving.plan_number == number


def test_first_pose_out_of_reach_of_an_arm_names_it():
    with pytest.raises((ArmTooShortError, OutsideWorkspaceError), match="arm 1"):
        engine().move_to((0.0, -0.3, 0.3))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("speed", [1e-2, 1e-4, 1e-6])
def test_however_slow_the_drives_a_way_that_is_inside_is_found_to_be(kind, speed):
    start, first, second = (-0.06, -0.05, 0.22), (0.06, 0.05, 0.28), (-0.06, 0.05, 0.22)
    limits = SliderLimits.uniform(speed, 10.0, 200.0)
    moving = engine(kind, limits, heights=MACHINE.inverse(start))
    moving.move_to(first)
    assert moving.remaining > 0.1 / speed
    moving.step(0.5 * moving.remaining)
    moving.move_to(second)
    moving.step(moving.remaining)
    assert MACHINE.forward(moving.state.heights) == pytest.approx(second, abs=1e-9)
