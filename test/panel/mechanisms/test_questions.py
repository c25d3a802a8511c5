"""Positions and branches of the mechanisms of the files, with the numbers that a person changes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tri_glide_kinematics.mechanisms import load_mechanism
from tri_glide_kinematics.panel.mechanisms.tab import example_files, shown_of

CONFIG = Path(__file__).parents[3] / "config"
FILES = example_files(CONFIG)


def shown_with_values(name):
    shown = shown_of(FILES[name])
    return shown, [item.value for item in shown.dimensions]


def lengths_of(shown, position):
    lines = shown.skeleton.lines(position.points)
    return np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)


def test_the_planar_mechanisms_of_the_folder_are_found():
    assert list(FILES) == [
        "f_mechanism_example_1",
        "f_mechanism_example_2",
        "four_bar_sheet",
        "four_bar_textbook",
    ]
    assert shown_of(load_mechanism(CONFIG / "landing_gear.yaml")) is None
    assert example_files(CONFIG / "nowhere") == {}


def test_a_four_bar_is_asked_and_drawn_as_the_textbook_says():
    shown, values = shown_with_values("four_bar_textbook")
    positions = shown.positions(values, math.radians(30.0))
    assert [position.text.split(",")[0] for position in positions] == ["open", "crossed"]
    for position in positions:
        assert lengths_of(shown, position)[:3] == pytest.approx([0.02, 0.09, 0.07])
        crank_pivot, crank_pin, rocker_pin, rocker_pivot, point = position.points
        assert np.array([crank_pivot, rocker_pivot]) == pytest.approx(shown.pivots(values))
        along, across = 0.035, 0.02
        way = (rocker_pin - crank_pin) / 0.07
        left = np.array([-way[1], way[0]])
        assert point == pytest.approx(crank_pin + along * way + across * left)
    # A textbook's number: the open coupler at 88.837241 degrees.
    _, crank_pin, rocker_pin, *_ = positions[0].points
    assert math.degrees(math.atan2(*(rocker_pin - crank_pin)[::-1])) == pytest.approx(88.837241)


def test_the_sheet_starts_in_the_position_that_is_given():
    shown, values = shown_with_values("four_bar_sheet")
    assert math.degrees(shown.crank_angle) == pytest.approx(34.947102)
    positions = shown.positions(values, shown.crank_angle)
    crossed = positions[round(shown.key)]
    assert crossed.points[2] == pytest.approx([0.028332, 0.046047])
    assert shown.pivots(values)[1] == pytest.approx([-0.074783, 0.004195])


def test_a_limited_crank_is_traced_from_limit_to_limit():
    shown, values = shown_with_values("four_bar_sheet")
    branch = shown.branch(values, shown.crank_angle, shown.key)
    low, high = FILES["four_bar_sheet"].mechanism.crank_ranges[1]
    assert not branch.track.closed
    assert branch.track.crank_angles[[0, -1]] == pytest.approx([low, high])
    limits = [mark for mark in branch.marks if mark.kind == "The crank gets no farther"]
    assert [mark.label for mark in limits] == ["29.61°", "119.3°"]
    # Coupler and rocker are in line there: the rocker pin is as far from the crank pin as can be.
    for mark, row in zip(limits, (0, -1)):
        crank_pin = 0.079522 * np.exp(1j * branch.track.crank_angles[row])
        rocker_pin, pivot = complex(*mark.place), complex(-0.074783, 0.004195)
        turn = (rocker_pin - crank_pin) / (rocker_pin - pivot)
        assert turn.imag == pytest.approx(0.0, abs=1e-3)
    assert "does not turn fully" in branch.text
    assert "The crank gets no farther at 29.61°, 119.3°." in branch.events


def test_the_other_range_of_a_limited_crank_is_traced_in_it():
    shown, values = shown_with_values("four_bar_sheet")
    low, high = FILES["four_bar_sheet"].mechanism.crank_ranges[0]
    middle = 0.5 * (low + high)
    branch = shown.branch(values, middle + math.tau, 0.0)
    assert branch.track.crank_angles[[0, -1]] == pytest.approx([low, high])
    # On the limit itself, seen from either side.
    for start in (low, high, low + 1e-15, high - 1e-15):
        angles = shown.branch(values, start, 0.0).track.crank_angles
        assert angles[0] == pytest.approx(low)


def test_a_full_crank_is_traced_once_around_and_the_rocker_turns_back_twice():
    shown, values = shown_with_values("four_bar_textbook")
    branch = shown.branch(values, shown.crank_angle, 0.0)
    assert branch.track.closed
    curve, pins = (branch.points[:, index] for index in shown.paths)
    assert curve[0] == pytest.approx(curve[-1])
    assert len(branch.marks) == 2
    # There the rocker is at an end of its way: the pins farthest apart are the marks.
    ends = np.array([mark.place for mark in branch.marks])
    way = np.linalg.norm(pins[:, None, :] - pins[None, :, :], axis=2)
    assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(way.max(), rel=1e-4)


def test_a_branch_of_the_f_mechanism_is_followed_through_its_turning_points():
    shown, values = shown_with_values("f_mechanism_example_2")
    start = math.radians(146.0)
    turning = shown.branch(values, start, math.radians(-75.7))
    assert turning.track.closed
    assert "cannot turn fully" in turning.text
    assert len(turning.marks) == 4
    # There, and nowhere else, the crank turns back.
    angles = turning.track.crank_angles
    turns = np.flatnonzero(np.diff(angles)[:-1] * np.diff(angles)[1:] < 0.0) + 1
    marked = {round(mark.crank_angle, 9) for mark in turning.marks}
    assert {round(math.remainder(angles[row], math.tau), 9) for row in turns} == {
        round(math.remainder(angle, math.tau), 9) for angle in marked
    }
    labels = {mark.label for mark in turning.marks}
    assert labels == {"169.6°", "135°", "-109.8°", "-65.81°"}
    full = shown.branch(values, start, math.radians(-0.98))
    assert "The cranks turn fully" in full.text
    assert not full.marks
    assert full.track.crank_angles[-1] - start == pytest.approx(math.tau)


def test_the_keys_of_a_track_are_those_of_the_positions():
    shown, values = shown_with_values("f_mechanism_example_2")
    branch = shown.branch(values, math.radians(146.0), math.radians(-75.7))
    source = np.random.default_rng(3)
    for place in source.uniform(0.0, branch.track.end, 60):
        positions = shown.positions(values, branch.track.crank_angle(place))
        keys = [position.key for position in positions]
        distances = [shown.distance(key, branch.track.key(place)) for key in keys]
        assert min(distances) < math.radians(0.5)


def test_changed_numbers_are_those_of_the_mechanism():
    shown, _ = shown_with_values("four_bar_textbook")
    linkage = shown.linkage([0.1, 0.2, 0.3, 0.35, 0.5, 0.6])
    assert (linkage.crank, linkage.coupler, linkage.rocker) == (0.1, 0.2, 0.3)
    assert linkage.ground == 0.35
    shown, _ = shown_with_values("f_mechanism_example_2")
    values = [0.1 * n for n in range(1, 9)]
    mechanism = shown.mechanism(values)
    linkage = mechanism.linkage
    assert [*linkage.cranks, *linkage.rods] == pytest.approx(values[:6])
    assert (mechanism.phase_b, mechanism.phase_c) == pytest.approx((0.7, 0.8))
    assert linkage.speeds[1] < 0.0, "it is counter-rotating"


@pytest.mark.parametrize("name", FILES)
def test_what_a_slider_shows_is_what_it_reads(name):
    shown, _ = shown_with_values(name)
    for item in shown.dimensions:
        assert item.lowest < item.value < item.highest
        assert item.read(item.shown(item.value)) == pytest.approx(item.value)
        assert item.unit == ("deg" if item.is_angle else "mm")
    assert shown.positions([item.value for item in shown.dimensions], shown.crank_angle)
