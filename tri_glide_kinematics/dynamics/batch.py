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
BLOCK = 6_000

# Numbers of ``Arms`` for each pose.
ROWS = 16


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
        dx: the same in x, less that of arm 1, of arms 2 and 3; both over the determinant of the
            Jacobian. Shape (2, n).
        dy: the same in y. Shape (2, n).
        spare: to work with. Shape (3, n).
    """

    inverse_rises: FloatArray
    x: FloatArray
    y: FloatArray
    dx: FloatArray
    dy: FloatArray
    spare: FloatArray

    @classmethod
    def at(
        cls,
        machine: TriGlide,
        heights: FloatArray,
        positions: FloatArray,
        room: FloatArray | None = None,
    ) -> Arms:
        """Return those at ``heights`` and ``positions`` that belong together.

        Args:
            machine: whose arms they are.
            heights: Shape (n, 3) [m].
            positions: Shape (n, 3) [m].
            room: where they are written; new memory for each block would take a third of the time.
                Shape (ROWS, n).
        """
        if room is None:
            room = np.empty((ROWS, len(heights)))
        arms = cls(room[:3], room[3:6], room[6:9], room[9:11], room[11:13], room[13:])
        inverse_rises, x, y, dx, dy, (determinant, term, _) = arms
        anchors_x, anchors_y = np.array(machine.geometry.anchors).T[:, :, np.newaxis]
        place_x, place_y, place_z = positions.T
        np.subtract(heights.T, place_z, out=inverse_rises)
        np.divide(1.0, inverse_rises, out=inverse_rises)
        np.subtract(anchors_x, place_x, out=x)
        x *= inverse_rises
        np.subtract(anchors_y, place_y, out=y)
        y *= inverse_rises
        np.subtract(x[1:], x[0], out=dx)
        np.subtract(y[1:], y[0], out=dy)
        np.multiply(dx[0], dy[1], out=determinant)
        np.multiply(dy[0], dx[1], out=term)
        determinant -= term
        np.divide(1.0, determinant, out=determinant)
        dx *= determinant
        dy *= determinant
        return arms

    def height_rates(self, platform: FloatArray) -> FloatArray:
        """Return the Jacobian times rates of the ``platform``. Shape (3, n)."""
        return np.asarray(self.x * platform[0] + self.y * platform[1] + platform[2])

    def platform_rates(self, heights: FloatArray) -> FloatArray:
        """Return the inverse Jacobian times rates of the ``heights``. Shape (3, n)."""
        step2, step3, term = self.spare
        (dx2, dx3), (dy2, dy3) = self.dx, self.dy
        rates = np.empty(heights.shape)
        x, y, z = rates
        np.subtract(heights[1:], heights[0], out=self.spare[:2])
        np.multiply(step2, dy3, out=x)
        x -= np.multiply(step3, dy2, out=term)
        np.multiply(step3, dx2, out=y)
        y -= np.multiply(step2, dx3, out=term)
        np.subtract(heights[0], np.multiply(self.x[0], x, out=term), out=z)
        z -= np.multiply(self.y[0], y, out=term)
        return rates

    def squares(self, heights: FloatArray, platform: FloatArray) -> FloatArray:
        """Return the squared speed of each arm's end against the other, over its rise.

        Args:
            heights: rates of the heights. Shape (3, n).
            platform: rates of the platform. Shape (3, n).
        """
        across, term, _ = self.spare
        squares = heights - platform[2]
        squares *= squares
        np.multiply(platform[0], platform[0], out=across)
        across += np.multiply(platform[1], platform[1], out=term)
        squares += across
        squares *= self.inverse_rises
        return squares

    def slider_forces(self, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        """Return the forces of the sliders that push the platform with a force. Shape (3, n)."""
        across_x, across_y, term = self.spare
        (dx2, dx3), (dy2, dy3) = self.dx, self.dy
        forces = np.empty((3, len(z)))
        first, second, third = forces
        np.subtract(x, np.multiply(self.x[0], z, out=term), out=across_x)
        np.subtract(y, np.multiply(self.y[0], z, out=term), out=across_y)
        np.multiply(across_x, dy3, out=second)
        second -= np.multiply(across_y, dx3, out=term)
        np.multiply(across_y, dx2, out=third)
        third -= np.multiply(across_x, dy2, out=term)
        np.subtract(z, second, out=first)
        first -= third
        return forces


def driven(
    constants: Constants, arms: Arms, heights: FloatArray, platform: FloatArray
) -> FloatArray:
    """Return the forces for second derivatives, with the weight but without friction.

    Args:
        constants: of the machine.
        arms: at the poses.
        heights: second derivatives. Shape (3, n).
        platform: second derivatives that belong to them. Shape (3, n).
    """
    x, y, z = force = constants.platform * platform
    for coupling, row in zip(constants.couplings, heights):
        z += np.multiply(coupling, row, out=arms.spare[0])
    force -= _column(constants.weight)
    forces = arms.slider_forces(x, y, z)
    forces += np.multiply(_column(constants.sliders), heights, out=arms.spare)
    forces += np.multiply(_column(constants.couplings), platform[2], out=arms.spare)
    forces -= _column(constants.weights)
    return forces


def forces_batch(
    constants: Constants,
    machine: TriGlide,
    heights: FloatArray,
    velocities: FloatArray,
    accelerations: FloatArray,
    masses: Masses,
) -> FloatArray:
    """Return the forces for many motions of the sliders, as ``SliderForces.forces_batch``."""
    coulomb, viscous = _column(masses.coulomb), _column(masses.viscous)
    count = len(heights)
    result = np.empty((3, count))
    buffers = np.empty((ROWS + 9, min(BLOCK, count)))
    positions = machine.forward_batch(heights)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        for start in range(0, count, BLOCK):
            block = slice(start, min(start + BLOCK, count))
            room = buffers[:, : block.stop - start]
            rates, second, friction = room[ROWS : ROWS + 3], room[-6:-3], room[-3:]
            arms = Arms.at(machine, heights[block], positions[block], room[:ROWS])
            np.copyto(rates, velocities[block].T)
            np.copyto(second, accelerations[block].T)
            bends = arms.squares(rates, arms.platform_rates(rates))
            bends += second
            forces = driven(constants, arms, second, arms.platform_rates(bends))
            forces += np.multiply(viscous, rates, out=friction)
            np.sign(rates, out=friction)
            friction *= coulomb
            np.add(forces, friction, out=result[:, block])
            # An infinity would leave infinite forces, where one call raises an error. The first
            # force holds all numbers: it is finite only if they are.
            np.copyto(result[:, block], np.nan, where=~np.isfinite(result[0, block]))
    return result.T


def _column(values: Sequence[float]) -> FloatArray:
    return np.array(values)[:, np.newaxis]
