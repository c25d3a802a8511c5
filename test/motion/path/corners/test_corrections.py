"""Sums over all roundings, at each break and carried on from one to the next."""

import numpy as np
import pytest

from testing.path_samples import random_path, unit
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import DrivenPath, PlatformPath
from tri_glide_kinematics.motion.path.corners import corrections


def rough_polyline(rng, tolerance):
    steps = np.array([unit(rng) * 10.0 ** rng.uniform(-5.0, -1.0) for _ in range(300)])
    return PlatformPath.through(np.cumsum(steps, axis=0), tolerance)


def dense_polyline(noise):
    rng = np.random.default_rng(2)
    angles = 0.005 * np.arange(1500)
    points = 0.02 * np.column_stack((np.cos(angles), np.sin(angles), 0.1 * angles))
    return PlatformPath.through(points + noise * rng.normal(size=points.shape), 1e-3)


RNG = np.random.default_rng(1)
PATHS = {
    **{f"random {number}": random_path(RNG, 40)[0] for number in range(4)},
    "rough": rough_polyline(RNG, 1e-3),
    "tight": rough_polyline(RNG, 1e-6),
    "smooth": dense_polyline(0.0),
    "noisy": dense_polyline(1e-6),
    "very noisy": dense_polyline(1e-5),
}


@pytest.mark.parametrize("name", PATHS)
def test_carrying_on_costs_no_digits(name, monkeypatch):
    segments = PATHS[name].segments
    monkeypatch.setattr(corrections, "FEW_TERMS", 10**9)
    exact = at_once(DrivenPath.of(segments))
    monkeypatch.setattr(corrections, "FEW_TERMS", 1)
    monkeypatch.setattr(corrections, "FEW_EACH", 0)
    carried = at_once(DrivenPath.of(segments))
    assert (exact.breaks == carried.breaks).all()
    ways = np.linspace(0.0, exact.length, 1500)
    for order, (one, other) in enumerate(zip(exact.derivatives(ways), carried.derivatives(ways))):
        scale = max(1.0, np.abs(one).max()) if order else 1e-2
        assert other == pytest.approx(one, abs=1e-12 * scale)


def test_where_no_rounding_reaches_the_path_is_the_programmed_one():
    driven = PATHS["smooth"].driven
    driven_line = PlatformPath.through([(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0)], 1e-3).driven
    # It swings out over nine tenths of the line.
    ways = np.array([0.0, 0.005, 0.0099])
    assert driven_line.derivatives(ways)[0].tolist() == [[0, 0, 0], [0.005, 0, 0], [0.0099, 0, 0]]
    assert driven.derivatives([0.0])[0].tolist() == [driven.segments.points[0].tolist()]


def test_breaks_name_each_place_once():
    for path in PATHS.values():
        driven = path.driven
        assert (np.diff(driven.breaks) > 0.0).all()
        assert np.isin(driven.joints, driven.breaks).all()
        assert np.isin(driven.stops, driven.joints).all()
