"""The disc over which positions are judged, and the motion that counts as no error there."""

import numpy as np
import pytest
from strategies import random_geometry

from testing.wrong_machines import NOMINAL
from tri_glide_kinematics.calibration.fit import Region, plane_basis
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry


def test_places_are_evenly_spread_over_the_disc():
    region = Region.disc((0.1, -0.2), 0.05, rings=10)
    away = region.places[:, :2] - region.center
    np.testing.assert_allclose(away.mean(axis=0), 0.0, atol=1e-15)
    distances = np.linalg.norm(away, axis=1)
    assert distances.max() == pytest.approx(0.05)
    # Half of the area lies within 0.707 of the radius.
    assert (distances < 0.05 * np.sqrt(0.5)).mean() == pytest.approx(0.5, abs=0.05)


def test_the_region_of_a_machine_is_within_reach():
    assert Region.of(NOMINAL.geometry).radius == pytest.approx(0.12)
    rng = np.random.default_rng(1)
    short = TriGlideGeometry.symmetric(0.25, 0.05, 0.21)
    machines = [short, *(random_geometry(rng, False) for _ in range(20))]
    for geometry in machines:
        region = Region.of(geometry)
        assert region.radius > 0.0
        assert np.isfinite(TriGlide(geometry).inverse_batch(region.places)).all()


def test_a_motion_in_the_plane_is_found_and_leaves_nothing():
    region = Region.disc((0.02, 0.01), 0.1, rings=3)
    motion = np.array([[1e-3], [-2e-3], [0.01]])
    moved = plane_basis(region.places, region.center) @ motion
    np.testing.assert_allclose(region.plane_motion(moved), motion, atol=1e-15)
    up = np.zeros_like(moved)
    up[:, 2] = 1e-3
    np.testing.assert_allclose(region.plane_motion(up), 0.0, atol=1e-15)
