"""Points on a path, as they are drawn."""

from math import pi

import numpy as np
import pytest
from motion_machine import distance_from_polyline

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import PlatformPath, polylines_of

TOLERANCE = 0.001
CENTRE = (0.02, 0.04, 0.25)
PATH = (
    PlatformPath.start((0.0, 0.0, 0.25))
    .line_to((0.04, 0.0, 0.25), tolerance=TOLERANCE)
    .line_to((0.04, 0.04, 0.25), tolerance=TOLERANCE)
    .arc_to((0.02, 0.06, 0.25), (0.0, 0.04, 0.25), tolerance=TOLERANCE)
    .arc_about(CENTRE, (0.0, 1.0, 0.0), 2.0 * pi)
)


def test_the_programmed_one_has_the_corners_and_lies_on_lines_and_arcs():
    points = at_once(polylines_of(PATH.driven)).programmed
    for corner in PATH.segments.points:
        assert np.linalg.norm(points - corner, axis=1).min() < 1e-12
    on_arc = points[points[:, 1] > 0.04 + 1e-9]
    assert len(on_arc) > 30
    radii = np.linalg.norm(on_arc - CENTRE, axis=1)
    assert radii == pytest.approx(0.02, abs=1e-12)


def test_the_driven_one_is_the_path_as_driven_within_its_tolerance():
    programmed, driven = at_once(polylines_of(PATH.driven))
    ways = np.linspace(0.0, PATH.length, 2000)
    # Between two points a line is drawn.
    assert distance_from_polyline(PATH.position(ways), driven).max() < 5e-5
    away = distance_from_polyline(driven, programmed)
    assert 0.3 * TOLERANCE < away.max() < TOLERANCE + 5e-5
    assert driven[0] == pytest.approx(programmed[0], abs=1e-12)
    assert driven[-1] == pytest.approx(programmed[-1], abs=1e-12)


def test_a_long_path_has_no_more_points_than_asked_for():
    rng = np.random.default_rng(1)
    places = np.cumsum(rng.normal(0.0, 1e-4, (10_001, 3)), axis=0)
    path = PlatformPath.through(places, tolerance=5e-5)
    programmed, driven = at_once(polylines_of(path.driven, 500))
    for points in (programmed, driven):
        assert points.shape == (500, 3)
        assert points[0] == pytest.approx(places[0], abs=1e-12)
        assert points[-1] == pytest.approx(places[-1], abs=1e-12)


def test_a_straight_line_is_two_points():
    path = PlatformPath.through([(0.0, 0.0, 0.2), (0.1, 0.0, 0.2)])
    programmed, driven = at_once(polylines_of(path.driven))
    assert programmed.tolist() == driven.tolist() == [[0.0, 0.0, 0.2], [0.1, 0.0, 0.2]]
