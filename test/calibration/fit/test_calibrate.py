"""Calibrations of machines that are known: found, left as assumed, and the same again."""

import numpy as np
import pytest
from soak import many
from strategies import nudged

from testing.wrong_machines import IN_RINGS, NOMINAL, PLACES, TOUCH, WRONG_BY, WrongMachine, drawn
from tri_glide_kinematics import calibrate
from tri_glide_kinematics.calibration.fit import (
    PARAMETER_NAMES,
    MachineParameters,
    MeasuredPosition,
    Plate,
    Priors,
    Region,
    Touch,
    rotation_by,
)
from tri_glide_kinematics.tri_glide import TriGlideGeometry

GEOMETRY = NOMINAL.geometry
FREE = {"shifting along x", "shifting along y", "turning about z"}


def positions_all_over(machine, rng, frame="base", levels=(0.0, 0.1)):
    places = [(x, y, z) for x, y in PLACES for z in levels]
    return [machine.position(place, rng, frame) for place in places]


def test_a_machine_with_unequal_arms_is_found_from_an_equally_unequal_drawing():
    rng = np.random.default_rng(2)
    drawing = MachineParameters(
        TriGlideGeometry([(0.02, 0.22), (-0.19, -0.08), (0.16, -0.12)], (0.42, 0.38, 0.45)),
        (0.01, -0.02, 0.005),
    )
    machine = WrongMachine.random(rng, drawing)
    result = calibrate(
        drawing.geometry,
        positions=positions_all_over(machine, rng),
        priors=WRONG_BY,
        height_offsets=drawing.height_offsets,
    )
    error = result.machine.vector - machine.parameters.vector
    assert error @ np.linalg.solve(result.covariance, error) < 40.0
    assert np.abs(error).max() < np.abs(drawing.vector - machine.parameters.vector).max()


def test_plates_and_frames_that_are_not_known_are_found_too():
    machine, rng = drawn(3)
    surface = (0.012, 0.003, -0.002)
    plate = Plate("bed", None, None)
    touches = [machine.touch(x, y, rng, plate, surface) for x, y in PLACES]
    turn, shift = rotation_by(np.array([2.0, -1.0, 0.7])), np.array([0.3, -0.2, 0.9])
    seen = []
    for one in positions_all_over(machine, rng, "camera"):
        place = tuple((turn @ one.position + shift).tolist())
        seen.append(MeasuredPosition(one.heights, place, "camera", one.standard_deviation))
    result = calibrate(GEOMETRY, touches, seen, machine.one_distance(rng), WRONG_BY)
    assert result.outliers == () and FREE <= set(result.unidentified)
    fitted = result.plates["bed"]
    # The height goes with the offsets, of which only the priors know.
    assert fitted.height == pytest.approx(surface[0], abs=3e-3)
    assert fitted.tilt == pytest.approx(surface[1:], abs=5e-4)
    frame = result.frames["camera"]
    assert np.linalg.norm(frame.rotation @ turn.T - np.eye(3)) < 0.02
    np.testing.assert_allclose(frame.shift, shift, atol=5e-3)
    np.testing.assert_allclose(frame.rotation @ frame.rotation.T, np.eye(3), atol=1e-12)


def test_what_is_not_determined_stays_exactly_as_assumed():
    machine, rng = drawn(4)
    for priors in (WRONG_BY, None):
        result = calibrate(GEOMETRY, machine.touches(rng), priors=priors)
        assert {*FREE, "the common scale of anchors and arms"} <= set(result.unidentified)
        change = result.machine.vector - NOMINAL.vector
        assert np.abs(change).max() > 1e-4
        # Neither a shift of all anchors, nor a turn: to rounding, not to a small number.
        assert np.abs(change[:6].reshape(3, 2).sum(axis=0)).max() < 1e-12
        anchors = np.array(GEOMETRY.anchors)
        turn = (anchors[:, 0] * change[1:6:2] - anchors[:, 1] * change[0:6:2]).sum()
        assert abs(turn) < 1e-12


def test_the_same_data_again_change_nothing():
    machine, rng = drawn(5)
    touches, distances = machine.touches(rng), machine.one_distance(rng)
    first = calibrate(GEOMETRY, touches, (), distances, WRONG_BY)
    again = calibrate(
        first.geometry, touches, (), distances, first.priors, height_offsets=first.height_offsets
    )
    np.testing.assert_array_equal(again.machine.vector, first.machine.vector)
    # Without priors the result itself is what is assumed the next time: below a hundredth of what
    # a micrometre screw can show, and nothing after ten times.
    first = calibrate(GEOMETRY, touches, (), distances, None)
    result = first
    for _ in range(10):
        offsets = result.height_offsets
        result = calibrate(result.geometry, touches, (), distances, None, height_offsets=offsets)
    assert np.abs(result.machine.vector - first.machine.vector).max() < 1e-6
    assert np.abs(machine.errors(result.machine) - machine.errors(first.machine)).max() < 1e-8


