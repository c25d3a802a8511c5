"""The way driven, against quadrature."""

from itertools import pairwise

import numpy as np
import pytest

from testing.path_samples import random_path
from tri_glide_kinematics.motion.path import PlatformPath


def test_the_length_is_the_integral_of_the_rates():
    rng = np.random.default_rng(1)
    for _ in range(8):
        path, _ = random_path(rng, 8)
        driven = path.driven
        # Simpson's rule, piece by piece, is exact to many digits.
        fine = np.linspace(0.0, 1.0, 201)
        total = 0.0
        for low, high in pairwise(driven.breaks):
            inside = np.clip(low + (high - low) * fine, low, np.nextafter(high, low))
            rates = np.linalg.norm(driven.derivatives(inside, 1)[1], axis=1)
            weights = np.r_[1.0, np.tile([4.0, 2.0], 100)[:-1], 1.0]
            total += (high - low) * (weights @ rates) / 600.0
        assert path.length == pytest.approx(total, abs=1e-9)


def test_the_inverse_of_the_way_driven():
    rng = np.random.default_rng(2)
    for _ in range(6):
        path, _ = random_path(rng)
        driven = path.driven
        ways = np.concatenate((rng.uniform(0.0, path.length, 200), [0.0, path.length]))
        assert driven.ways(driven.place_of(ways)) == pytest.approx(ways, abs=1e-10)
        places = np.concatenate((rng.uniform(0.0, driven.length, 200), driven.breaks))
        assert driven.place_of(driven.ways(places)) == pytest.approx(places, abs=1e-9)


def test_position_and_tangent_by_the_way_driven():
    rng = np.random.default_rng(3)
    path, _ = random_path(rng, 10, stops=0.0)
    ways = np.linspace(0.0, path.length, 4001)[1:-1]
    places = path.position(ways)
    steps = np.diff(places, axis=0)
    chords = np.linalg.norm(steps, axis=1) / (ways[1] - ways[0])
    # A chord across a corner in which the path stops is shorter.
    assert chords.max() <= 1.0 + 1e-9
    assert np.sum(chords < 0.9) <= len(path.driven.stops)
    assert np.linalg.norm(path.tangent(ways), axis=1) == pytest.approx(1.0, abs=1e-12)
    assert path.position(0.1) == pytest.approx(path.position([0.1])[0], abs=0.0)
    assert path.position(-1.0).tolist() == path.segments.points[0].tolist()
    assert path.position(99.0) == pytest.approx(np.array(path.end), abs=1e-12)


def test_a_straight_path_has_its_own_length():
    path = PlatformPath.through([(0, 0, 0), (0.1, 0, 0), (0.3, 0, 0)])
    assert path.length == pytest.approx(0.3, abs=1e-15)
    assert path.position(0.2) == pytest.approx((0.2, 0.0, 0.0), abs=1e-15)
    assert path.tangent(0.2).tolist() == [1.0, 0.0, 0.0]
