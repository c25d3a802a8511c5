"""The description of a drawing, and what the writer of files makes of it."""

import itertools

import numpy as np
import pytest
from matplotlib.figure import Figure

from tri_glide_kinematics.mechanisms.pictures.drawing import DrawnMechanism, LengthUnit
from tri_glide_kinematics.mechanisms.pictures.skeleton import F_MECHANISM, FOUR_BAR, bounds

POINTS = np.random.default_rng(5).uniform(-0.1, 0.1, (9, 2))


def as_set(segments):
    return {frozenset(map(tuple, np.round(segment, 9))) for segment in segments}


@pytest.mark.parametrize("skeleton", [FOUR_BAR, F_MECHANISM])
def test_a_file_shows_the_lines_of_the_description(skeleton):
    points = POINTS[: len(skeleton.names)]
    axes = Figure().add_subplot()
    plate, *links, joints = DrawnMechanism(axes, skeleton, points, LengthUnit("m", 1.0)).move(
        points
    )
    corners = plate.get_xy()
    drawn = [link.get_xydata() for link in links] + list(itertools.pairwise(corners))
    assert as_set(drawn) == as_set(skeleton.lines(points))
    assert joints.get_xydata() == pytest.approx(points)


def test_a_box_holds_all_places_that_are_numbers():
    places = np.array([[[0.0, 1.0], [np.nan, np.nan]], [[4.0, 0.0], [2.0, 3.0]]])
    assert bounds(places, 0.0).tolist() == [[0.0, 0.0], [4.0, 3.0]]
    assert bounds(places, 0.25).tolist() == [[-1.0, -1.0], [5.0, 4.0]]
