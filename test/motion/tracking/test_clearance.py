"""The certificate of a step: each of its guards refuses what it is there for."""

import math
from dataclasses import replace

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE
from strategies import DEFAULT_LIMITS
from tracking_run import TrackingRun, at_rest

from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.tracking import (
    MovingTarget,
    WantedVelocity,
    braking_alone,
    braking_together,
    clearance,
    first_certified,
)
from tri_glide_kinematics.motion.tracking.slider_way import way_of
from tri_glide_kinematics.motion.trajectory import CubicPlan
from tri_glide_kinematics.workspace import Workspace

# From rest to rest: 4 mm upwards, up to 0.05 m/s, 1.25 m/s^2 and 31.25 m/s^3.
UP = [(0.04, 31.25), (0.08, -31.25), (0.04, 31.25)]
DOWN = [(length, -jerk) for length, jerk in UP]
STAY = [(0.1, 0.0)]
HIGH = 0.9 - 0.003
TIGHT = Workspace(
    MACHINE, replace(DEFAULT_LIMITS, box_lower=(-9.0, -9.0, -9.0), box_upper=(9.0, 9.0, 0.302))
)


def everything(*_arguments, **_options) -> Interruptible[bool]:
    """Take the place of a check."""
    return True
    yield


def nothing(*_arguments, **_options) -> Interruptible[bool]:
    """Take the place of a check that proves nothing."""
    return False
    yield


def certified(start, ways, limits=LIMITS, workspace=WORKSPACE) -> bool:
    return at_once(first_certified(workspace, start, [ways], limits)) is not None


def test_ways_that_keep_all_limits_are_certified_with_their_duration():
    found = at_once(first_certified(WORKSPACE, at_rest(), [[UP, STAY, DOWN]], LIMITS))
    assert found.duration == pytest.approx(0.16)
    assert found.ways == [UP, STAY, DOWN]
    assert CubicPlan(at_rest(), found.ways).duration == pytest.approx(found.duration)


@pytest.mark.parametrize("slider", (0, 1, 2))
@pytest.mark.parametrize(
    ("name", "peak"), (("velocity", 0.05), ("acceleration", 1.25), ("jerk", 31.25))
)
def test_each_limit_of_each_slider_is_looked_at(slider, name, peak, monkeypatch):
    ways = [STAY, STAY, STAY]
    ways[slider] = UP
    values = list(getattr(LIMITS, name))
    for factor, keeps in ((1.001, True), (0.999, False)):
        values[slider] = factor * peak
        limits = replace(LIMITS, **{name: tuple(values)})
        assert certified(at_rest(), ways, limits) is keeps
    monkeypatch.setattr(clearance, "keep_limits", everything)
    assert certified(at_rest(), ways, limits)


@pytest.mark.parametrize("slider", (0, 1, 2))
@pytest.mark.parametrize("way", (UP, DOWN))
def test_the_ends_of_each_travel_are_looked_at(slider, way):
    ways = [STAY, STAY, STAY]
    ways[slider] = way
    name, side = ("upper_heights", 1.0) if way is UP else ("lower_heights", -1.0)
    # All others stay where they are, far from the end.
    ends = list(getattr(DEFAULT_LIMITS, name))
    for beyond, keeps in ((-1e-6, True), (1e-6, False)):
        ends[slider] = at_rest().heights[slider] + side * (0.004 - beyond)
        workspace = Workspace(MACHINE, replace(DEFAULT_LIMITS, **{name: tuple(ends)}))
        assert certified(at_rest(), ways, workspace=workspace) is keeps


def test_the_workspace_is_looked_at(monkeypatch):
    ways = [UP, UP, UP]
    assert certified(at_rest(), ways)
    # 4 mm upwards where 2 mm are left.
    assert not certified(at_rest(), ways, workspace=TIGHT)
    assert certified(at_rest((0.0, 0.0, 0.2979)), ways, workspace=TIGHT)
    with monkeypatch.context() as patched:
        patched.setattr(Workspace, "path_proof", everything)
        assert certified(at_rest(), ways, workspace=TIGHT)
    with monkeypatch.context() as patched:
        patched.setattr(Workspace, "free_way", lambda *_: math.inf)
        assert certified(at_rest(), ways, workspace=TIGHT)


