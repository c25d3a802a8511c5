"""Predicted measurements, and their derivatives against finite differences."""

import numpy as np
import pytest
from strategies import random_geometry, random_positions

from testing.wrong_machines import NOMINAL
from tri_glide_kinematics.calibration.fit import (
    Distance,
    FramePlacement,
    MachineParameters,
    MeasuredPosition,
    MeasurementModel,
    Plate,
    State,
    Touch,
    Unknowns,
    position_derivatives,
    positions_of,
    rotation_by,
)
from tri_glide_kinematics.tri_glide import TriGlide

STEP = 1e-6  # m


@pytest.mark.parametrize("symmetric", [True, False])
def test_positions_change_as_finite_differences_say(symmetric):
    rng = np.random.default_rng(11)
    for _ in range(20):
        kinematics = TriGlide(random_geometry(rng, symmetric))
        places = random_positions(kinematics, rng, 10, max_condition=6.0)
        offsets = rng.uniform(-0.01, 0.01, 3)
        machine = MachineParameters(kinematics.geometry, tuple(offsets)).vector
        heights = kinematics.inverse_batch(places) - offsets
        np.testing.assert_allclose(positions_of(machine, heights), places, atol=1e-10)
        derivatives = position_derivatives(machine, places)
        for column in range(12):
            step = STEP * np.eye(12)[column]
            around = positions_of(machine + step, heights) - positions_of(machine - step, heights)
            np.testing.assert_allclose(
                derivatives[:, :, column], around / (2.0 * STEP), rtol=1e-5, atol=1e-5
            )


def measurements_of_all_kinds():
    """Return some, with plates and frames known and not, not exactly of the nominal machine."""
    rng = np.random.default_rng(5)
    plates = (
        Plate("known", 0.01, (0.002, -0.003)),
        Plate("lying", None, (0.001, 0.002)),
        Plate("at", 0.02, None),
        Plate("free", None, None),
    )

    def heights():
        place = (*rng.uniform(-0.1, 0.1, 2), rng.uniform(0.0, 0.2))
        return TriGlide(NOMINAL.geometry).inverse(place)

    touches = [Touch(heights(), plate, 1e-5) for plate in plates for _ in range(3)]
    positions = [
        MeasuredPosition(heights(), tuple(rng.uniform(-0.1, 0.1, 3)), frame, 2e-5)
        for frame in ("base", "camera", "tracker", "camera")
    ]
    distances = [Distance(heights(), heights(), 0.1, 5e-5) for _ in range(3)]
    return [touches[0], positions[0], *touches[1:], *distances, *positions[1:]]


def test_all_equations_change_as_finite_differences_say():
    some = measurements_of_all_kinds()
    unknowns = Unknowns.of(some)
    assert unknowns.size == 12 + 1 + 2 + 3 + 6 + 6
    model = MeasurementModel(some, unknowns)
    rng = np.random.default_rng(6)
    state = State(
        NOMINAL.vector + rng.uniform(-1e-3, 1e-3, 12),
        {name: rng.uniform(-0.02, 0.02, 3) for name in unknowns.plates},
        {
            name: FramePlacement(rotation_by(rng.uniform(-2.0, 2.0, 3)), rng.uniform(-1, 1, 3))
            for name in unknowns.frames
        },
    )
    residuals, matrix = model.equations(state)
    assert residuals.shape == (model.count,) == (12 + 4 * 3 + 3,)
    for column in range(unknowns.size):
        step = STEP * np.eye(unknowns.size)[column]
        after, before = (model.equations(unknowns.moved(state, s))[0] for s in (step, -step))
        difference = (after - before) / (2.0 * STEP)
        np.testing.assert_allclose(
            matrix[:, column], difference, rtol=1e-5, atol=1e-5 * np.abs(matrix).max()
        )


def test_residuals_are_predicted_minus_measured_by_their_standard_deviations():
    kinematics = TriGlide(NOMINAL.geometry)
    low, high = kinematics.inverse((0.0, 0.0, 0.1)), kinematics.inverse((0.05, 0.0, 0.1))
    some = [
        Touch(low, Plate("bed", 0.09), 0.01),
        MeasuredPosition(high, (0.04, 0.01, 0.1), "base", 0.01),
        Distance(low, high, 0.04, 0.005),
    ]
    model = MeasurementModel(some, Unknowns.of(some))
    residuals, _ = model.equations(State(NOMINAL.vector, {"bed": np.array([0.09, 0, 0])}, {}))
    np.testing.assert_allclose(residuals, [1.0, 1.0, -1.0, 0.0, 2.0], atol=1e-9)


def test_a_machine_that_cannot_be_reaches_nothing():
    assert np.isnan(positions_of(np.zeros(12), np.full((2, 3), 0.6))).all()
    assert np.isnan(positions_of(NOMINAL.vector, np.array([[0.1, 0.9, 0.9]]))).all()


def test_rotations_are_rotations_and_small_ones_are_the_cross_product():
    rng = np.random.default_rng(1)
    for size in (0.0, 1e-12, 1e-3, 1.0, 3.1):
        vector = rng.standard_normal(3)
        vector *= size / np.linalg.norm(vector)
        turn = rotation_by(vector)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(turn @ vector, vector, atol=1e-14)
        assert np.trace(turn) == pytest.approx(1.0 + 2.0 * np.cos(size), abs=1e-12)
