"""Quantities at places against their definitions, and bounds against the places around."""

import itertools

import numpy as np
import pytest
from sized_machines import slider_motion
from soak import many

from testing.masses import random_masses
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.sizing.fields import Cells, Loads
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide, TriGlideGeometry

RADII = (0.06, 0.03, 0.01, 0.001)


def random_machine(rng, spread=0.03):
    """A machine with unequal arms; its towers stand in any direction."""
    turn = rng.uniform(0.0, 6.0)
    angles = turn + np.radians((90.0, 210.0, 330.0)) + rng.uniform(-0.1, 0.1, 3)
    radii = 0.2 + rng.uniform(-spread, spread, 3)
    anchors = np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))
    lengths = 0.45 + rng.uniform(-spread, spread, 3)
    order = (0, 2, 1) if rng.random() < 0.5 else (0, 1, 2)
    return TriGlide(TriGlideGeometry(anchors[order, :], lengths[order,]))


def places_of(rng, count, radius=0.12):
    angles, parts = rng.uniform(0.0, 2.0 * np.pi, count), np.sqrt(rng.uniform(0.0, 1.0, count))
    return radius * parts[:, np.newaxis] * np.column_stack((np.cos(angles), np.sin(angles)))


def directions(rng, count):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_quantities_are_what_they_are_defined_as():
    rng = np.random.default_rng(1)
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    for _ in range(20):
        machine = random_machine(rng)
        places = places_of(rng, 5)
        cells = Cells.of(machine.geometry, places)
        for k, place in enumerate(places):
            position = (*place, 0.0)
            jacobian = np.array(machine.jacobian(position))
            inverse = np.linalg.inv(jacobian)
            np.testing.assert_allclose(cells.rows[..., k], jacobian, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(cells.inverse[..., k], inverse, rtol=1e-10, atol=1e-10)
            condition = machine.condition_number(position)
            assert cells.conditions()[k] == pytest.approx(condition, rel=1e-9)
            errors = np.linalg.norm(signs @ inverse.T, axis=1)
            assert cells.position_errors()[k] == pytest.approx(errors.max(), rel=1e-9)
            # The norm of a row is what the worst direction makes of a speed.
            ratios = np.linalg.norm(jacobian, axis=1)
            np.testing.assert_allclose(cells.speed_ratios()[:, k], ratios, rtol=1e-12)
            softness = np.linalg.eigvalsh(inverse @ inverse.T)[-1]
            assert cells.softnesses()[k] == pytest.approx(softness, rel=1e-9)


def test_no_motion_needs_more_force_than_the_bound_and_one_from_rest_needs_it():
    rng = np.random.default_rng(2)
    for _ in range(20):
        machine, masses = random_machine(rng), random_masses(rng)
        forces = SliderForces(machine, masses)
        loads = Loads.of(masses, machine.geometry.arm_lengths)
        (place,) = places_of(rng, 1)
        cells = Cells.of(machine.geometry, place[np.newaxis])
        speed, acceleration = rng.uniform(0.2, 2.0), rng.uniform(1.0, 30.0)
        count = 4000
        position = np.append(place, 0.3)
        velocities = speed * directions(rng, count)
        accelerations = acceleration * directions(rng, count)
        sliders, second = slider_motion(machine, position, velocities, accelerations)
        heights = np.tile(machine.inverse(position), (count, 1))
        moving = np.abs(forces.forces_batch(heights, sliders, second)).max(axis=0)
        bound = cells.forces(loads, speed, acceleration)[:, 0]
        assert (moving <= bound * (1.0 + 1e-12)).all()
        assert (moving > 0.6 * bound).all()
        # Nearly no speed: only dry friction is left of it.
        slow = 1e-9
        nearly = slider_motion(machine, position, slow / speed * velocities, accelerations)
        still = forces.forces_batch(heights, *nearly)
        bound = cells.forces(loads, slow, acceleration)[:, 0]
        largest = np.abs(still).max(axis=0)
        assert (largest <= bound * (1.0 + 1e-9)).all()
        assert (largest > 0.99 * bound).all()


def test_the_length_of_a_vector_grows_by_no_more_than_is_said_though_it_bends_more():
    """Of a vector that is a square of the way, the largest length is known."""
    radius = 0.1
    bends_more = 0
    for size, slope, second, angle in itertools.product(
        (0.02, 0.1, 1.0), (0.0, 0.5, 3.0), (0.0, 1.0, 20.0), np.linspace(0.0, np.pi, 7)
    ):
        along = np.array([np.cos(angle), np.sin(angle)])
        ways = np.linspace(-radius, radius, 2001)
        lengths = np.hypot(
            size + (slope * ways + 0.5 * second * ways**2) * along[0],
            (slope * ways + 0.5 * second * ways**2) * along[1],
        )
        cells = Cells.of(DEFAULT_GEOMETRY, [(0.0, 0.0)], radius)
        sizes = np.full((1, 1), size)
        slopes = np.zeros((1, 3, 2, 1))
        slopes[0, :2, 0, 0] = slope * along
        cells.__dict__["_second"] = lambda _, second=second: np.full((1, 1), second)
        curved = cells._curved(sizes, slopes)
        gradients = np.array([[[slope * along[0]], [0.0]]])
        assert lengths.max() <= (sizes + cells._beyond(gradients, curved))[0, 0] + 1e-12
        step = ways[1] - ways[0]
        bends_more += np.diff(lengths, 2).max() / step**2 > 1.01 * curved[0, 0]
    assert bends_more > 10


@pytest.mark.parametrize("radius", RADII)
def test_no_place_of_a_cell_has_more_than_its_bound(radius):
    rng = np.random.default_rng(3)
    for _ in range(many(20)):
        machine, masses = random_machine(rng), random_masses(rng)
        loads = Loads.of(masses, machine.geometry.arm_lengths)
        speed, acceleration = rng.uniform(0.0, 3.0), rng.uniform(0.0, 30.0)
        places = places_of(rng, 4)
        bounds = quantities(Cells.of(machine.geometry, places, radius), loads, speed, acceleration)
        for k, place in enumerate(places):
            around = np.concatenate((place + places_of(rng, 200, radius), ring(place, radius)))
            values = quantities(Cells.of(machine.geometry, around), loads, speed, acceleration)
            assert (values.max(axis=1) <= bounds[:, k] * (1.0 + 1e-9)).all()


def test_bounds_of_errors_and_forces_get_near_with_the_square_of_the_radius():
    machine = TriGlide(DEFAULT_GEOMETRY)
    loads = Loads.of(Masses.uniform(0.5, 0.1, 0.3), DEFAULT_GEOMETRY.arm_lengths)
    place = np.array([(0.03, -0.05)])
    above = []
    for radius in (1e-2, 1e-3, 1e-4):
        around = (
            Cells.of(machine.geometry, place, radius),
            Cells.of(machine.geometry, ring(place[0], radius)),
        )
        forces = [cells.forces(loads, 0.0, 10.0).max() for cells in around]
        errors = [cells.position_errors().max() for cells in around]
        bounds, values = np.stack((forces, errors), axis=1)
        above.append(bounds - values)
    assert (above[1] < 0.015 * above[0]).all()
    assert (above[2] < 0.015 * above[1]).all()


def test_places_out_of_reach_have_infinite_bounds():
    cells = Cells.of(DEFAULT_GEOMETRY, [(0.6, 0.0), (0.15, 0.0)], 0.1)
    assert not np.isfinite(cells.conditions()).any()
    assert not np.isfinite(cells.position_errors()).any()
    assert np.isinf(cells.speed_ratios().max(axis=0)).all()


@pytest.mark.parametrize("ratio", [3.0, 6.0, 12.0])
def test_the_radii_at_which_klipper_slows_down_are_those_of_the_map_of_speed_ratios(ratio):
    """Level and straight away from a tower, its slider is faster than the platform by a ratio.

    Klipper slows down beyond the radius q sqrt(L^2/(q^2 + 1) - e^2) + e - R, with R the difference
    of the radii and e half a step of its motors; without steps e is 0.
    """
    for radius, length in ((0.2, 0.4), (0.13, 0.27), (0.09, 0.3)):
        geometry = TriGlideGeometry.symmetric(radius + 0.03, 0.03, length)
        expected = ratio * np.sqrt(length**2 / (ratio**2 + 1.0)) - radius
        low, high = 0.0, length - radius
        while high - low > 1e-10:
            middle = 0.5 * (low + high)
            # Tower 1 stands in the direction of y.
            ratios = np.linalg.norm(Cells.of(geometry, [(0.0, -middle)]).rows[:, :2, 0], axis=1)
            low, high = (middle, high) if ratios.max() < ratio else (low, middle)
        assert low == pytest.approx(expected, abs=1e-6)


def quantities(cells, loads, speed, acceleration):
    return np.stack(
        (
            cells.conditions(),
            cells.position_errors(),
            cells.softnesses(),
            *cells.speed_ratios(),
            *cells.forces(loads, speed, acceleration),
        )
    )


def ring(place, radius):
    angles = np.linspace(0.0, 2.0 * np.pi, 60)
    return place + radius * np.column_stack((np.cos(angles), np.sin(angles)))
