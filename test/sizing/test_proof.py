"""The largest value over a volume, against places everywhere in it."""

from __future__ import annotations

import numpy as np
import pytest

from tri_glide_kinematics.dynamics import Masses
from tri_glide_kinematics.sizing import Box, Cells, Loads, largest_over, some_places
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlideGeometry
from tri_glide_kinematics.workspace import Cylinder

LOADS = Loads.of(Masses.uniform(0.5, 0.4, 0.3), (0.4, 0.4, 0.4))


def quantities(geometry):
    def bounds(places, radius):
        cells = Cells.of(geometry, places, radius)
        forces = cells.forces(LOADS, 1.0, 10.0).max(axis=0)
        return np.stack((cells.conditions(), cells.position_errors(), forces))

    return bounds


@pytest.mark.parametrize(
    "volume",
    [
        Cylinder(0.0, 0.0, 0.14, 0.0, 0.1),
        Cylinder(0.05, -0.03, 0.05, 0.0, 0.1),
        Box((-0.1, -0.02, 0.0), (0.1, 0.02, 0.1)),
        Box((0.03, 0.02, 0.0), (0.12, 0.09, 0.1)),
    ],
)
@pytest.mark.parametrize("orientation", [0.0, 0.4])
def test_no_place_has_more_and_one_has_nearly_as_much(volume, orientation):
    geometry = TriGlideGeometry.symmetric(0.25, 0.05, 0.4, orientation)
    found = largest_over(volume, quantities(geometry))
    rng = np.random.default_rng(4)
    if isinstance(volume, Box):
        places = rng.uniform(volume.lower[:2], volume.upper[:2], (30_000, 2))
    else:
        angles, parts = (
            rng.uniform(0.0, 2.0 * np.pi, 30_000),
            np.sqrt(rng.uniform(0.0, 1.0, 30_000)),
        )
        across = volume.radius * parts * np.stack((np.cos(angles), np.sin(angles)))
        places = across.T + np.array((volume.center_x, volume.center_y))
    places = np.concatenate((places, some_places(volume)))
    values = quantities(geometry)(places, 0.0).max(axis=1)
    assert (values <= found.bounds).all()
    assert (values > 0.995 * found.values).all()
    assert (found.values <= found.bounds).all()
    assert (found.bounds <= found.values * 1.0003).all()
    again = quantities(geometry)(found.places, 0.0).diagonal()
    np.testing.assert_allclose(again, found.values, rtol=1e-12)


def test_nothing_is_proved_of_a_volume_out_of_reach():
    found = largest_over(Cylinder(0.0, 0.0, 0.3, 0.0, 0.1), quantities(DEFAULT_GEOMETRY))
    assert np.isinf(found.bounds).all()
