"""Numbers of measurements, priors and machines are checked where they are made."""

import math
from dataclasses import replace

import numpy as np
import pytest

from testing.wrong_machines import NOMINAL
from tri_glide_kinematics.calibration import (
    Distance,
    MachineParameters,
    MeasuredPosition,
    Plate,
    Priors,
    Touch,
    calibrate,
)
from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.tri_glide import GeometryError

HEIGHTS = (0.6, 0.61, 0.62)


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: Touch((0.6, math.nan, 0.6)), NotFiniteError, r"heights\[1\] = nan"),
        (lambda: Touch((0.6, 0.6)), WrongShapeError, r"heights has shape \(2,\)"),
        (lambda: Touch(HEIGHTS, Plate(), 0.0), OutOfBoundsError, "must be greater than 0 m"),
        (lambda: Touch(HEIGHTS, Plate(), math.inf), NotFiniteError, "standard_deviation = inf"),
        (lambda: Plate("bed", math.nan), NotFiniteError, "height of plate 'bed' = nan"),
        (lambda: Plate("bed", 0.0, (0.0, math.inf)), NotFiniteError, "tilt of plate 'bed'"),
        (lambda: MeasuredPosition(HEIGHTS, (0.0, 0.0)), WrongShapeError, "measured position"),
        (lambda: Distance(HEIGHTS, HEIGHTS, -0.1), OutOfBoundsError, "-0.1 m must be greater"),
        (lambda: Distance(HEIGHTS, (0.6, 0.6, math.nan), 0.1), NotFiniteError, "heights_to"),
        (lambda: Priors(anchors=0.0), OutOfBoundsError, "standard deviation of anchors"),
        (lambda: Priors(height_offsets=math.nan), NotFiniteError, "height_offsets = nan"),
        (
            lambda: replace(NOMINAL, height_offsets=(0, math.nan, 0)),
            NotFiniteError,
            r"ts\[1\] = nan",
        ),
    ],
)
def test_numbers_without_a_meaning_are_refused(make, error, text):
    with pytest.raises(error, match=text):
        make()


@pytest.mark.parametrize("offsets", [0.0, (0.0, 0.0), ()])
def test_height_offsets_are_three(offsets):
    with pytest.raises(WrongShapeError, match="height_offsets"):
        calibrate(NOMINAL.geometry, [Touch(HEIGHTS)], height_offsets=offsets)


def test_the_twelve_numbers_make_the_machine_again():
    machine = MachineParameters(NOMINAL.geometry, (0.01, 0.02, 0.03))
    assert MachineParameters.from_vector(machine.vector) == machine
    assert machine.vector.shape == (12,)
    with pytest.raises(GeometryError):
        MachineParameters.from_vector(np.concatenate((np.zeros(6), np.ones(6))))
