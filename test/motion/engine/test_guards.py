"""Each guard of the engine is needed: with it taken out, the violation it prevents appears."""

from __future__ import annotations

import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    HOME,
    LIMITS,
    MACHINE,
    WORKSPACE,
    engine,
    peaks,
    run_to_rest,
    under_way,
    within,
)
from numpy.polynomial import Polynomial

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion import (
    MotionKind,
    MotionPhase,
    PlanningError,
    SliderLimits,
    SliderState,
)
from tri_glide_kinematics.motion.engine import replanning
from tri_glide_kinematics.motion.limits import AT_REST, EDGE_CLEARANCE
from tri_glide_kinematics.motion.moves import MotionPlanner, SliderMotion
from tri_glide_kinematics.motion.trajectory import (
    CubicPlan,
    CurvePlan,
    LinePlan,
    StraightLine,
    TimeScaling,
    Trajectory,
    curve_bounds,
)
from tri_glide_kinematics.workspace import OutsideWorkspaceError, Workspace, WorkspaceLimits


def nothing(*_arguments, **_options) -> None:
    """Take the place of a check."""


def ignored(monkeypatch, owner, name: str) -> None:
    """Take a check out."""
    monkeypatch.setattr(owner, name, nothing)


def overrun(heights) -> float:
    """Return how far slider travel is passed [m]."""
    limits = WORKSPACE.limits
    return max(
        float((np.array(limits.lower_heights) - heights).max()),
        float((heights - np.array(limits.upper_heights)).max()),
    )


def reach_overrun(heights) -> float:
    """Return how far an arm reaches beyond its margin [m]."""
    across = np.array(MACHINE.geometry.anchors) - MACHINE.forward_batch(heights)[:, np.newaxis, :2]
    reach = np.array(MACHINE.geometry.arm_lengths) - WORKSPACE.limits.reach_margin
    return float((np.linalg.norm(across, axis=-1) - reach).max())


def lowered_limits_while_moving() -> tuple[float, float]:
    """Return the largest acceleration and jerk after lower limits came in mid-motion."""
    lower = SliderLimits.uniform(1.0, 3.0, 60.0)
    moving = under_way((0.1, 0.05, 0.45), 0.09)
    moving.set_limits(lower)
    while moving.limits is not lower:
        moving.step(DT)
    return tuple(peaks(run_to_rest(moving))[1:] / np.array((3.0, 60.0)))


def test_limits_are_changed_only_when_the_motion_can_keep_them(monkeypatch):
    assert max(lowered_limits_while_moving()) <= 1.0 + 1e-3

    def unchecked(*_):
        return
        yield

    monkeypatch.setattr(replanning, "checked", unchecked)
    assert max(lowered_limits_while_moving()) > 1.5


def test_slider_plans_are_compared_with_the_limits(monkeypatch):
    """Ruckig's move from a state that cannot keep new limits breaks them and says nothing."""

    def peak() -> float:
        moving = under_way((0.1, 0.05, 0.45), 0.05)
        lower = SliderLimits.uniform(0.2, 10.0, 200.0)
        plan = at_once(SliderMotion().move(moving.state, HOME, lower))
        return float(np.abs(plan.sample(np.linspace(0.0, plan.duration, 500)).velocities).max())

    with pytest.raises(KinematicsError, match="velocity"):
        peak()
    ignored(monkeypatch, CubicPlan, "check_sliders")
    assert peak() > 0.25


def test_travel_is_checked_as_ruckig_does_not_enforce_it(monkeypatch):
    """A state so fast and so near to the end that no braking helps must not be planned from."""
    fast = SliderState((0.88, 0.87, 0.88), (0.9, 0.9, 0.9), AT_REST)
    planner = MotionPlanner(WORKSPACE, MotionKind.SLIDER)

    def highest() -> float:
        plan = at_once(planner.move(fast, (0.0, 0.0, 0.5), LIMITS, WORKSPACE, moving=True))
        return float(plan.sample(np.linspace(0.0, plan.duration, 500)).heights.max())

    with pytest.raises(KinematicsError):
        highest()
    monkeypatch.setattr(Workspace, "path_check", lambda *_: iter(()))
    with pytest.raises(KinematicsError):
        highest()
    ignored(monkeypatch, Trajectory, "check_travel")
    assert highest() > 0.9 + 1e-3


