"""Simulated drives that exert forces: position control with feed-forward, and the machine's masses.

A drive holds its slider at the setpoint as a spring and a damper would, and adds the force that the
setpoint says. It goes from one setpoint to the next in a straight line of heights, velocities and
forces, as drives do that interpolate. The masses move by ``SliderForces.step``.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

from tri_glide_kinematics.checks import checked_vector, positive
from tri_glide_kinematics.dynamics import SliderForces
from tri_glide_kinematics.vectors import Vector3

# A step of the simulation is no longer than this [s].
LONGEST_STEP = 0.0005

NO_FORCES: Vector3 = (0.0, 0.0, 0.0)


class Setpoint(NamedTuple):
    """What the drives are sent.

    Attributes:
        heights: Shape (3,) [m].
        velocities: Shape (3,) [m/s].
        forces: feed-forward. Shape (3,) [N].
    """

    heights: Vector3
    velocities: Vector3 = (0.0, 0.0, 0.0)
    forces: Vector3 = NO_FORCES


@dataclass(frozen=True)
class PositionControl:
    """How the drives of the sliders hold their setpoints.

    Attributes:
        stiffness: force for each metre of error. Shape (3,) [N/m].
        damping: force for each metre per second of error. Shape (3,) [N s/m].
    """

    stiffness: Vector3
    damping: Vector3

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            WrongShapeError: if there are not three numbers.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a number is not greater than zero.
        """
        for name, unit in (("stiffness", "N/m"), ("damping", "N s/m")):
            checked = checked_vector(name, getattr(self, name), positive, unit)
            object.__setattr__(self, name, checked)


class SimulatedDrives:
    """Drives under position control, and the masses that they move.

    Attributes:
        forces: of the machine as it is.
        control: of the drives.
        exerted: forces of the drives in the last step. Shape (3,) [N].
    """

    def __init__(self, forces: SliderForces, control: PositionControl, heights: Vector3) -> None:
        """Begin at rest at ``heights`` [m], held there by the forces that this needs."""
        still = (0.0, 0.0, 0.0)
        self.forces = forces
        self.control = control
        self.exerted = forces.forces(heights, still, still)
        self._setpoint = Setpoint(heights, still, self.exerted)

    def step(
        self, heights: Vector3, velocities: Vector3, setpoint: Setpoint, dt: float
    ) -> tuple[Vector3, Vector3]:
        """Go over to a ``setpoint`` in ``dt`` [s].

        Args:
            heights: of the sliders. Shape (3,) [m].
            velocities: of the sliders. Shape (3,) [m/s].
            setpoint: for the end of the step.
            dt: of the step [s].

        Returns:
            Heights and velocities of the sliders after it.

        Raises:
            KinematicsError: if the machine has no pose there.
        """
        count = max(ceil(dt / LONGEST_STEP), 1)
        before = self._setpoint
        for number in range(count):
            part = (number + 0.5) / count
            wanted = [[a + part * (b - a) for a, b in zip(*rows)] for rows in zip(before, setpoint)]
            f1, f2, f3 = (
                force + stiff * (height - own) + damp * (velocity - rate)
                for height, velocity, force, own, rate, stiff, damp in zip(
                    *wanted, heights, velocities, self.control.stiffness, self.control.damping
                )
            )
            self.exerted = f1, f2, f3
            heights, velocities = self.forces.step(heights, velocities, self.exerted, dt / count)
        self._setpoint = setpoint
        return heights, velocities

    def held(self, heights: Vector3) -> Setpoint:
        """Return the setpoint that rests at ``heights`` [m] with the forces of the last one."""
        return Setpoint(heights, forces=self._setpoint.forces)
