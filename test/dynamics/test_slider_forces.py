"""Forces against a constrained Lagrangian with all bodies in coordinates of their own."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from soak import many
from strategies import random_geometry, random_motion, random_positions, reproducible

from testing.masses import random_masses
from tri_glide_kinematics.dynamics import Arm, Masses, SliderForces
from tri_glide_kinematics.errors import NotFiniteError, WrongShapeError
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, NoPoseError, TriGlide, TriGlideGeometry

MACHINE = TriGlide(DEFAULT_GEOMETRY)
MUJOCO = Path(__file__).with_name("mujoco_forces.json")


def random_forces(rng, **kinds):
    machine = TriGlide(random_geometry(rng, symmetric=bool(rng.integers(2))))
    return SliderForces(machine, random_masses(rng, **kinds))


def lagrangian_forces(slider_forces, heights, velocities, accelerations):
    """The forces of the drives, from 24 coordinates and 21 constraints.

    Coordinates: three heights, the platform, and of each arm its centre of mass and the vector
    along it, of length 1. The kinetic energy is a sum of squares in these; the constraints of each
    arm are that its ends are at the carriage and at the platform, and that the vector keeps its
    length. Lagrange's equations with the forces of the drives and multipliers of the constraints
    as unknowns are linear.
    """
    machine, masses = slider_forces.machine, slider_forces.masses
    gravity = np.array(masses.gravity)
    inertia, pull = np.zeros(24), np.zeros(24)
    inertia[:3] = np.add(masses.carriages, masses.counterweights)
    pull[:3] = np.subtract(masses.carriages, masses.counterweights) * gravity[2]
    inertia[3:6] = masses.platform + masses.payload
    pull[3:6] = inertia[3:6] * gravity
    position = np.array(machine.forward(heights))
    rows, jacobian, squared = np.zeros((21, 24)), np.zeros((21, 24)), np.zeros((21, 24))
    for i, (arm, length) in enumerate(zip(masses.arms, machine.geometry.arm_lengths)):
        centre, along = slice(6 + 6 * i, 9 + 6 * i), slice(9 + 6 * i, 12 + 6 * i)
        inertia[centre] = arm.mass
        pull[centre] = arm.mass * gravity
        inertia[along] = arm.mass * length**2 / 12.0 if arm.inertia is None else arm.inertia
        near, far = slice(7 * i, 7 * i + 3), slice(7 * i + 3, 7 * i + 6)
        # Centre less a part of the arm is the carriage; plus the rest of it, the platform.
        rows[near, centre] = rows[far, centre] = np.eye(3)
        rows[near, along] = -arm.centre * length * np.eye(3)
        rows[far, along] = (1.0 - arm.centre) * length * np.eye(3)
        rows[near, i] = (0.0, 0.0, -1.0)
        rows[far, 3:6] = -np.eye(3)
        jacobian[7 * i : 7 * i + 6] = rows[7 * i : 7 * i + 6]
        carriage = np.array((*machine.geometry.anchors[i], heights[i]))
        jacobian[7 * i + 6, along] = (position - carriage) / length
        squared[7 * i + 6, along] = 1.0
    # Velocities of all coordinates follow from those of the sliders.
    rates = np.concatenate(
        (velocities, np.linalg.solve(jacobian[:, 3:], -jacobian[:, :3] @ velocities))
    )
    second = np.concatenate(
        (
            accelerations,
            np.linalg.solve(jacobian[:, 3:], -jacobian[:, :3] @ accelerations - squared @ rates**2),
        )
    )
    # Of the equations, those of all coordinates but the heights give the multipliers.
    left = inertia * second - pull
    multipliers = np.linalg.solve(jacobian[:, 3:].T, left[3:])
    friction = np.multiply(masses.viscous, velocities) + masses.coulomb * np.sign(velocities)
    return left[:3] - jacobian[:, :3].T @ multipliers + friction


@pytest.mark.parametrize("heavy_arms", [False, True], ids=["light arms", "heavy arms"])
def test_forces_are_those_of_a_constrained_lagrangian(heavy_arms, monkeypatch):
    # Of four motions the last one is in a block of its own.
    monkeypatch.setattr("tri_glide_kinematics.dynamics.slider_forces.BLOCK", 3)
    rng = np.random.default_rng(27)
    for _ in range(60):
        slider_forces = random_forces(rng, heavy_arms=heavy_arms)
        motion = random_motion(slider_forces.machine, rng, 4)
        batch = slider_forces.forces_batch(*motion)
        for row, *values in zip(batch, *(each.tolist() for each in motion)):
            expected = lagrangian_forces(slider_forces, *map(np.array, values))
            found = slider_forces.forces(*values)
            size = np.linalg.norm(expected)
            assert np.linalg.norm(found - expected) < 1e-11 * size
            assert np.linalg.norm(row - expected) < 1e-11 * size


def test_forces_are_those_of_mujoco():
    """Kept by ``python -m benchmarks.mujoco_forces --write``."""
    kept = json.loads(MUJOCO.read_text())
    assert len(kept) == 12
    for each in kept:
        masses = each["masses"]
        arms = tuple(Arm(**arm) for arm in masses.pop("arms"))
        machine = TriGlide(TriGlideGeometry(**each["geometry"]))
        found = SliderForces(machine, Masses(arms=arms, **masses)).forces(*each["motion"])
        expected = np.array(each["forces"])
        assert np.linalg.norm(found - expected) < 1e-9 * np.linalg.norm(expected)


def test_forces_of_a_motion_of_the_platform_are_those_of_its_sliders():
    rng = np.random.default_rng(3)
    for _ in range(50):
        slider_forces = random_forces(rng)
        machine = slider_forces.machine
        heights, velocities, _ = (each[0] for each in random_motion(machine, rng, 1))
        position, velocity = machine.forward_velocity(heights, velocities)
        acceleration = rng.normal(size=3)
        found = slider_forces.at(position, velocity, acceleration)
        # The accelerations of the sliders by central differences of fourth order.
        step = 2e-4
        rates = [
            machine.inverse_velocity(
                np.add(position, t * np.array(velocity)) + 0.5 * t * t * acceleration,
                velocity + t * acceleration,
            )[1]
            for t in (-2 * step, -step, step, 2 * step)
        ]
        second = np.array([1.0, -8.0, 8.0, -1.0]) @ np.array(rates) / (12.0 * step)
        expected = slider_forces.forces(heights, velocities, second)
        assert np.linalg.norm(np.subtract(found, expected)) < 1e-6 * np.linalg.norm(expected)


def test_forces_take_the_same_power_as_energy_and_friction():
    """Over 200 motions: the work of the drives is the change of energy, and the losses."""
    rng = np.random.default_rng(1)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    worst = 0.0
    for _ in range(200):
        slider_forces = random_forces(rng)
        machine, masses = slider_forces.machine, slider_forces.masses
        start, velocity, acceleration = (each[0] for each in random_motion(machine, rng, 1))
        jerk = 100.0 * rng.normal(size=3)
        duration = 0.004
        t = (0.5 * duration * (nodes + 1.0))[:, np.newaxis]
        second = acceleration + jerk * t
        rates = velocity + acceleration * t + jerk * t**2 / 2
        heights = start + velocity * t + acceleration * t**2 / 2 + jerk * t**3 / 6
        forces = slider_forces.forces_batch(heights, rates, second)
        lost = (np.abs(rates) * masses.coulomb + rates**2 * masses.viscous).sum(axis=1)
        work = 0.5 * duration * weights @ ((forces * rates).sum(axis=1) - lost)
        t = duration
        end = start + velocity * t + acceleration * t**2 / 2 + jerk * t**3 / 6
        end_rates = velocity + acceleration * t + jerk * t**2 / 2
        before = slider_forces.energy(start, velocity)
        after = slider_forces.energy(end, end_rates)
        size = before.kinetic + after.kinetic + abs(before.potential) + abs(after.potential)
        worst = max(worst, abs(work - (sum(after) - sum(before))) / size)
    assert worst < 1e-12


@settings(reproducible, max_examples=many(60))
@given(st.integers(0, 2**32 - 1))
def test_forces_and_accelerations_are_inverse(seed):
    rng = np.random.default_rng(seed)
    slider_forces = random_forces(rng, heavy_arms=bool(rng.integers(2)))
    heights, velocities, accelerations = (
        each[0] for each in random_motion(slider_forces.machine, rng, 1, 50.0)
    )
    forces = slider_forces.forces(heights, velocities, accelerations)
    back = slider_forces.accelerations(heights, velocities, forces)
    assert np.linalg.norm(np.subtract(back, accelerations)) < 1e-9 * np.linalg.norm(accelerations)


def test_mass_matrix_and_bias_are_parts_of_the_forces():
    rng = np.random.default_rng(5)
    for _ in range(50):
        slider_forces = random_forces(rng, heavy_arms=True)
        heights, velocities, accelerations = (
            each[0] for each in random_motion(slider_forces.machine, rng, 1)
        )
        matrix = np.array(slider_forces.mass_matrix(heights))
        assert (matrix == matrix.T).all()
        assert np.linalg.eigvalsh(matrix).min() > 0.0
        kinetic = slider_forces.energy(heights, velocities).kinetic
        assert kinetic == pytest.approx(0.5 * velocities @ matrix @ velocities, rel=1e-11)
        masses = slider_forces.masses
        friction = masses.viscous * velocities + masses.coulomb * np.sign(velocities)
        parts = matrix @ accelerations + slider_forces.bias(heights, velocities) + friction
        assert slider_forces.forces(heights, velocities, accelerations) == pytest.approx(parts)


def test_a_payload_adds_to_the_platform():
    empty = SliderForces(MACHINE, Masses.uniform(1.0, 0.2, 0.6))
    full = SliderForces(MACHINE, Masses.uniform(1.0, 0.2, 1.1))
    motion = ((0.55, 0.6, 0.62), (0.1, -0.2, 0.3), (3.0, 4.0, -5.0))
    assert empty.with_payload(0.5).forces(*motion) == pytest.approx(full.forces(*motion))


def test_forces_along_a_path_are_linear_in_its_timing():
    rng = np.random.default_rng(8)
    for _ in range(20):
        slider_forces = random_forces(rng)
        positions = random_positions(slider_forces.machine, rng, 5, 20.0)
        tangents, curvatures = rng.normal(size=(2, 5, 3))
        speeds, accelerations = rng.normal(size=(2, 5))
        speeds[0] = 0.0
        found = slider_forces.along_path(positions, tangents, curvatures).at(speeds, accelerations)
        velocities = tangents * speeds[:, None]
        second = tangents * accelerations[:, None] + curvatures * speeds[:, None] ** 2
        for row, *motion in zip(found, positions, velocities, second):
            assert row == pytest.approx(slider_forces.at(*motion), rel=1e-11, abs=1e-10)


def check_friction(slider_forces, heights, rates, forces, accelerations):
    """Whether the friction of each slider at rest is one that it can have, for its motion."""
    matrix = np.array(slider_forces.mass_matrix(heights))
    left = forces - matrix @ accelerations - slider_forces.bias(heights, rates)
    left -= np.multiply(slider_forces.masses.viscous, rates)
    for rest, rate, acceleration, most in zip(
        left, rates, accelerations, slider_forces.masses.coulomb
    ):
        direction = np.sign(rate) or np.sign(acceleration)
        if direction:
            assert rest == pytest.approx(direction * most, abs=1e-9)
        else:
            assert abs(rest) <= most + 1e-9


def test_sliders_at_rest_stay_or_move_as_dry_friction_allows():
    rng = np.random.default_rng(12)
    stayed = np.zeros(3)
    for _ in range(200):
        slider_forces = random_forces(rng)
        heights, rates, _ = (each[0] for each in random_motion(slider_forces.machine, rng, 1, 50.0))
        rates[rng.random(3) < 0.7] = 0.0
        forces = np.array(slider_forces.bias(heights, rates)) + rng.normal(size=3) * 12.0
        accelerations = slider_forces.accelerations(heights, rates, forces)
        check_friction(slider_forces, heights, rates, forces, np.array(accelerations))
        stayed += (rates == 0.0) & (np.array(accelerations) == 0.0)
    assert (stayed > 15).all()


def test_friction_holds_a_weight_that_it_can_hold():
    masses = Masses.uniform(1.0, 0.2, 0.6, coulomb=20.0)
    slider_forces = SliderForces(MACHINE, masses)
    rest = ((0.6, 0.61, 0.58), (0.0,) * 3)
    # Nobody pushes, and the weight on each slider is less than its friction.
    assert slider_forces.accelerations(*rest, (0.0,) * 3) == (0.0,) * 3
    assert slider_forces.step(*rest, (0.0,) * 3, 0.001) == rest


def test_a_simulated_slider_comes_to_rest_and_stays():
    masses = Masses.uniform(1.0, 0.2, 0.6, coulomb=25.0, viscous=400.0)
    slider_forces = SliderForces(MACHINE, masses)
    heights, rates = (0.6, 0.6, 0.6), (0.3, -0.4, 0.2)
    still = 0
    for _ in range(200):
        heights, rates = slider_forces.step(heights, rates, (0.0,) * 3, 0.002)
        still = still + 1 if rates == (0.0,) * 3 else 0
    assert still > 100


def test_a_simulation_is_as_good_as_the_square_of_its_step():
    """Forces of a motion, driven in steps, give the motion back."""
    rng = np.random.default_rng(2)
    slider_forces = SliderForces(MACHINE, random_masses(rng, heavy_arms=True))
    start, turn = np.array((0.55, 0.6, 0.65)), np.array((7.0, 9.0, 11.0))
    size = 0.02

    def motion(t):
        return (
            start + size * np.sin(turn * t + 0.3),
            size * turn * np.cos(turn * t + 0.3),
            -size * turn**2 * np.sin(turn * t + 0.3),
        )

    errors = []
    for steps in (50, 100):
        # To where no slider has turned, as forces jump there.
        step = 0.1 / steps
        heights, rates, _ = motion(0.0)
        for k in range(steps):
            forces = slider_forces.forces(*motion((k + 0.5) * step))
            heights, rates = slider_forces.step(heights, rates, forces, step)
        errors.append(np.linalg.norm(np.subtract(rates, motion(0.1)[1])))
    assert errors[0] < 1e-5
    assert errors[1] < 0.3 * errors[0]


def test_places_without_a_pose_are_refused():
    slider_forces = SliderForces(MACHINE, Masses.uniform(1.0, 0.2, 0.6))
    apart = (0.0, 1.0, 2.0)
    zero = (0.0, 0.0, 0.0)
    with pytest.raises(NoPoseError):
        slider_forces.forces(apart, zero, zero)
    with pytest.raises(NoPoseError):
        slider_forces.accelerations(apart, zero, zero)
    level = (0.6, 0.6, 0.6)
    found = slider_forces.forces_batch(
        [apart, level, level], [zero] * 3, [zero, zero, (math.inf,) * 3]
    )
    assert np.isnan(found[[0, 2]]).all()
    assert found[1] == pytest.approx(slider_forces.forces(level, zero, zero))
    path = slider_forces.along_path([(0.0, 0.0, 0.2), (5.0, 0.0, 0.2)], [zero] * 2, [zero] * 2)
    assert np.isnan(path.rest).tolist() == [[False] * 3, [True] * 3]


@pytest.mark.parametrize("name", ["heights", "velocities", "accelerations"])
def test_numbers_that_are_not_finite_are_named(name):
    slider_forces = SliderForces(MACHINE, Masses.uniform(1.0, 0.2, 0.6))
    motion = {"heights": [0.6] * 3, "velocities": [0.0] * 3, "accelerations": [0.0] * 3}
    motion[name][1] = math.inf
    with pytest.raises(NotFiniteError):
        slider_forces.forces(**motion)
    motion[name] = [0.6, 0.6]
    with pytest.raises(WrongShapeError, match=r"has shape \(2,\)"):
        slider_forces.forces(**motion)
