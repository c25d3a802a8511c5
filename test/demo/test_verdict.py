"""Whether a calibrated machine is judged as it should be, without any node."""

import numpy as np
import pytest

from tri_glide_kinematics.calibration.fit import plane_basis
from tri_glide_kinematics.demo.calibration_demo import (
    FIRST_START,
    NEAR,
    NOMINAL,
    PLATE,
    RADIUS,
    Errors,
    Judged,
    probe_start,
    ring,
    table,
    touch_places,
    verdict_figure,
    without_plane_motion,
    wrong_machine,
)
from tri_glide_kinematics.tri_glide import TriGlide

TARGETS = np.array([(x, y, PLATE) for x, y in [(0.0, 0.0), *ring(RADIUS, 6)]])
RNG = np.random.default_rng(4)


def judged(errors):
    return Judged(TARGETS, TARGETS + errors)


def verdict(size=1.0):
    """Return a verdict on errors that are ``size`` times as large as predicted."""
    errors = size * 1e-4 * RNG.choice([-1.0, 1.0], TARGETS.shape)
    predicted = np.full(TARGETS.shape, 1e-4)
    names = ("after", "after, in itself*")
    return [Errors("before", 10.0 * errors), *(Errors(each, errors, predicted) for each in names)]


def test_a_shift_and_a_turn_are_taken_out_and_nothing_else():
    rest = 1e-5 * RNG.standard_normal(TARGETS.shape)
    moved = plane_basis(TARGETS, (0.0, 0.0)) @ (1e-3, -2e-3, 5e-3)
    left = without_plane_motion(judged(moved + rest))
    assert left == pytest.approx(without_plane_motion(judged(rest)), abs=1e-12)
    assert left[:, 2] == pytest.approx(rest[:, 2])
    assert np.abs(without_plane_motion(judged(moved))).max() < 1e-12


@pytest.mark.parametrize(("size", "is_good"), [(0.5, True), (3.9, True), (4.2, False)])
def test_errors_may_be_as_large_as_predicted(size, is_good):
    assert [errors.is_good for errors in verdict(size)] == [True, is_good, is_good]


def test_the_table_shows_the_largest_errors():
    rows = [line.split() for line in table(verdict()).splitlines()[1:4]]
    assert [row[0] for row in rows] == ["x", "y", "z"]
    assert rows[0][1:] == ["1000.0", "100.0", "100.0", "100.0", "100.0"]


def test_the_picture_has_three_maps_and_three_rows_of_bars():
    figure = verdict_figure(TARGETS, verdict(), RADIUS)
    assert [axes.get_title().split("\n")[0] for axes in figure.axes] == [
        "before",
        "after",
        "after, in itself*",
        *(f"largest error in {letter}" for letter in "xyz"),
    ]
    # All but the layout, which takes most of the time.
    figure.set_layout_engine("none")
    figure.draw_without_rendering()


@pytest.mark.parametrize("count", [7, 10, 13])
def test_touches_are_in_different_places(count):
    places = touch_places(count)
    assert len(set(places)) == count
    assert max(np.hypot(*place) for place in places) == pytest.approx(RADIUS)


def test_each_seed_is_another_machine_and_always_the_same():
    assert (wrong_machine(1).vector == wrong_machine(1).vector).all()
    assert (wrong_machine(1).vector != wrong_machine(2).vector).all()
    assert np.abs(wrong_machine(1).vector - NOMINAL.vector).max() < 5e-3


@pytest.mark.parametrize("seed", range(20))
def test_a_probe_begins_a_little_above_the_plate_wherever_a_wrong_machine_believes_it(seed):
    machine = wrong_machine(seed)
    truth, drawing = TriGlide(machine.geometry), TriGlide(NOMINAL.geometry)
    found = []
    for x, y in touch_places(13):
        reported = np.subtract(truth.inverse((x, y, PLATE)), machine.height_offsets)
        place = drawing.forward(reported.tolist())
        way = probe_start(found, x, y) - place[2]
        assert 2e-4 < way < (2.0 * NEAR if len(found) > 2 else 2.0 * FIRST_START)
        found.append(place)