def test_not_even_a_rest_outside_is_certified():
    """There the caller has other means: moves that make nothing worse."""
    stay = [STAY, STAY, STAY]
    assert certified(at_rest((0.0, 0.0, 0.302)), stay, workspace=TIGHT)
    assert not certified(at_rest((0.0, 0.0, 0.30201)), stay, workspace=TIGHT)


def test_where_the_room_is_too_small_the_path_is_traced(monkeypatch):
    near = at_rest((0.0, 0.0, 0.2979))
    assert TIGHT.free_way(near.heights) < 0.0035
    monkeypatch.setattr(Workspace, "path_proof", nothing)
    assert not certified(near, [UP, UP, UP], workspace=TIGHT)
    assert certified(at_rest(), [UP, STAY, DOWN])


def test_of_several_ways_the_first_that_passes():
    short = [(0.02, -31.25), (0.04, 31.25), (0.02, -31.25)]
    choices = [[UP, UP, UP], [short, short, short]]
    found = at_once(first_certified(TIGHT, at_rest(), choices, LIMITS))
    assert found is not None
    assert found.ways == choices[1]
    slow = SliderLimits.uniform(0.01, 10.0, 200.0)
    assert at_once(first_certified(TIGHT, at_rest(), choices, slow)) is None


@pytest.mark.parametrize("bad", (math.nan, math.inf))
def test_what_is_no_number_is_not_certified(bad):
    for ways in ([[(bad, 1.0)], STAY, STAY], [STAY, [(0.1, bad)], STAY]):
        assert not certified(at_rest(), ways)
    for order in range(3):
        values = [at_rest().heights, AT_REST, AT_REST]
        values[order] = (bad, *values[order][1:])
        assert not certified(SliderState(*values), [STAY, STAY, STAY])


def broken(run: TrackingRun, limits: SliderLimits) -> bool:
    """Whether a slider passed its limits by more than rounding."""
    states = np.array(run.states)
    return bool((np.abs(states[:, 1:]).max(axis=0) > limits.table[:2] * (1.0 + 1e-6)).any())


def test_a_state_that_does_not_fit_is_refused_for_a_reason(monkeypatch):
    """Limits that are lowered in motion: taken up at once they would be broken."""
    wanted = WantedVelocity((0.3, 0.0, 0.0))
    low = SliderLimits.uniform(0.05, 10.0, 200.0)
    for guarded in (True, False):
        if not guarded:
            monkeypatch.setattr(clearance, "keep_limits", everything)
        run = TrackingRun((-0.05, 0.0, 0.3))
        run.run(lambda time: wanted, 0.1)
        first = len(run.states)
        taken = run.step(wanted, low)
        assert taken is not guarded
        run.states = run.states[first:]
        assert broken(run, low)


def test_a_target_outside_is_not_run_after(monkeypatch):
    """It would end in an endless to and fro next to the edge."""
    edge = WORKSPACE.exit_distance((0.0, 0.0, 0.3), (0.0, 1.0, 0.0), 1.0)
    target = MovingTarget((0.0, edge + 0.002, 0.3), AT_REST)
    run = TrackingRun()
    run.run(lambda time: target, 0.2)
    assert run.rests
    assert run.state == run.states[0]
    monkeypatch.setattr(Workspace, "check_position", everything)
    run.run(lambda time: target, 0.2)
    assert run.state != run.states[0]


def test_braking_together_keeps_the_direction_better():
    heights, velocities = MACHINE.inverse_velocity((0.05, 0.05, 0.3), (0.3, 0.1, 0.05))
    ways = [way_of(velocity, 0.0, []) for velocity in velocities]
    state = SliderState(heights, velocities, AT_REST)
    places = []
    for brakes in (braking_alone, braking_together):
        plan = CubicPlan(state, brakes(ways, LIMITS))
        assert np.abs(plan.pieces[3]).max() <= 200.0
        assert np.abs(plan.pieces[2]).max() <= 10.0 + 1e-9
        samples = plan.sample(np.linspace(0.0, plan.duration, 200)).heights
        direction = np.array((0.3, 0.1, 0.05)) / math.hypot(0.3, 0.1, 0.05)
        way = MACHINE.forward_batch(samples) - (0.05, 0.05, 0.3)
        places.append(np.linalg.norm(way - np.outer(way @ direction, direction), axis=1).max())
    alone, together = places
    assert together < alone / 2.0
    # Where nothing moves there is nothing to keep.
    still = [way_of(0.0, 0.0, []) for _ in range(3)]
    assert braking_together(still, LIMITS) == braking_alone(still, LIMITS)
