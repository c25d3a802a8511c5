"""The largest value over a volume, against places everywhere in it."""

import numpy as np
import pytest

from tri_glide_kinematics.dynamics import Masses
from tri_glide_kinematics.sizing import Box, some_places
from tri_glide_kinematics.sizing.fields import Cells, Loads, largest_over, quartered
from tri_glide_kinematics.sizing.wish import level_box, nearest_inside
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


def cone_and_paraboloid(top, slope):
    """Bounds of a cone and of a paraboloid, which are 1 at their ``top`` and less elsewhere.

    Within a cell both are largest at the place that is nearest to the top.
    """

    def bounds(places, radius):
        away = slope * np.maximum(np.hypot(*(places - top).T) - radius, 0.0)
        return np.stack((1.0 - away, 1.0 - away * away))

    return bounds


def some_volume(rng):
    center, half = rng.uniform(-0.1, 0.1, 2), rng.uniform(0.03, 0.2, 2)
    if rng.random() < 0.5:
        return Cylinder(*center.tolist(), float(half[0]), 0.0, 0.1)
    return Box((*(center - half).tolist(), 0.0), (*(center + half).tolist(), 0.1))


@pytest.mark.parametrize("seed", range(5))
def test_no_bound_is_below_a_maximum_that_is_known(seed):
    rng = np.random.default_rng(seed)
    for _ in range(20):
        volume = some_volume(rng)
        lower, upper = level_box(volume)
        top = nearest_inside(volume, rng.uniform(lower, upper, (1, 2)))[0]
        # At most half of the largest value is lost across the volume.
        slope = rng.uniform(0.2, 0.5) / float(np.hypot(*(upper - lower)))
        found = largest_over(volume, cone_and_paraboloid(top, slope))
        assert (found.bounds >= 1.0).all()
        assert (found.values <= 1.0).all()
        assert (found.bounds <= 1.0003).all()


def test_the_quarters_of_a_cell_fill_it():
    rng = np.random.default_rng(2)
    centers, half = rng.uniform(-1.0, 1.0, (5, 2)), np.array((0.3, 0.02))
    quarters, less = quartered(centers, half)
    np.testing.assert_allclose(less, 0.5 * half, rtol=1e-15)
    inside = rng.uniform(-1.0, 1.0, (400, 2)) * half
    for center, those in zip(centers, quarters.reshape(5, 4, 2)):
        apart = np.abs((center + inside)[:, np.newaxis] - those)
        covered = (apart <= less * (1.0 + 1e-12)).all(axis=-1)
        np.testing.assert_array_equal(covered.sum(axis=1), 1)