BOX = WorkspaceLimits(
    (0.3,) * 3, (0.9,) * 3, 0.005, 10.0, box_lower=(-0.1, -0.1, 0.25), box_upper=(0.1, 0.1, 0.35)
)


def box_overrun(heights) -> float:
    """Return how far the platform leaves the box [m]."""
    places = MACHINE.forward_batch(heights)
    return float(max((places - BOX.box_upper).max(), (np.array(BOX.box_lower) - places).max()))


def bending_move() -> float:
    """Return how far a slider move along a side of the box bends out of it."""
    moving = engine(heights=MACHINE.inverse((-0.087, -0.09, 0.271)), workspace_limits=BOX)
    try:
        moving.move_to((-0.072, 0.097, 0.25))
    except KinematicsError:
        return -math.inf
    return box_overrun(run_to_rest(moving))


def test_path_of_slider_moves_is_checked(monkeypatch):
    assert bending_move() == -math.inf
    monkeypatch.setattr(Workspace, "path_check", lambda *_: iter(()))
    assert bending_move() > 5e-3


def blocked_line() -> float:
    """Return how far travel is passed on a line whose ends are both inside."""
    moving = engine(MotionKind.LINEAR, heights=MACHINE.inverse((0.03, -0.02, 0.51)))
    try:
        moving.move_to((-0.2, -0.09, 0.5))
    except OutsideWorkspaceError as error:
        assert "upper end of slider travel of arm 2" in str(error)
        assert moving.phase is MotionPhase.IDLE
        return -math.inf
    return overrun(run_to_rest(moving))


def test_line_of_linear_moves_is_checked(monkeypatch):
    assert blocked_line() == -math.inf
    monkeypatch.setattr(Workspace, "way_check", lambda *_: iter(()))
    assert blocked_line() > 1e-4


def jog_outwards() -> float:
    """Return how far a jog leads out of reach."""
    moving = engine()
    try:
        moving.jog((0.2, 0.0, 0.0))
    except KinematicsError:
        return math.inf
    return reach_overrun(run_to_rest(moving))


def test_jog_ends_at_the_edge(monkeypatch):
    assert jog_outwards() <= 1e-9
    to_the_edge = Workspace.exit_search

    def beyond_the_edge(*arguments) -> Interruptible[float]:
        return (yield from to_the_edge(*arguments)) + 2e-3

    monkeypatch.setattr(Workspace, "exit_search", beyond_the_edge)
    assert jog_outwards() > 1e-3


def many_new_targets(count: int = 12) -> float:
    """Return the largest jerk over its limit when linear moves get new targets in mid-motion."""
    rng = np.random.default_rng(3)
    worst = 0.0
    for _ in range(count):
        target = rng.uniform((-0.1, -0.1, 0.1), (0.1, 0.1, 0.45)).tolist()
        moving = under_way(target, float(rng.uniform(0.05, 0.25)), MotionKind.LINEAR)
        moving.move_to(rng.uniform((-0.1, -0.1, 0.1), (0.1, 0.1, 0.45)).tolist())
        run_to_rest(moving)
        worst = max(worst, float(peaks(moving.heights_since())[2]) / 200.0)
    return worst


def test_line_plans_are_compared_with_the_limits(monkeypatch):
    assert many_new_targets() <= 1.0 + 1e-3
    ignored(monkeypatch, CurvePlan, "check_sliders")
    assert many_new_targets() > 1.1


