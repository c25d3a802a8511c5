"""Whether all places of a path are inside the workspace, between samples too."""

import math
from dataclasses import replace

import numpy as np
import pytest
from motion_machine import BOX, MACHINE, WORKSPACE, WORKSPACES
from soak import many
from strategies import DEFAULT_LIMITS, is_inside, random_geometry

from testing.path_samples import random_path
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import PathPlaceError, PlatformPath, check_place, clearances
from tri_glide_kinematics.tri_glide import TriGlide, UnreachableError
from tri_glide_kinematics.workspace import (
    TOLERANCE,
    ConditionField,
    OutsideWorkspaceError,
    Workspace,
    WorkspaceLimit,
)


def judged(path, workspace):
    """Return whether the check accepts a path; if not, its error has to name a place outside."""
    try:
        at_once(check_place(path.driven, workspace))
    except PathPlaceError as error:
        assert not is_inside(workspace, error.position)
        assert isinstance(error.__cause__, (OutsideWorkspaceError, UnreachableError))
        ends = path.segments.points
        assert 0 <= error.segment < len(ends) - 1
        assert str(error).startswith(f"segment {error.segment + 1} of the path: ")
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("name", WORKSPACES)
def test_a_path_is_accepted_just_where_all_of_it_is_inside(name):
    workspace = WORKSPACES[name]
    rng = np.random.default_rng(1)
    answers = []
    for _ in range(many(25)):
        centre = rng.uniform((-0.08, -0.08, 0.12), (0.08, 0.08, 0.42))
        path, _ = random_path(rng, int(rng.integers(1, 6)), centre=tuple(centre), size=0.05)
        driven = path.driven
        places = driven.derivatives(np.linspace(0.0, driven.length, 300), 0)[0].tolist()
        inside = all(is_inside(workspace, place) for place in places)
        accepted = judged(path, workspace)
        answers.append(accepted)
        assert accepted or not inside
        if accepted and not inside:
            # Then what is outside is nearer to the inside than the tolerance.
            known = clearances(workspace, np.array(places))
            assert min(known.slack.min(), known.travel.min()) >= -TOLERANCE
    assert 2 < sum(answers) < len(answers)


@pytest.mark.parametrize("beyond", [3e-4, 1e-3])
def test_what_is_outside_between_two_samples_is_found(beyond):
    # Two corners are inside; the tip between them is outside for a short way.
    workspace = WORKSPACES["box"]
    points = [(0.0, 0.0, 0.2), (-0.1 - beyond, 0.001, 0.2), (0.0, 0.002, 0.2)]
    path = PlatformPath.through(points)
    with pytest.raises(PathPlaceError, match="box in x") as caught:
        at_once(check_place(path.driven, workspace))
    assert caught.value.position[0] < -0.1
    assert caught.value.__cause__.limit is WorkspaceLimit.BOX_X


def test_the_rounding_of_a_corner_outside_is_inside():
    points = [(0.0, 0.0, 0.2), (-0.101, 0.05, 0.2), (0.0, 0.1 - 1e-4, 0.2)]
    assert not judged(PlatformPath.through(points), WORKSPACES["box"])
    assert judged(PlatformPath.through(points, 5e-3), WORKSPACES["box"])


def test_a_path_along_an_edge_is_accepted():
    box, cylinder = WORKSPACES["box"], WORKSPACES["cylinder"]
    along = [(-0.1, -0.05, 0.2), (-0.1, 0.05, 0.2), (-0.1, 0.05, 0.25), (-0.1, -0.05, 0.25)]
    assert judged(PlatformPath.through(along, 1e-3), box)
    assert judged(PlatformPath.through(along), box)
    start = PlatformPath.start((0.12, -0.02, 0.2))
    assert judged(start.arc_about((0.01, -0.02, 0.2), (0, 0, 1), 2.0 * math.pi), cylinder)
    outside = PlatformPath.start((0.12 + 3e-5, -0.02, 0.2))
    assert not judged(outside.arc_about((0.01, -0.02, 0.2), (0, 0, 1), 2.0 * math.pi), cylinder)


def test_beyond_reach_the_reason_is_that_of_the_workspace():
    path = PlatformPath.through([(0.0, 0.0, 0.25), (5.0, 0.0, 0.25)])
    with pytest.raises(PathPlaceError) as caught:
        at_once(check_place(path.driven, WORKSPACE))
    assert caught.value.segment == 0
    with pytest.raises(KinematicsError) as reason:
        WORKSPACE.check_position(caught.value.position)
    assert caught.value.reason == str(reason.value)


