"""Pictures of a four-bar linkage: curves, limits and extremes are drawn where they are."""

import math

import numpy as np
import pytest
from figure_checks import assert_equal_scales, lines_labelled, without_gaps
from strategies import nudged

from tri_glide_kinematics.mechanisms.four_bar import Branch, CrankLimitError, FourBar
from tri_glide_kinematics.mechanisms.pictures.four_bar import (
    angles_figure,
    coupler_curve_figure,
    crank_angles,
    interval_around,
)
from tri_glide_kinematics.mechanisms.pictures.skeleton import default_crank_angle

TEXTBOOK = FourBar(0.02, 0.07, 0.09, 0.06)
ONE_INTERVAL = FourBar(0.10, 0.07, 0.08, 0.12)
TWO_INTERVALS = FourBar(0.08, 0.03, 0.09, 0.10, ground_angle=0.4)
PARALLELOGRAM = FourBar(0.03, 0.08, 0.03, 0.08)
LIMITED = [ONE_INTERVAL, TWO_INTERVALS]
POINT = (0.035, 0.02)


def limits(linkage):
    return sorted(math.degrees(limit) for ends in linkage.crank_ranges for limit in ends)


@pytest.mark.parametrize("linkage", [TEXTBOOK, *LIMITED, PARALLELOGRAM])
def test_the_coupler_curve_keeps_its_distance_from_the_crank_pin(linkage):
    (axes,) = coupler_curve_figure(linkage, POINT).axes
    for branch in Branch:
        curves = lines_labelled(axes, f"path of P, {branch.value} branch")
        assert len(curves) == len(linkage.crank_ranges)
        for curve, angles in zip(curves, crank_angles(linkage)):
            pins = 1000.0 * linkage.crank * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            away = np.hypot(*(curve.get_xydata() - pins).T)
            np.testing.assert_allclose(away, 1000.0 * math.hypot(*POINT), rtol=1e-9)


@pytest.mark.parametrize("linkage", LIMITED)
def test_both_branches_of_the_coupler_curve_meet_at_the_limits(linkage):
    (axes,) = coupler_curve_figure(linkage, POINT).axes
    curves = (lines_labelled(axes, f"path of P, {branch.value}") for branch in Branch)
    for one, other in zip(*curves):
        for end in (0, -1):
            np.testing.assert_allclose(one.get_xydata()[end], other.get_xydata()[end], atol=1e-4)


def test_the_coupler_curve_has_equal_scales_and_units():
    for linkage in (TEXTBOOK, TWO_INTERVALS, FourBar(2.0, 7.0, 9.0, 6.0)):
        figure = coupler_curve_figure(linkage, POINT, Branch.CROSSED)
        assert_equal_scales(figure)
        unit = "m" if linkage.ground > 1.0 else "mm"
        assert figure.axes[0].get_xlabel() == f"x [{unit}]"
        assert figure.axes[0].get_ylabel() == f"y [{unit}]"


def test_the_linkage_is_drawn_with_its_lengths_at_the_crank_angle():
    crank_angle = math.radians(30.0)
    (axes,) = coupler_curve_figure(TEXTBOOK, POINT, Branch.OPEN, crank_angle).axes
    (plate,) = axes.patches
    crank_pin, rocker_pin, point = plate.get_xy()[:3]
    np.testing.assert_allclose(crank_pin, [20.0 * math.cos(crank_angle), 10.0], atol=1e-9)
    rocker = rocker_pin - [60.0, 0.0]
    assert math.degrees(math.atan2(rocker[1], rocker[0])) == pytest.approx(117.286068, abs=1e-6)
    assert np.hypot(*(point - crank_pin)) == pytest.approx(1000.0 * math.hypot(*POINT))
    assert "at crank angle 30.00°, open branch" in axes.get_title()


def test_a_linkage_given_by_its_joints_is_drawn_as_it_was_given():
    joints = ((0.0, 0.0), (0.065183, 0.045552), (0.028332, 0.046047), (-0.074783, 0.004195))
    linkage = FourBar.from_joints(*joints)
    (axes,) = coupler_curve_figure(linkage, (0.0, 0.0), linkage.assembled_branch).axes
    places = axes.patches[0].get_xy()[:2]
    np.testing.assert_allclose(places, 1000.0 * np.array(joints[1:3]), atol=1e-9)


@pytest.mark.parametrize("linkage", LIMITED)
def test_a_crank_angle_beyond_the_limits_is_refused(linkage):
    beyond = math.radians(limits(linkage)[-1]) + 0.01
    with pytest.raises(CrankLimitError):
        coupler_curve_figure(linkage, POINT, Branch.OPEN, beyond)
    with pytest.raises(CrankLimitError):
        interval_around(linkage, beyond)


