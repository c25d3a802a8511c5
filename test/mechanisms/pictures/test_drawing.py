"""What is drawn does not hang on the last bits of numbers that are equal or zero."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from soak import many
from strategies import nudged

from tri_glide_kinematics.mechanisms.pictures.drawing import (
    DrawnMechanism,
    LengthUnit,
    angle_axis,
    degrees_text,
)
from tri_glide_kinematics.mechanisms.pictures.skeleton import FOUR_BAR


@pytest.mark.parametrize("angle", [0.0, -0.0, -1e-18, 1e-18, math.radians(-0.004)])
def test_there_is_no_negative_zero(angle):
    assert degrees_text(angle) == "0.00°"


def test_angles_are_written_with_a_minus_sign():
    assert degrees_text(math.radians(-12.345), 1) == "\N{MINUS SIGN}12.3°"


def test_names_stand_where_they_stood():
    rng = np.random.default_rng(1)
    # Links lead from the pins to both sides, straight on.
    points = np.array([[0.0, 0.0], [0.02, 0.0], [0.04, 0.0], [0.06, 0.0], [0.03, 0.0]])
    places = set()
    for _ in range(many(15)):
        axes = Figure().add_subplot()
        DrawnMechanism(axes, FOUR_BAR, nudged(rng, points), LengthUnit("m", 1.0), named=True)
        places.add(tuple((*np.round(text.xyann, 6), text.get_va()) for text in axes.texts))
    assert len(places) == 1


def test_ticks_of_a_round_range_are_where_they_were():
    rng = np.random.default_rng(2)
    found = set()
    for high in nudged(rng, [270.0] * many(15)).tolist():
        axes = Figure().add_subplot()
        angle_axis(axes, "x", 0.0, high)
        found.add(tuple(np.round(axes.get_xticks(), 6)))
    assert len(found) == 1
