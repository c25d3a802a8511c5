"""Trajectories without an engine: the same motions, and the same refusals."""

import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    KINDS,
    LIMITS,
    MACHINE,
    START,
    TARGET,
    WORKSPACE,
    RecordedEngine,
    engine,
    within,
)
from motion_plans import assert_states_are_samples
from timed_paths import dense_path, random_path

from tri_glide_kinematics import errors
from tri_glide_kinematics.motion import (
    MotionKind,
    PlatformPath,
    Trajectory,
    plan_move,
    time_path,
)
from tri_glide_kinematics.wording import number_text

CORNERS = [(0.0, 0.0, 0.3), (0.03, 0.0, 0.3), (0.03, 0.03, 0.31)]
PATHS = {
    "with a stop in a corner": PlatformPath.through(CORNERS),
    "without a stop": random_path(5, most=4),
    "in many windows": dense_path(1500, speed=0.3),
}


def assert_driven_by(moving: RecordedEngine, motion: Trajectory, stop: float = math.inf) -> None:
    """Compare a ``motion`` with the setpoints of an engine that has just been given its goal.

    At a ``stop`` [s] the engine waits for its next step.
    """
    while moving.remaining > 0.0:
        moving.step(DT)
    times = DT * np.arange(len(moving.states))
    times[times > stop] -= -stop % DT
    assert motion.duration <= times[-1] < motion.duration + DT
    sampled = motion.sample(times)
    for values, expected, near in zip(sampled[1:], zip(*moving.states), (1e-9, 1e-8, 1e-5)):
        np.testing.assert_allclose(values, expected, rtol=0.0, atol=near)
    assert within(sampled.heights, LIMITS)


@pytest.mark.parametrize("name", PATHS)
def test_a_timed_path_is_what_an_engine_drives(name):
    path = PATHS[name]
    motion = time_path(path, WORKSPACE, LIMITS)
    first = motion.parts(0.0)[0][0].duration
    stop = first if "with a stop" in name else math.inf
    assert stop == math.inf or not any(motion.at(stop).velocities)
    moving = engine(heights=MACHINE.inverse(path.position(0.0)))
    moving.follow(path)
    assert_driven_by(moving, motion, stop)
    assert math.dist(MACHINE.forward(motion.at(math.inf).heights), path.end) < 1e-9


@pytest.mark.parametrize("kind", KINDS)
def test_a_planned_move_is_what_an_engine_drives(kind):
    moving = engine(kind)
    moving.move_to(TARGET)
    assert_driven_by(moving, plan_move(WORKSPACE, LIMITS, START, TARGET, kind=kind))


each_motion = pytest.mark.parametrize(
    "motion",
    [
        time_path(PlatformPath.through(CORNERS), WORKSPACE, LIMITS),
        *(plan_move(WORKSPACE, LIMITS, START, TARGET, kind=kind) for kind in KINDS),
        plan_move(WORKSPACE, LIMITS, START, START),
    ],
)


@each_motion
def test_one_time_is_as_many_and_outside_the_sliders_rest(motion):
    times = np.linspace(-0.1, motion.duration + 0.1, 40)
    assert_states_are_samples(motion, times, (1e-9, 1e-9, 1e-9))
    for outside, end in ((-0.1, 0.0), (motion.duration + 0.1, motion.duration)):
        assert motion.at(outside) == motion.at(end)
        assert not np.any(motion.at(outside)[1:])


def test_what_cannot_be_driven_is_refused():
    away = (0.6, 0.0, 0.3)
    with pytest.raises(errors.KinematicsError, match="segment 1"):
        time_path(PlatformPath.start(START).line_to((0.3, 0.0, 0.3)), WORKSPACE, LIMITS)
    with pytest.raises(errors.KinematicsError, match="0 segments"):
        time_path(PlatformPath.start(START), WORKSPACE, LIMITS)
    for start, end in ((START, away), (away, START)):
        with pytest.raises(errors.KinematicsError):
            plan_move(WORKSPACE, LIMITS, start, end)
    with pytest.raises(errors.KinematicsError):
        # Both ends are inside, and the line between is not.
        plan_move(WORKSPACE, LIMITS, (0.03, -0.02, 0.51), (-0.2, -0.09, 0.5), kind=KINDS[1])
    with pytest.raises(errors.NotAChoiceError, match="kind"):
        plan_move(WORKSPACE, LIMITS, START, TARGET, kind="linear")
    with pytest.raises(errors.NotFiniteError, match="end"):
        plan_move(WORKSPACE, LIMITS, START, (0.0, math.nan, 0.3))
    with pytest.raises(errors.WrongShapeError, match="start"):
        plan_move(WORKSPACE, LIMITS, START[:2], TARGET, kind=MotionKind.LINEAR)


@pytest.mark.parametrize("kind", KINDS)
def test_a_plan_is_told_by_its_kind_and_its_time(kind):
    move = plan_move(WORKSPACE, LIMITS, START, TARGET, kind=kind)
    assert repr(move) == f"<{type(move).__name__}, {number_text(move.duration)} s>"
