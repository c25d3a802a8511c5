"""Inscribed cylinders against halving on the exact conditions."""

import math

import numpy as np
import pytest
from soak import many, some
from strategies import is_inside

from tri_glide_kinematics.sizing import NoCylinderError, extents, inscribed_height, inscribed_radius
from tri_glide_kinematics.sizing.fields import Cells
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide, TriGlideGeometry
from tri_glide_kinematics.workspace import Cylinder, Workspace, WorkspaceLimits

LOWER, UPPER = (0.3, 0.3, 0.3), (0.9, 0.9, 0.9)
UNEQUAL = TriGlideGeometry(((0.03, 0.21), (-0.17, -0.1), (0.2, -0.08)), (0.4, 0.41, 0.39))


def workspace(geometry=DEFAULT_GEOMETRY, margin=0.005, condition=6.0, **space):
    limits = WorkspaceLimits(LOWER, UPPER, margin, condition, **space)
    return Workspace(TriGlide(geometry), limits)


def halved(is_kept, low, high):
    """The largest number up to which something is kept."""
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_kept(middle) else (low, middle)
    return low


def rim(radius, count=12):
    # The directions to all towers, and away from them, are among these.
    angles = math.radians(90.0) + np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    return radius * np.column_stack((np.cos(angles), np.sin(angles)))


def test_radius_and_height_of_the_default_machine_are_exact(monkeypatch):
    # All around, the condition number is nearly as large: many cells are halved for each digit.
    monkeypatch.setattr(extents, "RADIUS_TOLERANCE", 1e-5)
    place = workspace()
    z = 0.35
    radius = halved(lambda r: all(is_inside(place, (*xy, z)) for xy in rim(r).tolist()), 0.0, 0.4)
    assert radius - 1.1e-5 < inscribed_radius(place) <= radius
    wanted = 0.12
    # A cylinder is cut first at its axis, at its rim, or where an anchor is nearest to it.
    level = [(0.0, 0.0), *rim(wanted).tolist()]

    def is_kept(height):
        return all(is_inside(place, (*xy, height)) for xy in level)

    bottom, top = inscribed_height(place, wanted)
    assert top == pytest.approx(z + halved(lambda up: is_kept(z + up), 0.0, 0.5), abs=1e-6)
    assert bottom == pytest.approx(z - halved(lambda down: is_kept(z - down), 0.0, 0.5), abs=1e-6)
    assert inscribed_radius(place, top - bottom) == pytest.approx(wanted, abs=1e-6)


def test_the_widest_cylinder_of_unequal_arms_about_another_axis_just_fits():
    place = workspace(UNEQUAL, condition=4.0)
    center = (0.02, -0.03)
    radius = inscribed_radius(place, 0.1, center)
    bottom, top = inscribed_height(place, radius * (1.0 - 1e-9), center)
    assert top - bottom >= 0.1
    angles = np.linspace(0.0, 2.0 * math.pi, 3000)
    circle = np.column_stack((np.cos(angles), np.sin(angles), 0.0 * angles))
    conditions = [
        place.machine.condition_number_batch(np.array((*center, 0.0)) + scale * radius * circle)
        for scale in (1.0, 1.00001)
    ]
    assert conditions[0].max() <= 4.0 < conditions[1].max()


def test_box_and_cylinder_bound_it_too():
    assert inscribed_radius(workspace(box_lower=(-0.05, -0.1, 0.2))) == pytest.approx(0.05)
    cylinder = Cylinder(0.0, 0.01, 0.08, 0.2, 0.3)
    place = workspace(cylinder=cylinder)
    assert inscribed_radius(place) == pytest.approx(0.07)
    assert inscribed_height(place, 0.05) == pytest.approx((0.2, 0.3))
    for height, center in ((0.2, (0.0, 0.0)), (0.0, (0.3, 0.0))):
        with pytest.raises(NoCylinderError):
            inscribed_radius(place, height, center)
    for radius in (0.075, 0.3):
        with pytest.raises(NoCylinderError, match=f"{radius:g}"):
            inscribed_height(place, radius)
    with pytest.raises(NoCylinderError, match="condition number"):
        inscribed_height(workspace(UNEQUAL, condition=4.0), 0.15)


@pytest.mark.slow
@pytest.mark.parametrize("seed", some([7, 1], 1))
def test_the_condition_number_is_kept_in_all_of_a_circle_and_nowhere_around_a_wider_one(seed):
    rng = np.random.default_rng(seed)
    angles = np.linspace(0.0, 2.0 * math.pi, 4001)
    circle = np.column_stack((np.cos(angles), np.sin(angles)))
    for _ in range(many(2)):
        turned = np.radians((90.0, 210.0, 330.0)) + rng.normal(0.0, 0.1, 3)
        across = 0.2 * rng.uniform(0.8, 1.2, 3)
        anchors = np.column_stack((across * np.cos(turned), across * np.sin(turned)))
        lengths = rng.uniform(0.37, 0.43, 3)
        geometry = TriGlideGeometry(tuple(map(tuple, anchors.tolist())), tuple(lengths.tolist()))
        center = rng.uniform(-0.05, 0.05, 2)

        def largest(radius, geometry=geometry, center=center):
            return Cells.of(geometry, center + radius * circle).conditions().max()

        limit = float(rng.uniform(1.05, 2.0)) * largest(0.0)
        limits = WorkspaceLimits((-2.0,) * 3, (2.0,) * 3, 0.001, limit)
        radius = inscribed_radius(Workspace(TriGlide(geometry), limits), 0.0, tuple(center))
        assert max(map(largest, (0.5 * radius, radius))) <= limit * (1.0 + 1e-9)
        assert largest(radius + 1e-6) > limit
