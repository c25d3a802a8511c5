"""The closed forms of ``slider_forces.py`` over arrays, for a million poses at a time.

Arrays have their components first, shape (3, n). As in ``tri_glide/batch.py``, the poses are worked
through in blocks, whose intermediate results stay in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.dynamics.masses import Masses
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3

# Poses per block. There are more intermediate results than in the kinematics, so it is smaller.
BLOCK = 8_000


class Constants(NamedTuple):
    r"""The masses of a machine in the velocities of its sliders and of its platform.

    Attributes:
        sliders: mass that moves with each slider. Shape (3,) [kg].
        couplings: mass of each arm between slider and platform. Shape (3,) [kg].
        platform: mass that moves with the platform [kg].
        weights: forces of gravity on the sliders, upwards. Shape (3,) [N].
        weight: force of gravity on the platform. Shape (3,) [N].
    """

    sliders: Vector3
    couplings: Vector3
    platform: float
    weights: Vector3
    weight: Vector3

    @classmethod
    def of(cls, lengths: Sequence[float], masses: Masses) -> Constants:
        """Return those of a machine with arms of these ``lengths``. Shape (3,) [m]."""
        sliders, couplings, weights = [], [], []
        platform = hung = masses.platform + masses.payload
        gravity = masses.gravity
        for length, arm, carriage, counterweight in zip(
            lengths, masses.arms, masses.carriages, masses.counterweights
        ):
            near, coupling, far = arm.end_masses(length)
            sliders.append(carriage + counterweight + near)
            couplings.append(coupling)
            platform += far
            # The weight of an arm is shared out to its ends as by a lever.
            hung += arm.mass * arm.centre
            weights.append(gravity[2] * (carriage - counterweight + arm.mass * (1.0 - arm.centre)))
        return cls(
            (sliders[0], sliders[1], sliders[2]),
            (couplings[0], couplings[1], couplings[2]),
            platform,
            (weights[0], weights[1], weights[2]),
            (gravity[0] * hung, gravity[1] * hung, gravity[2] * hung),
        )


class Arms(NamedTuple):
    """Directions of the arms at many poses.

    Attributes:
        inverse_rises: Shape (3, n) [1/m].
        x: horizontal part of each arm over its rise, in x. Shape (3, n).
        y: the same in y. Shape (3, n).
        dx: the same in x, less that of arm 1, of arms 2 and 3. Shape (2, n).
        dy: the same in y. Shape (2, n).
        inverse: of the determinant of the Jacobian. Shape (n,).
    """

    inverse_rises: FloatArray
    x: FloatArray
    y: FloatArray
    dx: FloatArray
    dy: FloatArray
    inverse: FloatArray

    @classmethod
    def at(cls, machine: TriGlide, heights: FloatArray, positions: FloatArray) -> Arms:
        """Return those at ``heights`` and ``positions`` that belong together. Shape (n, 3) [m]."""
        anchors_x, anchors_y = np.array(machine.geometry.anchors).T[:, :, np.newaxis]
        place_x, place_y, place_z = positions.T
        inverse_rises = 1.0 / (heights.T - place_z)
        x = anchors_x - place_x
        x *= inverse_rises
        y = anchors_y - place_y
        y *= inverse_rises
        dx = x[1:] - x[0]
        dy = y[1:] - y[0]
        return cls(inverse_rises, x, y, dx, dy, 1.0 / (dx[0] * dy[1] - dy[0] * dx[1]))

    def height_rates(self, platform: FloatArray) -> FloatArray:
        """Return the Jacobian times rates of the ``platform``. Shape (3, n)."""
        return np.asarray(self.x * platform[0] + self.y * platform[1] + platform[2])

    def platform_rates(self, heights: FloatArray) -> FloatArray:
        """Return the inverse Jacobian times rates of the ``heights``. Shape (3, n)."""
        steps = heights[1:] - heights[0]
        steps *= self.inverse
        rates = np.empty_like(heights)
        x, y, z = rates
        np.subtract(steps[0] * self.dy[1], steps[1] * self.dy[0], out=x)
        np.subtract(steps[1] * self.dx[0], steps[0] * self.dx[1], out=y)
        np.subtract(heights[0], self.x[0] * x, out=z)
        z -= self.y[0] * y
        return rates

    def squares(self, heights: FloatArray, platform: FloatArray) -> FloatArray:
        """Return the squared speed of each arm's end against the other, over its rise.

        Args:
            heights: rates of the heights. Shape (3, n).
            platform: rates of the platform. Shape (3, n).
        """
        squares = heights - platform[2]
        squares *= squares
        squares += platform[0] * platform[0] + platform[1] * platform[1]
        squares *= self.inverse_rises
        return squares

    def slider_forces(self, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        """Return the forces of the sliders that push the platform with a force. Shape (3, n)."""
        forces = np.empty((3, len(z)))
        across_x = x - self.x[0] * z
        across_x *= self.inverse
        across_y = y - self.y[0] * z
        across_y *= self.inverse
        np.subtract(across_x * self.dy[1], across_y * self.dx[1], out=forces[1])
        np.subtract(across_y * self.dx[0], across_x * self.dy[0], out=forces[2])
        np.subtract(z, forces[1], out=forces[0])
        forces[0] -= forces[2]
        return forces


def driven(
    constants: Constants, arms: Arms, heights: FloatArray, platform: FloatArray
) -> FloatArray:
    """Return the forces for second derivatives, without weight and friction.

    Args:
        constants: of the machine.
        arms: at the poses.
        heights: second derivatives. Shape (3, n).
        platform: second derivatives that belong to them. Shape (3, n).
    """
    sliders = np.array(constants.sliders)[:, np.newaxis]
    b1, b2, b3 = constants.couplings
    x, y, z = constants.platform * platform
    z += b1 * heights[0]
    z += b2 * heights[1]
    z += b3 * heights[2]
    forces = arms.slider_forces(x, y, z)
    forces += sliders * heights
    forces += np.array(constants.couplings)[:, np.newaxis] * platform[2]
    return forces


def held(constants: Constants, arms: Arms) -> FloatArray:
    """Return the forces that hold the weight. Shape (3, n) [N]."""
    force = np.broadcast_to(-np.array(constants.weight)[:, np.newaxis], (3, len(arms.inverse)))
    return arms.slider_forces(*force) - np.array(constants.weights)[:, np.newaxis]


def forces_batch(
    constants: Constants,
    machine: TriGlide,
    heights: FloatArray,
    velocities: FloatArray,
    accelerations: FloatArray,
    masses: Masses,
) -> FloatArray:
    """Return the forces for many motions of the sliders, as ``SliderForces.forces_batch``."""
    coulomb = np.array(masses.coulomb)[:, np.newaxis]
    viscous = np.array(masses.viscous)[:, np.newaxis]
    count = len(heights)
    result = np.empty((3, count))
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        for start in range(0, count, BLOCK):
            block = slice(start, min(start + BLOCK, count))
            rows = heights[block]
            arms = Arms.at(machine, rows, machine.forward_batch(rows))
            rates = np.ascontiguousarray(velocities[block].T)
            second = np.ascontiguousarray(accelerations[block].T)
            bends = arms.squares(rates, arms.platform_rates(rates))
            bends += second
            forces = driven(constants, arms, second, arms.platform_rates(bends))
            forces += held(constants, arms)
            forces += viscous * rates
            forces += coulomb * np.sign(rates)
            # An infinity would leave infinite forces, where one call raises an error.
            forces[:, ~np.isfinite(forces.sum(axis=0))] = np.nan
            result[:, block] = forces
    return result.T