def test_without_noise_and_error_nothing_is_changed():
    machine = WrongMachine(NOMINAL)
    touches = [Touch(machine.reported((x, y, 0.0)), Plate(), TOUCH) for x, y in PLACES]
    result = calibrate(GEOMETRY, touches)
    np.testing.assert_allclose(result.machine.vector, NOMINAL.vector, atol=1e-12)
    assert result.chi_squared < 1e-9
    assert any("better than stated" in warning for warning in result.warnings)


def test_last_bits_of_the_data_change_no_word():
    machine, rng = drawn(6)
    touches, distances = machine.touches(rng), machine.one_distance(rng)
    result = calibrate(GEOMETRY, touches, (), distances)
    for _ in range(many(3)):
        nearby = [Touch(tuple(nudged(rng, one.heights)), one.plate, TOUCH) for one in touches]
        again = calibrate(GEOMETRY, nearby, (), distances)
        assert again.unidentified == result.unidentified
        for one, other in zip(again.next_points(3), result.next_points(3)):
            np.testing.assert_allclose(one.places, other.places, atol=1e-9)
        np.testing.assert_allclose(again.machine.vector, result.machine.vector, atol=1e-11)


def test_uncertainties_are_infinite_where_nothing_is_known():
    machine, rng = drawn(7)
    touches = machine.touches(rng, IN_RINGS)
    result = calibrate(GEOMETRY, touches, (), machine.one_distance(rng), None)
    deviations = dict(zip(PARAMETER_NAMES, result.standard_deviations))
    assert all(np.isinf(deviations[name]) == name.startswith("anchor") for name in deviations)
    x, y, z = result.position_uncertainty((0.02, 0.03, 0.1))
    assert np.isinf(x) and np.isinf(y) and z < 2e-5
    aligned = result.position_uncertainty((0.02, 0.03, 0.1), aligned=True)
    assert max(aligned) < 2e-4
    assert (result.position_uncertainties_before([(0.0, 0.0, 0.0)]) == np.inf).all()


def test_uncertainty_shrinks_where_it_was_measured_and_is_that_of_the_priors_before():
    machine, rng = drawn(8)
    result = calibrate(GEOMETRY, machine.touches(rng), (), machine.one_distance(rng), WRONG_BY)
    places = Region.of(GEOMETRY).places
    before = result.position_uncertainties_before(places, aligned=True)
    after = result.position_uncertainties(places, aligned=True)
    assert (after < before).all() and after[:, 2].max() < 1e-5 < 2e-4 < before[:, 2].min()
    one = result.position_uncertainty(places[3], aligned=True)
    assert one == pytest.approx(after[3])
    far = result.position_uncertainty((0.15, 0.0, 0.0), aligned=True)
    assert far[2] > after[:, 2].max()
    np.testing.assert_allclose(result.standard_deviations**2, np.diag(result.covariance))


def test_noise_that_is_larger_than_stated_is_said_and_no_measurement_is_blamed():
    machine, rng = drawn(9)
    places = Region.of(GEOMETRY).places[:, :2]
    touches = [Touch(one.heights, one.plate, TOUCH / 5.0) for one in machine.touches(rng, places)]
    result = calibrate(GEOMETRY, touches, priors=WRONG_BY)
    assert result.outliers == ()
    (warning,) = result.warnings
    factor = float(warning.split("the residuals are ")[1].split()[0])
    assert 4.0 < factor < 6.0


def test_data_too_coarse_for_anything_leave_the_machine_as_it_is():
    machine, rng = drawn(10)
    touches = [Touch(one.heights, one.plate, 0.015) for one in machine.touches(rng)]
    result = calibrate(GEOMETRY, touches, priors=None)
    np.testing.assert_array_equal(result.machine.vector, NOMINAL.vector)
    assert len(result.unidentified) >= 8
    assert np.isfinite(calibrate(GEOMETRY, touches).standard_deviations).all()


def test_priors_say_what_they_assume():
    assert "anchors within 1 mm" in str(Priors()) and "arms within 0.5 mm" in str(Priors())
    machine, rng = drawn(11)
    result = calibrate(GEOMETRY, machine.touches(rng))
    assert result.priors == Priors(mean=NOMINAL)