def test_the_angles_of_the_textbook_are_on_the_curves():
    upper, _ = angles_figure(TEXTBOOK).axes
    for name, angle in {
        "coupler, open": 88.837241,
        "rocker, open": 117.286068,
        "coupler, crossed": -115.210812,
        "rocker, crossed": -143.659639,
    }.items():
        (curve,) = lines_labelled(upper, name)
        points = without_gaps(curve)
        at = np.argmin(np.abs(points[:, 0] - 30.0))
        np.testing.assert_allclose(points[at], [30.0, angle], atol=1e-6)


def test_the_transmission_angle_and_its_extremes_are_drawn():
    _, lower = angles_figure(TEXTBOOK).axes
    (curve,) = lines_labelled(lower, "both branches")
    crank, transmission = np.radians(curve.get_xydata()).T
    # The law of cosines in the two triangles over the diagonal.
    diagonal = 2.0**2 + 6.0**2 - 2.0 * 2.0 * 6.0 * np.cos(crank)
    expected = np.arccos((7.0**2 + 9.0**2 - diagonal) / (2.0 * 7.0 * 9.0))
    np.testing.assert_allclose(transmission, expected, atol=1e-9)
    (smallest,), (largest,) = (
        lines_labelled(lower, name) for name in ("smallest: 25.21°", "largest: 58.41°")
    )
    low, high = math.degrees(math.acos(114.0 / 126.0)), math.degrees(math.acos(66.0 / 126.0))
    np.testing.assert_allclose(smallest.get_xydata(), [[0.0, low], [360.0, low]], atol=1e-9)
    np.testing.assert_allclose(largest.get_xydata(), [[180.0, high]], atol=1e-9)


@pytest.mark.parametrize("linkage", LIMITED)
def test_extremes_at_limits_are_marked_at_all_of_them(linkage):
    _, lower = angles_figure(linkage).axes
    (largest,) = lines_labelled(lower, "largest: 180.00°")
    ends = limits(linkage)
    np.testing.assert_allclose(largest.get_xdata(), [ends[0], ends[-1]], atol=1e-9)


@pytest.mark.parametrize("linkage", LIMITED)
def test_the_limits_of_the_crank_are_marked(linkage):
    for axes in angles_figure(linkage).axes:
        marks = lines_labelled(axes, "limits of the crank")
        np.testing.assert_allclose([mark.get_xdata()[0] for mark in marks], limits(linkage))
        low, high = axes.get_xlim()
        assert low < limits(linkage)[0] and limits(linkage)[-1] < high


@pytest.mark.parametrize("linkage", [TEXTBOOK, PARALLELOGRAM])
def test_a_crank_that_turns_fully_has_no_limits(linkage):
    for axes in angles_figure(linkage).axes:
        assert not lines_labelled(axes, "limits of the crank")
        assert axes.get_xlim() == (0.0, 360.0)


@pytest.mark.parametrize("linkage", [TEXTBOOK, *LIMITED, PARALLELOGRAM])
def test_curves_reach_the_limits_and_never_jump(linkage):
    upper, lower = angles_figure(linkage).axes
    for axes in (upper, lower):
        assert "[°]" in axes.get_ylabel()
        assert axes is upper or axes.get_xlabel() == "crank angle [°]"
    ends = np.array(limits(linkage)).reshape(-1, 2)
    curves = [line for line in lower.lines if line.get_label() == "both branches"]
    assert len(curves) == len(ends)
    for curve, (low, high) in zip(curves, ends):
        points = curve.get_xydata()
        assert not np.isnan(points).any()
        assert points[-1, 0] - points[0, 0] == pytest.approx(high - low)
    for line in upper.lines:
        if line.get_label().startswith(("coupler", "rocker")):
            assert np.nanmax(np.abs(np.diff(line.get_ydata()))) < 10.0


@pytest.mark.parametrize("linkage", [TEXTBOOK, *LIMITED, PARALLELOGRAM])
def test_the_default_crank_angle_can_be_reached(linkage):
    crank_angle = default_crank_angle(linkage)
    assert len(linkage.solve(crank_angle)) == 2
    angles = interval_around(linkage, crank_angle)
    turns = np.round((angles.mean() - crank_angle) / math.tau)
    assert angles[0] < crank_angle + turns * math.tau < angles[-1]


@pytest.mark.parametrize("linkage", LIMITED)
def test_a_limit_belongs_to_its_interval(linkage):
    rng = np.random.default_rng(1)
    for ends in linkage.crank_ranges:
        for limit in ends:
            for angle in nudged(rng, [limit] * 20).tolist():
                assert interval_around(linkage, angle)[[0, -1]] == pytest.approx(ends)
