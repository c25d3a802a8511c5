"""Where a fit begins: frames and plates as the nominal machine would have seen them."""

import numpy as np
import pytest

from testing.wrong_machines import NOMINAL, PLACES, WrongMachine
from tri_glide_kinematics.calibration.fit import (
    MeasurementModel,
    Plate,
    Unknowns,
    placement,
    rotation_by,
    starting_state,
)


@pytest.mark.parametrize("flat", [False, True])
def test_the_turn_and_shift_of_a_frame_are_found_and_never_a_reflection(flat):
    rng = np.random.default_rng(1)
    for _ in range(20):
        places = rng.uniform(-0.1, 0.1, (6, 3)) * (1.0, 1.0, 0.0 if flat else 1.0)
        turn, shift = rotation_by(rng.uniform(-2.0, 2.0, 3)), rng.uniform(-1.0, 1.0, 3)
        found = placement(places, places @ turn.T + shift)
        np.testing.assert_allclose(found.rotation, turn, atol=1e-9)
        np.testing.assert_allclose(found.shift, shift, atol=1e-9)
        assert np.linalg.det(found.rotation) == pytest.approx(1.0)


def test_height_and_tilt_of_a_plate_are_those_of_the_places_that_touched_it():
    rng = np.random.default_rng(2)
    machine = WrongMachine(NOMINAL)
    surface = (0.02, 0.01, -0.03)
    for height, tilt in ((None, None), (0.02, None), (None, (0.01, -0.03))):
        plate = Plate("bed", height, tilt)
        touches = [machine.touch(x, y, rng, plate, surface) for x, y in PLACES]
        model = MeasurementModel(touches, Unknowns.of(touches))
        state = starting_state(model, NOMINAL.vector)
        # Noise of 10 µm, over a disc of 120 mm.
        np.testing.assert_allclose(state.plates["bed"], surface, atol=2e-4)