def test_a_path_into_the_rounding_of_a_bound_is_refused():
    """Its end has a condition number that is taken for rounding, alone; around it nothing is."""
    end = (0.1, 0.02, 0.25)
    condition = MACHINE.condition_number(end) / (1.0 + 1.5e-9)
    workspace = Workspace(MACHINE, replace(DEFAULT_LIMITS, max_condition_number=condition))
    workspace.check_position(end)
    with pytest.raises(PathPlaceError, match="too near the edge") as caught:
        at_once(check_place(PlatformPath.through([(0.0, 0.0, 0.25), end]).driven, workspace))
    assert caught.value.position == pytest.approx(end)


def test_a_workspace_that_is_widened_is_wider():
    place = (0.1105, 0.0, 0.25)
    path = PlatformPath.through([place, (0.0, 0.0, 0.25)])
    workspace = WORKSPACES["box"]
    assert not judged(path, workspace)
    assert judged(path, workspace.widened_to(MACHINE.inverse(place)))


def test_only_what_is_ahead_is_checked():
    path = PlatformPath.through([(0.3, 0.0, 0.25), (0.0, 0.0, 0.25), (0.0, 0.05, 0.25)])
    assert not judged(path, WORKSPACE)
    at_once(check_place(path.driven, WORKSPACE, start=0.25))


def test_clearances_are_those_of_one_place():
    rng = np.random.default_rng(2)
    for number in range(6):
        machine = TriGlide(random_geometry(rng, number < 3))
        heights = replace(DEFAULT_LIMITS, lower_heights=(0.1,) * 3, upper_heights=(1.2,) * 3)
        workspace = Workspace(machine, replace(heights, max_condition_number=5.0, **BOX))
        places = rng.uniform((-0.2, -0.2, 0.0), (0.2, 0.2, 0.5), (300, 3))
        known = clearances(workspace, places)
        field = ConditionField(machine.geometry, 5.0)
        bounds = workspace.bounds
        assert 5 < known.inside.sum() < 295
        for index, place in enumerate(places.tolist()):
            assert known.inside[index] == is_inside(workspace, place)
            if not known.inside[index]:
                continue
            around = field.around(place[0], place[1])
            assert known.radius[index] == pytest.approx(around.radius, rel=1e-9)
            assert known.slope[index] == pytest.approx(around.slope, rel=1e-9)
            assert known.slack[index] == pytest.approx(bounds.slack(place), abs=1e-14)
            travel = bounds.travel_slack(machine.inverse(place))
            assert known.travel[index] == pytest.approx(travel, abs=1e-13)


def test_no_slider_moves_farther_than_its_gain_says():
    rng = np.random.default_rng(3)
    places = rng.uniform((-0.1, -0.1, 0.15), (0.1, 0.1, 0.4), (200, 3))
    known = clearances(WORKSPACE, places)
    for index in np.flatnonzero(known.inside):
        step = rng.normal(size=(40, 3))
        step *= (
            known.radius[index]
            * rng.uniform(0.1, 1.0, (40, 1))
            / np.linalg.norm(step, axis=1, keepdims=True)
        )
        heights = MACHINE.inverse_batch(places[index] + step) - MACHINE.inverse(places[index])
        way = np.linalg.norm(step, axis=1)
        assert (np.abs(heights).max(axis=1) <= known.gain[index] * way + 1e-15).all()


def test_ten_thousand_segments_are_checked_in_small_pieces():
    angles = np.linspace(0.0, 50.0, 10_000)
    points = 0.02 * np.column_stack((np.cos(angles), np.sin(angles), 12.0 + angles / 50.0))
    driven = PlatformPath.through(points, 1e-4).driven
    assert sum(1 for _ in check_place(driven, WORKSPACE)) < 100


def test_a_circle_is_accepted_just_where_its_outermost_place_is_inside():
    workspace = WORKSPACES["box"]
    rng = np.random.default_rng(6)
    answers = []
    for _ in range(60):
        beyond, phase = float(rng.uniform(-1e-4, 2e-4)), float(rng.uniform(0.0, 2.0 * math.pi))
        radius = float(10.0 ** rng.uniform(-2.5, -1.1))
        centre = np.array((0.11 + beyond - radius, 0.0, 0.25))
        start = centre + radius * np.array((math.cos(phase), math.sin(phase), 0.0))
        start[0] = min(start[0], 0.11)
        if math.dist(start, centre) < radius * (1.0 - 1e-12):
            continue
        whole = PlatformPath.start(start).arc_about(tuple(centre), (0, 0, 1), 2.0 * math.pi)
        accepted = judged(whole, workspace)
        answers.append(accepted)
        assert accepted or beyond > 0.0
        assert not accepted or beyond <= TOLERANCE * (1.0 + 1e-3)
    assert 10 < sum(answers) < len(answers) - 10