def test_motion_from_rest_is_stretched_until_the_limits_hold(monkeypatch):
    start = SliderState(MACHINE.inverse((0.18, 0.05, 0.34)), AT_REST, AT_REST)

    def peak() -> float:
        planner = MotionPlanner(WORKSPACE, MotionKind.LINEAR)
        plan = at_once(planner.line(start, (0.01, 0.01, 0.27), LIMITS, WORKSPACE))
        heights = plan.sample(np.arange(0.0, plan.duration + DT, DT)).heights
        return float((peaks(heights) / np.array((1.0, 10.0, 200.0))).max())

    assert peak() <= 1.0 + 1e-3
    monkeypatch.setattr(TimeScaling, "slower", lambda scaling, _factor: scaling)
    assert peak() > 1.05


def test_motion_that_cannot_stop_in_time_does_not_go_back(monkeypatch):
    """A time scaling that runs past its end and returns is slow enough for all limits."""
    line = StraightLine.between(MACHINE.geometry, (0.0, 0.0, 0.3), (0.1, 0.0, 0.3))
    # From 0 to 0.1 m, with an overshoot in between.
    way = Polynomial((0.0, 0.0, 0.0, 1.0)) * (
        0.1 * Polynomial((10.0, -15.0, 6.0)) + 1.6 * Polynomial((1.0, -1.0)) ** 3
    )
    times = np.linspace(0.0, 1.0, 61)
    scaling = TimeScaling(times, way(times), way.deriv(1)(times), way.deriv(2)(times)).slower(2.0)
    plan = LinePlan(line, scaling)
    with pytest.raises(PlanningError, match="cannot stop"):
        plan.check_limits(LIMITS)
    monkeypatch.setattr(curve_bounds, "NO_BACKWARD_SPEED", math.inf)
    plan.check_limits(LIMITS)
    along = MACHINE.forward_batch(plan.sample(np.linspace(0.0, 2.0, 500)).heights)[:, 0]
    assert along.max() > 0.1 + 5e-4


def turns_at_the_side_of_the_box() -> float:
    """Return how far new targets near a side, whenever they come, lead out of the box."""
    start, side, target = (-0.021, -0.058, 0.292), (0.1, 0.054, 0.261), (0.089, 0.035, 0.256)
    moving = engine(MotionKind.LINEAR, heights=MACHINE.inverse(start), workspace_limits=BOX)
    farthest = -math.inf
    for part in np.linspace(0.3, 0.9, 13).tolist():
        moving.start(MACHINE.inverse(start))
        moving.move_to(side)
        moving.step(part * moving.time_to_rest)
        moving.move_to(target)
        rows = moving.sample_plan(np.linspace(0.0, moving.time_to_rest, 200)).heights
        farthest = max(farthest, box_overrun(rows))
    return farthest


def test_blends_are_checked_for_the_workspace(monkeypatch):
    """Beside its line, too, the platform has to be inside."""
    assert turns_at_the_side_of_the_box() <= 5e-5
    monkeypatch.setattr(LinePlan, "checking_inside", lambda *_: iter(()))
    assert turns_at_the_side_of_the_box() > 1e-3


def test_phase_is_kept_as_the_same_target_is_not_planned_again():
    """Ruckig plans a straight line in slider space from rest only."""

    def crooked(change: float) -> float:
        moving = engine()
        for step in range(250):
            moving.move_to((0.1, 0.05, 0.35 + change * step))
            moving.step(DT)
        offsets = moving.heights_since() - HOME
        end = offsets[-1]
        return float(np.linalg.norm(np.cross(offsets, end), axis=1).max() / np.linalg.norm(end))

    assert crooked(0.0) < 1e-9
    assert crooked(1e-12) > 1e-5


def test_edge_clearance_leaves_room_for_rounding():
    """A jog to the very edge would leave a place from which rounding refuses the way back."""
    assert EDGE_CLEARANCE > 1e-8
    moving = engine()
    moving.jog((0.2, 0.1, 0.05))
    assert within(run_to_rest(moving), LIMITS)
    WORKSPACE.check_heights(moving.state.heights)
