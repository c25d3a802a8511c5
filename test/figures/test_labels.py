"""Labels cover neither each other nor what is drawn, as long as there is room."""

from itertools import combinations

import numpy as np
import pytest

from tri_glide_kinematics.figures import label_centres

LINE_POINTS = 400


def polyline(corners):
    """Points along a polyline, close to each other. Shape (n, 2)."""
    ways = np.linspace(0.0, len(corners) - 1.0, LINE_POINTS)
    return np.column_stack(
        [np.interp(ways, np.arange(len(corners)), corners[:, axis]) for axis in range(2)]
    )


@pytest.mark.parametrize("seed", range(10))
def test_labels_of_the_corners_of_a_path_cover_nothing(seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(0.0, 400.0, (5, 2))
    sizes = np.column_stack((rng.uniform(8.0, 40.0, 5), np.full(5, 10.0)))
    line = polyline(corners)
    centres = label_centres(corners, sizes, line, margin=1.0)
    for one, other in combinations(range(5), 2):
        apart = np.abs(centres[one] - centres[other]) >= (sizes[one] + sizes[other]) / 2.0
        assert apart.any()
    for centre, size in zip(centres, sizes):
        assert not (np.abs(line - centre) < size / 2.0).all(axis=1).any()


def test_labels_of_one_and_the_same_point_stand_beside_each_other():
    points = np.zeros((3, 2))
    sizes = np.full((3, 2), (30.0, 10.0))
    centres = label_centres(points, sizes, points, margin=1.0)
    for one, other in combinations(range(3), 2):
        assert (np.abs(centres[one] - centres[other]) >= sizes[0]).any()


def test_no_point_needs_no_label():
    assert label_centres(np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)), 1.0).shape == (0, 2)
