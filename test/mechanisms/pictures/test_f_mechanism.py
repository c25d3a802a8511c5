"""Pictures of an F-mechanism: what is drawn is where the mechanism can be, and all of it."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from f_mechanism_samples import bifurcating_mechanism
from figure_checks import assert_equal_scales, lines_labelled, without_gaps
from strategies import nudged

from tri_glide_kinematics.mechanisms.f_mechanism import EventKind, FMechanism
from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
    FEWEST_SAMPLES,
    angle_figure,
    angle_that_is_drawn,
    branch_through,
    corners_figure,
    describe,
    detailed_overview,
    evenly,
    paths_figure,
    positions_figure,
)
from tri_glide_kinematics.mechanisms.pictures.skeleton import BranchCurve

LENGTHS = {
    "base": [[0.0, 0.0], [0.0525, 0.008], [0.040, 0.099]],
    "crank_lengths": [0.019, 0.014, 0.016],
    "rod_lengths": [0.035, 0.034, 0.054],
    "platform": [[0.0, 0.0], [0.040, 0.018], [-0.007, 0.028]],
    "phase_b": math.radians(243.0),
    "phase_c": math.radians(-15.0),
    "counter_rotating": True,
}
# Source 001, example 2, and the same with the platform frame turned so that phi passes 180 degrees.
EXAMPLE = FMechanism(**LENGTHS)
TURN = math.radians(-215.0)
ROTATION = [[math.cos(TURN), math.sin(TURN)], [-math.sin(TURN), math.cos(TURN)]]
TURNED = FMechanism(**{**LENGTHS, "platform": np.array(LENGTHS["platform"]) @ ROTATION})
# A mechanism whose only branch moves the crank by five degrees.
ISLAND = FMechanism(
    base=[[-0.08, -0.94], [-0.15, 0.48], [0.16, 0.65]],
    crank_lengths=[0.45, 0.38, 0.45],
    rod_lengths=[0.59, 0.54, 0.5],
    platform=[[-0.09, -0.1], [-0.28, 0.36], [-0.34, -0.54]],
    phase_b=-0.28,
    phase_c=-0.78,
    counter_rotating=True,
)
PRINTED_ANGLES = (-75.688, -55.562, -18.443, -0.982)
PRINTED_AT = math.radians(146.0)


@pytest.fixture(scope="module")
def overview():
    return detailed_overview(EXAMPLE)


@pytest.mark.parametrize("mechanism", [EXAMPLE, TURNED, ISLAND])
def test_the_angle_figure_draws_every_branch_and_nothing_else(mechanism):
    overview = detailed_overview(mechanism)
    figure = angle_figure(overview)
    curves = lines_labelled(figure.axes[0], "branch ")
    assert len(curves) == len(overview.branches)
    drawn = np.concatenate([without_gaps(curve) for curve in curves])

    # Nothing else: every point that is drawn is a position of the mechanism, folds included.
    poses = np.degrees(mechanism.poses_batch(np.radians(drawn[:, 0])).angle)
    away = np.abs((poses - drawn[:, 1:] + 180.0) % 360.0 - 180.0)
    assert np.nanmin(away, axis=1).max() < 1e-6

    # All of it: at each crank angle of the grid, every position is a point of a curve.
    crank_angles = np.radians(np.arange(0.0, 360.0, 0.25))
    poses = np.degrees(mechanism.poses_batch(crank_angles).angle)
    row, slot = np.nonzero(~np.isnan(poses))
    wanted = np.stack([np.degrees(crank_angles[row]), poses[row, slot]], axis=1)
    for place in wanted[:: max(1, len(wanted) // 200)]:
        nearest = np.min(np.hypot(*(drawn - place).T))
        assert nearest < (1e-6 if mechanism is not ISLAND else 0.1)


@pytest.mark.parametrize("mechanism", [EXAMPLE, TURNED])
def test_no_line_is_drawn_across_the_picture_where_an_angle_wraps(mechanism):
    figure = angle_figure(detailed_overview(mechanism))
    for curve in lines_labelled(figure.axes[0], "branch "):
        steps = np.abs(np.diff(curve.get_xydata(), axis=0))
        assert np.nanmax(steps[:, 0]) < 1.0
        assert np.nanmax(steps[:, 1]) < 10.0
    low, high = figure.axes[0].get_ylim()
    wraps = mechanism is TURNED
    assert ((low, high) == (-180.0, 180.0)) is wraps


def test_the_turning_points_are_marked_where_they_are(overview):
    (marks,) = lines_labelled(angle_figure(overview).axes[0], "turning point")
    places = marks.get_xydata()
    assert marks.get_label() == "turning point (4)"
    np.testing.assert_allclose(places[:, 0], [135.044, 169.594, 250.223, 294.189], atol=1e-3)
    for crank_angle in places[:, 0]:
        # Two positions on one side of a turning point merge in it, and are gone on the other.
        counts = {len(EXAMPLE.poses(math.radians(crank_angle + side))) for side in (-0.01, 0.01)}
        assert counts == {2, 4}


def test_a_bifurcation_is_marked_once():
    rng = np.random.default_rng(1)
    bifurcating_mechanism(rng)
    mechanism, crank_angle, (angle, _) = bifurcating_mechanism(rng)
    axes = angle_figure(detailed_overview(mechanism)).axes[0]
    (marks,) = lines_labelled(axes, "bifurcation")
    expected = [[math.degrees(crank_angle) % 360.0, math.degrees(angle)]]
    np.testing.assert_allclose(marks.get_xydata(), expected, atol=1e-4)


def test_the_number_of_positions_is_drawn_below(overview):
    lower = angle_figure(overview).axes[1]
    crank_angles, counts = lower.lines[0].get_data()
    for crank_angle, count in zip(crank_angles[::37], counts[::37]):
        assert len(EXAMPLE.poses(math.radians(crank_angle))) == count
    assert set(counts) == {2, 4}


def test_a_self_motion_is_marked(overview):
    at = np.zeros(len(overview.crank_angles), dtype=bool)
    at[[10, 20]] = True
    for axes in angle_figure(replace(overview, self_motion=at)).axes:
        marks = lines_labelled(axes, "self-motion")
        assert [line.get_xdata()[0] for line in marks] == pytest.approx([2.5, 5.0])


@pytest.mark.slow
def test_the_axes_have_units_and_planes_have_equal_scales(overview):
    upper, lower = angle_figure(overview).axes
    assert upper.get_ylabel() == "platform angle φ [°]"
    assert lower.get_xlabel() == "crank angle [°]"
    assert lower.get_xlim() == (0.0, 360.0)
    planes = [
        paths_figure(EXAMPLE, overview, 0),
        positions_figure(EXAMPLE, overview, PRINTED_AT),
        corners_figure(EXAMPLE, overview, PRINTED_AT),
    ]
    for figure in planes:
        assert_equal_scales(figure)
        assert {axes.get_xlabel() for axes in figure.axes} <= {"x [mm]", ""}
        assert figure.axes[-1].get_xlabel() == "x [mm]"
        assert figure.axes[0].get_ylabel() == "y [mm]"


@pytest.mark.parametrize("number", [0, 1])
def test_the_paths_are_those_of_one_platform(overview, number):
    (axes,) = paths_figure(EXAMPLE, overview, number, triangles=7).axes
    a, b, c = (line.get_xydata() for line in lines_labelled(axes, "path of "))
    np.testing.assert_allclose(np.hypot(*(b - a).T), math.hypot(40.0, 18.0), atol=1e-6)
    np.testing.assert_allclose(np.hypot(*(c - a).T), math.hypot(7.0, 28.0), atol=1e-6)
    # The path closes but for one step.
    assert np.hypot(*(a[0] - a[-1])) < 1.0
    triangles = [line for line in axes.lines if len(line.get_xdata()) == 4]
    assert len(triangles) == 7
    assert f"branch {number + 1}: {describe(overview.branches[number])}" in axes.get_title()


def test_the_positions_figure_shows_the_printed_positions(overview):
    figure = positions_figure(EXAMPLE, overview, PRINTED_AT)
    titles = [axes.get_title() for axes in figure.axes]
    angles = [float(re.match(r"φ = (.*)°", title)[1].replace("−", "-")) for title in titles]
    assert angles == list(PRINTED_ANGLES)
    assert [title[-8:] for title in titles] == ["branch 1"] * 3 + ["branch 2"]
    for axes, pose in zip(figure.axes, EXAMPLE.poses(PRINTED_AT)):
        np.testing.assert_allclose(
            axes.patches[0].get_xy()[:3], 1000.0 * np.array(pose.platform_joints)
        )


@pytest.mark.parametrize("mechanism", [EXAMPLE, TURNED, ISLAND])
def test_by_default_the_positions_figure_shows_as_many_positions_as_there_can_be(mechanism):
    overview = detailed_overview(mechanism)
    crank_angle = angle_that_is_drawn(overview)
    count = len(mechanism.poses(crank_angle))
    assert count == overview.counts.max()
    assert len(positions_figure(mechanism, overview, crank_angle).axes) == count


def test_unused_panels_of_the_positions_figure_are_hidden(overview, monkeypatch):
    poses = EXAMPLE.poses(PRINTED_AT)
    monkeypatch.setattr(FMechanism, "poses", lambda *_: (*poses, poses[0]))
    figure = positions_figure(EXAMPLE, overview, PRINTED_AT)
    assert [axes.axison for axes in figure.axes] == [True] * 5 + [False]


def test_the_corners_figure_shows_all_branches_and_the_positions(overview):
    (axes,) = corners_figure(EXAMPLE, overview, PRINTED_AT).axes
    for corner in "ABC":
        assert len(lines_labelled(axes, f"${corner}_2$, branch ")) == len(overview.branches)
    platforms = lines_labelled(axes, "platform at 146.00°, branch ")
    assert len(platforms) == 4
    assert [line.get_linestyle() for line in platforms] == ["-", "-", "-", "--"]


def test_each_position_is_put_on_its_branch(overview):
    for number, branch in enumerate(overview.branches):
        for index in range(5, len(branch.angle), 97):
            assert branch_through(overview, branch.pose(index)) == number


def test_a_short_branch_is_followed_again_with_closer_samples():
    (coarse,) = ISLAND.overview(1440).branches
    (branch,) = detailed_overview(ISLAND).branches
    assert len(coarse.angle) < 50 < FEWEST_SAMPLES <= len(branch.angle)
    assert branch.closed
    expected = sorted(event.crank_angle for event in coarse.turning_points)
    found = sorted(event.crank_angle for event in branch.turning_points)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_positions_are_spread_evenly(overview):
    turning, full = (BranchCurve.of(branch) for branch in overview.branches)
    shown = evenly(full, 36)
    assert len(shown) == 36
    np.testing.assert_allclose(np.diff(full.crank_angle[shown]), math.radians(10.0), atol=5e-3)
    shown = evenly(turning, 50)
    assert len(shown) == 50
    crank, angle = turning.crank_angle[shown], np.unwrap(turning.angle[shown])
    steps = np.abs(np.diff(crank)) + np.abs(np.diff(angle))
    assert steps.max() < 2.0 * steps.mean()


def test_even_positions_do_not_hang_on_rounding(overview):
    rng = np.random.default_rng(6)
    full = BranchCurve.of(overview.branches[1])
    # The places of two successive positions are one where an event lies on a sample.
    crank_angle = np.insert(full.crank_angle, [1, 500], full.crank_angle[[0, 499]])
    angle = np.insert(full.angle, [1, 500], full.angle[[0, 499]])
    expected = evenly(replace(full, crank_angle=crank_angle, angle=angle), 36)
    assert len(expected) == 36
    for _ in range(50):
        curve = replace(full, crank_angle=nudged(rng, crank_angle), angle=angle)
        assert evenly(curve, 36) == expected


def test_a_bifurcation_at_the_start_of_a_turn_is_marked_once(overview):
    branch = overview.branches[0]
    event = replace(branch.turning_points[0], kind=EventKind.BIFURCATION)
    for crank_angle in (1e-16, -1e-16, math.tau, math.nextafter(math.tau, 0.0)):
        poses = [replace(event.pose, crank_angle=at) for at in (0.0, crank_angle)]
        drawn = replace(branch, events=tuple(replace(event, pose=pose) for pose in poses))
        (marks,) = lines_labelled(
            angle_figure(replace(overview, branches=(drawn,))).axes[0], "bifurcation (1)"
        )
        assert marks.get_xdata()[0] == pytest.approx(0.0, abs=1e-12)


def test_a_position_on_two_branches_is_put_on_the_first(overview):
    rng = np.random.default_rng(7)
    branch = overview.branches[0]
    near = replace(branch, crank_angle=nudged(rng, branch.crank_angle))
    for branches in ((near, branch), (branch, near)):
        crossing = replace(overview, branches=branches)
        for index in range(5, len(branch.angle), 97):
            assert branch_through(crossing, branch.pose(index)) == 0


def test_events_stand_at_their_places_in_a_curve(overview):
    curve = BranchCurve.of(overview.branches[0])
    for event in overview.branches[0].turning_points:
        (at,) = np.flatnonzero(curve.crank_angle == event.crank_angle)
        before, after = curve.crank_angle[[at - 1, at + 1]] - event.crank_angle
        assert before * after > 0.0
        np.testing.assert_allclose(curve.points[at, 6:], event.pose.platform_joints)
    # Rods keep their lengths at samples and events alike.
    rods = np.linalg.norm(curve.points[:, 6:] - curve.points[:, 3:6], axis=-1)
    np.testing.assert_allclose(rods, np.tile([0.035, 0.034, 0.054], (len(rods), 1)), atol=1e-12)


def test_branches_are_described(overview):
    assert [describe(branch) for branch in overview.branches] == ["4 turning points", "turns fully"]
    branch = overview.branches[0]
    *before, last = branch.events
    ended = replace(branch, events=(*before, replace(last, kind=EventKind.END)))
    assert describe(ended) == "4 turning points, not closed"


def test_singular_positions_are_marked(overview):
    branch = overview.branches[0]
    *before, last = branch.events
    ended = replace(branch, events=(*before, replace(last, kind=EventKind.SINGULAR)))
    assert describe(ended) == "4 turning points, ends in a singular position"
    isolated = EXAMPLE.poses(1.0)[0]
    drawn = replace(
        overview, branches=(ended, overview.branches[1]), singular_poses=(isolated, isolated)
    )
    (marks,) = lines_labelled(angle_figure(drawn).axes[0], "singular position (2)")
    places = [
        (math.degrees(pose.crank_angle) % 360.0, math.degrees(pose.angle))
        for pose in (last.pose, isolated)
    ]
    np.testing.assert_allclose(marks.get_xydata(), sorted(places), atol=1e-5)
