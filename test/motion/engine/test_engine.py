"""The motion engine as its users see it: starts and moves; for what it never does see test_soak."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from motion_machine import (
    DT,
    FINE,
    HOME,
    KINDS,
    LIMITS,
    MACHINE,
    OTHER,
    SHAPER,
    TARGET,
    WORKSPACE,
    assert_rests_at,
    each_kind,
    engine,
    place,
    platform_velocity,
    run,
    run_to_rest,
    skip_if_too_long_for_ruckig,
    within,
)
from soak import many, seed

from benchmarks import judge
from tri_glide_kinematics.errors import (
    KinematicsError,
    NotAChoiceError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)
from tri_glide_kinematics.motion import (
    MotionEngine,
    MotionKind,
    MotionPhase,
    NotStartedError,
    PlatformPath,
    SliderLimits,
    plan_move,
    time_path,
)
from tri_glide_kinematics.tri_glide import ArmTooShortError, NoPoseError, TriGlide
from tri_glide_kinematics.workspace import OutsideWorkspaceError, Workspace


@pytest.mark.parametrize("kind", ["slider", "linear", 0, None])
def test_what_is_no_kind_of_motion_is_refused(kind):
    with pytest.raises(NotAChoiceError, match=r"MotionKind\.SLIDER or MotionKind\.LINEAR$"):
        MotionEngine(WORKSPACE, LIMITS, kind=kind)


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
    assert_rests_at(moving, TARGET)
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
def test_same_target_again_changes_nothing(kind):
    once, often = engine(kind), engine(kind)
    once.move_to(TARGET)
    for _ in range(300):
        often.move_to(TARGET)
        assert often.step(DT) == once.step(DT)
    assert often.phase is MotionPhase.IDLE


@each_kind
def test_refused_targets_leave_the_motion_as_it_was(kind):
    moving, undisturbed = engine(kind), engine(kind)
    for one in (moving, undisturbed):
        one.move_to(TARGET)
    refused = (
        (moving.move_to, (math.nan, 0.0, 0.3), NotFiniteError),
        (moving.move_to, (0.0, math.inf, 0.3), NotFiniteError),
        (moving.move_to, (0.0, 0.3), WrongShapeError),
        (moving.move_to, (0.5, 0.0, 0.3), OutsideWorkspaceError),
        (moving.move_to, (0.0, 0.0, 0.8), OutsideWorkspaceError),
        (moving.move_to, (0.0, 0.0, -2.0), OutsideWorkspaceError),
        (moving.jog, (math.nan, 0.0, 0.0), NotFiniteError),
        (moving.jog, (0.0, -math.inf, 0.0), NotFiniteError),
        (moving.jog, (0.1,), WrongShapeError),
        (moving.jog, (0.1, 0.0, 0.0, 0.0), WrongShapeError),
        *((moving.set_speed_scale, scale, OutOfBoundsError) for scale in (0.0, -1.0, 1.1)),
        *((moving.set_speed_scale, scale, NotFiniteError) for scale in (math.nan, math.inf)),
        (moving.start, (math.nan, 0.6, 0.6), NotFiniteError),
        (moving.start, (0.6, 0.6), WrongShapeError),
        (moving.start, (0.1, 0.9, 0.9), NoPoseError),
    )
    for command, value, error in refused:
        with pytest.raises(error) as caught:
            command(value)
        assert str(caught.value)
        assert moving.step(DT) == undisturbed.step(DT)
    for dt in (0.0, -DT, math.nan, math.inf):
        with pytest.raises(OutOfBoundsError):
            moving.step(dt)
    while undisturbed.phase is not MotionPhase.IDLE:
        assert moving.step(DT) == undisturbed.step(DT)


@pytest.mark.slow
@each_kind
def test_flood_of_differing_targets_still_makes_progress(kind):
    rng, target = np.random.default_rng(4), np.array((0.01, 0.005, 0.27))
    moving = engine(kind)
    for _ in range(60):
        moving.move_to((target + 1e-4 * rng.normal(size=3)).tolist())
        moving.step(DT)
    assert moving.kept_limits
    assert np.linalg.norm(place(moving) - target) < 2e-3


@each_kind
@pytest.mark.parametrize("shaper", [None, SHAPER])
def test_held_plan_can_be_sampled_as_it_will_be_stepped(kind, shaper):
    moving = engine(kind, shaper=shaper)
    moving.move_to(TARGET)
    run(moving, 0.1)
    moving.move_to(OTHER)
    run(moving, 0.005)
    times = DT * np.arange(1, 200)
    sampled = moving.sample_plan(times)
    assert np.array_equal(sampled.times, times)
    for row in range(199):
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


@each_kind
def test_a_tiny_move_does_not_hide_the_one_after_it(kind):
    """Idle is said only when nothing more comes, however soon the second target came."""
    for pause in range(8):
        moving = engine(kind, period=FINE)
        here = place(moving)
        moving.move_to((here[0] + 3e-7, here[1], here[2]))
        run(moving, pause * moving.period)
        moving.move_to(TARGET)
        assert moving.phase is MotionPhase.MOVING
        run_to_rest(moving)
        assert_rests_at(moving, TARGET)


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


def test_first_pose_out_of_reach_of_an_arm_names_it():
    with pytest.raises((ArmTooShortError, OutsideWorkspaceError), match="arm 1"):
        engine().move_to((0.0, -0.3, 0.3))


@each_kind
@pytest.mark.parametrize("speed", [1e-2, 1e-4, 1e-6])
def test_however_slow_the_drives_a_way_that_is_inside_is_found_to_be(kind, speed):
    start, first, second = (-0.06, -0.05, 0.22), (0.06, 0.05, 0.28), (-0.06, 0.05, 0.22)
    if kind is MotionKind.SLIDER:
        skip_if_too_long_for_ruckig(0.1 / speed)
    limits = SliderLimits.uniform(speed, 10.0, 200.0)
    moving = engine(kind, limits, heights=MACHINE.inverse(start))
    moving.move_to(first)
    assert moving.remaining > 0.1 / speed
    moving.step(0.5 * moving.remaining)
    moving.move_to(second)
    moving.step(moving.remaining)
    assert MACHINE.forward(moving.state.heights) == pytest.approx(second, abs=1e-9)


UNEQUAL = SliderLimits((1.0, 0.6, 0.8), (10.0, 6.0, 14.0), (200.0, 120.0, 300.0))
MIDDLE = (-0.08, -0.08, 0.22), (0.08, 0.08, 0.36)
ALL = (-0.2, -0.2, 0.1), (0.2, 0.2, 0.45)


@pytest.mark.parametrize(("limits", "box"), list(product((LIMITS, UNEQUAL), (MIDDLE, ALL))))
def test_a_line_takes_no_longer_than_the_same_line_as_a_path(limits, box):
    rng = np.random.default_rng(seed(49))
    count = 0
    while count < many(4):
        start, end = rng.uniform(*box, (2, 3)).tolist()
        try:
            planned = plan_move(WORKSPACE, limits, start, end, kind=MotionKind.LINEAR).duration
        except KinematicsError:
            continue
        count += 1
        shortest = time_path(PlatformPath.through([start, end]), WORKSPACE, limits).duration
        assert planned < 1.02 * shortest
        moving = engine(MotionKind.LINEAR, limits, heights=MACHINE.inverse(start))
        moving.move_to(end)
        assert DT * (len(run_to_rest(moving)) - 2) < 1.05 * shortest
        assert_rests_at(moving, end)


def test_a_line_of_several_windows_is_timed_as_its_path():
    workspace, ends = (
        Workspace(TriGlide(judge.UNEQUAL), judge.WIDE),
        ((-0.194, -0.121, 0.244), (0.075, -0.025, 0.28)),
    )
    limits = judge.UNEQUAL_LIMITS
    planned = plan_move(workspace, limits, *ends, kind=MotionKind.LINEAR)
    path = time_path(PlatformPath.through(ends), workspace, limits)
    assert planned.duration < 1.01 * path.duration
