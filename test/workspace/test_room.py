"""How far the sliders may go from a place on any path, and paths that are proved in few samples."""

from dataclasses import replace

import numpy as np
import pytest
from motion_machine import HOME, LIMITS, MACHINE, WORKSPACE
from strategies import DEFAULT_LIMITS, is_inside, random_positions

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.limits import AT_REST, SliderState
from tri_glide_kinematics.motion.moves import SliderMotion
from tri_glide_kinematics.workspace import TOLERANCE, Cylinder, Workspace

# Travel is of no interest here.
TALL = replace(DEFAULT_LIMITS, lower_heights=(-9.0,) * 3, upper_heights=(9.0,) * 3)
WORKSPACES = {
    "plain": Workspace(MACHINE, TALL),
    "conditioning": Workspace(MACHINE, replace(TALL, max_condition_number=3.0)),
    "box": Workspace(
        MACHINE, replace(TALL, box_lower=(-0.1, -0.12, 0.05), box_upper=(0.11, 0.1, 0.4))
    ),
    "cylinder": Workspace(MACHINE, replace(TALL, cylinder=Cylinder(0.01, -0.02, 0.11, 0.1, 0.45))),
}


@pytest.mark.parametrize("name", WORKSPACES)
def test_all_is_inside_within_the_free_way(name):
    workspace = WORKSPACES[name]
    rng = np.random.default_rng(1)
    free_ways, outside = [], 0
    for place in random_positions(MACHINE, rng, 400).tolist():
        heights = MACHINE.inverse(place)
        free_way = workspace.free_way(heights)
        if not is_inside(workspace, place):
            assert free_way < 0.0
            outside += 1
            continue
        free_ways.append(free_way)
        directions = rng.normal(size=(20, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, np.newaxis]
        for way in (heights + 0.9999 * free_way * directions).tolist():
            position = MACHINE.forward(way)
            if free_way > 2.0 * TOLERANCE:
                workspace.check_position(position)
    assert outside > 10
    assert np.median(free_ways) > 0.002


def test_free_way_without_a_pose_or_a_number():
    for heights in ((0.6, 5.0, 0.6), (np.nan, 0.6, 0.6)):
        assert WORKSPACE.free_way(heights) < 0.0


def test_a_path_is_proved_as_far_as_the_samples_go():
    start = SliderState(HOME, AT_REST, AT_REST)
    plan = at_once(SliderMotion().move(start, MACHINE.inverse((0.16, 0.0, 0.3)), LIMITS))
    acceleration = float(np.linalg.norm(np.abs(plan.sample(np.linspace(0.0, 1.0, 999))[3]).max(0)))
    arguments = plan.at, plan.duration, acceleration
    WORKSPACE.check_path(*arguments)
    assert at_once(WORKSPACE.path_proof(*arguments, 400))
    assert not at_once(WORKSPACE.path_proof(*arguments, 2))
    # A path that leaves the workspace is not proved, however many samples there are.
    narrow = Workspace(
        MACHINE, replace(DEFAULT_LIMITS, box_lower=(-1.0,) * 3, box_upper=(0.15, 1.0, 1.0))
    )
    assert not at_once(narrow.path_proof(*arguments, 4000))


def test_what_is_traced_in_pieces_looks_at_no_more_than_it_may_between_two_breaks():
    start = SliderState(HOME, AT_REST, AT_REST)
    plan = at_once(SliderMotion().move(start, MACHINE.inverse((0.16, 0.0, 0.3)), LIMITS))
    looks, between = 0, []

    def state(time):
        nonlocal looks
        looks += 1
        return plan.at(time)

    for _ in WORKSPACE.path_proof(state, plan.duration, 9.0, 400, in_piece=3):
        between.append(looks)
    # Both ends of the path are looked at besides.
    assert between[0] == 5
    assert set(np.diff(between)) == {3}
    assert len(between) > 3
