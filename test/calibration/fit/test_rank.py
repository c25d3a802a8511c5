"""How many of the twelve parameters each kind of data determines: docs/calibration_theory.md."""

import numpy as np
import pytest
from strategies import random_geometry

from testing.wrong_machines import NOMINAL
from tri_glide_kinematics.calibration.fit import (
    Distance,
    Knowledge,
    MachineParameters,
    MeasuredPosition,
    MeasurementModel,
    Plate,
    Region,
    Touch,
    Unknowns,
    calibrate,
    in_words,
    named_directions,
    starting_state,
)
from tri_glide_kinematics.tri_glide import TriGlide

PLANE = ("shifting along x", "shifting along y", "turning about z")
UP = "shifting along z (all height offsets together)"
# Kind of data, and the directions that it leaves free exactly.
KINDS = {
    "touches of a known plate": PLANE,
    "touches of a plate of unknown height": (*PLANE, UP),
    "touches of a plate of unknown tilt": PLANE,
    "touches of a plate of unknown height and tilt": (*PLANE, UP),
    "distances": (*PLANE, UP),
    "positions in a frame that is turned and shifted": (*PLANE, UP),
    "positions": (),
    "touches and a distance": PLANE,
    "touches and one position": ("turning about z",),
}


def data(kind, machine, rng):
    """Return many exact measurements of a kind on a machine."""
    kinematics = TriGlide(machine.geometry)
    region = Region.of(machine.geometry)
    plane = region.places[rng.permutation(len(region.places))[:40], :2]

    def at(place, z=0.0):
        return kinematics.inverse((place[0], place[1], z))

    def touches(plate):
        return [Touch(at(place), plate) for place in plane]

    def positions(frame):
        places = [(x, y, z) for (x, y), z in zip(plane, rng.uniform(0.0, 0.1, len(plane)))]
        return [MeasuredPosition(kinematics.inverse(p), p, frame) for p in places]

    def distances(count):
        ends = [
            (at(a, z), at(b), float(np.linalg.norm((*(b - a), z))))
            for a, b, z in zip(plane, np.roll(plane, 1, axis=0), rng.uniform(0.01, 0.1, 40))
        ]
        return [Distance(*end) for end in ends[:count]]

    return {
        "touches of a known plate": lambda: touches(Plate()),
        "touches of a plate of unknown height": lambda: touches(Plate("bed", None)),
        "touches of a plate of unknown tilt": lambda: touches(Plate("bed", 0.0, None)),
        "touches of a plate of unknown height and tilt": lambda: touches(Plate("bed", None, None)),
        "distances": lambda: distances(40),
        "positions in a frame that is turned and shifted": lambda: positions("camera"),
        "positions": lambda: positions("base"),
        "touches and a distance": lambda: [*touches(Plate()), *distances(1)],
        "touches and one position": lambda: [*touches(Plate()), *positions("base")[:1]],
    }[kind]()


def spectrum_of(some, machine):
    model = MeasurementModel(some, Unknowns.of(some))
    knowledge = Knowledge.of(machine.vector, None)
    matrix = model.equations(starting_state(model, machine.vector))[1]
    return knowledge, knowledge.spectrum(matrix)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_data_leaves_free_what_the_theory_says(kind):
    rng = np.random.default_rng(8)
    machines = [NOMINAL, *(MachineParameters(random_geometry(rng, False)) for _ in range(3))]
    for machine in machines:
        knowledge, spectrum = spectrum_of(data(kind, machine, rng), machine)
        free = np.isinf(spectrum.deviations)
        assert free.sum() == len(KINDS[kind])
        # What is not free is so by far, and what is free is nothing but rounding.
        assert spectrum.strengths[free].max(initial=0.0) < 1e-9 * spectrum.strengths.max()
        names = in_words(machine.vector, knowledge.scale, spectrum.directions[:, free])
        if kind != "touches and one position":
            assert set(names) == set(KINDS[kind])
        else:
            # Turning about that one position is turning about the middle with a shift.
            assert len(names) == 1


@pytest.mark.parametrize("name", [*PLANE, UP])
def test_free_directions_move_all_positions_alike(name):
    change = named_directions(NOMINAL.vector)[name]
    region = Region.of(NOMINAL.geometry)
    moved = region.derivatives(NOMINAL.vector) @ change
    if name == "turning about z":
        expected = np.column_stack(
            (-region.places[:, 1], region.places[:, 0], np.zeros(len(moved)))
        )
    else:
        expected = np.tile(np.eye(3)["xyz".index(name[len("shifting along ")])], (len(moved), 1))
    np.testing.assert_allclose(moved, expected, atol=1e-12)


def test_touches_of_an_unknown_plate_leave_the_arms_to_centimetres():
    rng = np.random.default_rng(8)
    some = data("touches of a plate of unknown height and tilt", NOMINAL, rng)
    result = calibrate(NOMINAL.geometry, some[:13], priors=None)
    assert "the common scale of anchors and arms" in result.unidentified
    arms = result.standard_deviations[6:9]
    assert (arms > 0.01).all() and np.isfinite(arms).all()
