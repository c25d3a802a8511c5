"""The largest force of the soak of sizing is that of the worst directions."""

import numpy as np

from benchmarks.soak_sizing import largest_forces
from tri_glide_kinematics.dynamics import SliderForces
from tri_glide_kinematics.sizing import Wish, sizing_of
from tri_glide_kinematics.workspace import Cylinder


def test_no_direction_needs_more_and_one_needs_nearly_as_much():
    wish = Wish(Cylinder(0.0, 0.0, 0.12, 0.1, 0.25), 1.5, 10.0, payload=0.2, arm_density=2.0)
    sizing = sizing_of(wish, 0.2, 0.4)
    place = np.array((0.08, -0.05, 0.2))
    allowed = float(largest_forces(sizing, place[np.newaxis])[0])
    machine, forces = sizing.machine, SliderForces(sizing.machine, sizing.masses)
    heights = np.array(machine.inverse(place))
    jacobian = np.array(machine.jacobian(place))
    directions = np.random.default_rng(3).normal(size=(2, 30000, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    velocities, accelerations = wish.speed * directions[0], wish.acceleration * directions[1]
    rates = velocities @ jacobian.T
    squares = np.square(velocities[:, :2]).sum(axis=1)[:, np.newaxis]
    squares = squares + np.square(rates - velocities[:, 2:])
    sliders = accelerations @ jacobian.T - squares / (heights - place[2])
    found = np.abs(forces.forces_batch(np.tile(heights, (30000, 1)), rates, sliders)).max()
    assert 0.95 * allowed < found <= allowed * (1.0 + 1e-12)
