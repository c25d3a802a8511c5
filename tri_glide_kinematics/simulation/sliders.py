"""Three simulated sliders with their drives and encoders, and with faults. No ROS in here.

A drive that exerts forces holds its slider at the setpoint as a spring and a damper would, and adds
the force that the setpoint says. It goes from one setpoint to the next in a straight line of
heights, velocities and forces, as drives do that interpolate. The masses move by
``SliderForces.step``.
"""

from __future__ import annotations

import math
import random
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

from tri_glide_kinematics.checks import checked_vector, positive
from tri_glide_kinematics.dynamics import SliderForces
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3, minus, plus, three

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


@dataclass(frozen=True)
class SimulatedPlate:
    """A plane that stops nothing: the platform goes on into it, as a probe with a spring does.

    Attributes:
        height: on the z axis [m].
        slope_x: by how much it rises along x [m/m].
        slope_y: by how much it rises along y [m/m].
    """

    height: float
    slope_x: float
    slope_y: float

    def is_touched(self, position: Vector3) -> bool:
        """Tell whether the platform's centre is on the plate or below it."""
        x, y, z = position
        return z <= self.height + self.slope_x * x + self.slope_y * y


@dataclass(frozen=True)
class TrueMachine:
    """What a machine is, whatever those who lead it know of it.

    Attributes:
        machine: its geometry.
        offsets: true height of each slider minus the one that its drive reports. Shape (3,) [m].
    """

    machine: TriGlide
    offsets: Vector3

    def position(self, heights: Vector3) -> Vector3:
        """Return where the platform is at ``heights``, as the drives report them. Shape (3,) [m].

        Raises:
            KinematicsError: if the arms do not meet.
        """
        return self.machine.forward(plus(heights, self.offsets))

    def heights(self, position: Vector3, velocity: Vector3) -> tuple[Vector3, Vector3]:
        """Return the heights of the sliders, by the scale of their drives, and their rates.

        Args:
            position: of the platform. Shape (3,) [m].
            velocity: of the platform. Shape (3,) [m/s].

        Raises:
            KinematicsError: if the arms do not reach there.
        """
        heights, rates = self.machine.inverse_velocity(position, velocity)
        return minus(heights, self.offsets), rates


@dataclass(frozen=True)
class SliderFaults:
    """What is wrong with the simulated machine.

    Attributes:
        drop_out: part of the measurements that gets lost, 0 to 1.
        frozen_encoders: encoders that show what they showed before.
        encoder_offsets: added to the measured heights [m].
        stuck_sliders: sliders that do not move.
    """

    drop_out: float = 0.0
    frozen_encoders: Sequence[bool] = (False, False, False)
    encoder_offsets: Sequence[float] = (0.0, 0.0, 0.0)
    stuck_sliders: Sequence[bool] = (False, False, False)


class SimulatedSliders:
    """Sliders that follow a commanded height, between two hard stops.

    They do so with a first-order lag, or as drives that exert forces let them.

    Attributes:
        lag: time constant [s], 0 for none; of no use with ``drives``.
        drives: that exert forces; None for sliders without masses.
        encoder_resolution: step of the measured heights [m], 0 for exact ones.
        faults: what is wrong.
    """

    def __init__(self, heights: Sequence[float], lower: Sequence[float], upper: Sequence[float]):
        """Begin at ``heights``, standing still, between the stops ``lower`` and ``upper`` [m]."""
        self.lag = 0.0
        self.drives: SimulatedDrives | None = None
        self.encoder_resolution = 0.0
        self.faults = SliderFaults()
        self._lower = tuple(lower)
        self._upper = tuple(upper)
        self._heights = list(heights)
        self._velocities = [0.0, 0.0, 0.0]
        self._commanded = list(heights)
        self._setpoint: Setpoint | None = None
        self._measured = list(heights)
        self._random = random.Random(1)

    @property
    def heights(self) -> Vector3:
        """Where the sliders are, by the scale of their drives. Shape (3,) [m]."""
        return three(self._heights)

    @property
    def exerted(self) -> Vector3 | None:
        """Forces of the drives in the last step; None without masses. Shape (3,) [N]."""
        return self.drives.exerted if self.drives is not None else None

    def command(self, setpoint: Setpoint) -> None:
        """Send the sliders to a ``setpoint``; they stop at the ends of their travel."""
        self._setpoint = setpoint
        for slider, height in enumerate(setpoint.heights):
            self._commanded[slider] = self._inside(slider, height)

    def step(self, dt: float) -> None:
        """Move for ``dt`` [s] towards the latest command.

        Raises:
            KinematicsError: if drives that exert forces have moved the machine to where it has no
                pose; the sliders stay where they were.
        """
        if self.drives is not None:
            self._drive(self.drives, dt)
            return
        part = 1.0 - math.exp(-dt / self.lag) if self.lag > 0.0 else 1.0
        for slider, stuck in enumerate(self.faults.stuck_sliders):
            way = 0.0 if stuck else part * (self._commanded[slider] - self._heights[slider])
            self._heights[slider] += way
            self._velocities[slider] = way / dt

    def _drive(self, drives: SimulatedDrives, dt: float) -> None:
        """Let the drives move the machine; where it is stopped, it has no velocity any more."""
        if self._setpoint is not None:
            setpoint = self._setpoint._replace(heights=three(self._commanded))
            # The last setpoint holds as long as no newer one comes.
            self._setpoint = None
        else:
            setpoint = drives.held(three(self._commanded))
        moved = drives.step(self.heights, three(self._velocities), setpoint, dt)
        for slider, (height, velocity) in enumerate(zip(*moved)):
            stuck, inside = self.faults.stuck_sliders[slider], self._inside(slider, height)
            self._velocities[slider] = 0.0 if stuck or inside != height else velocity
            self._heights[slider] = self._heights[slider] if stuck else inside

    def _inside(self, slider: int, height: float) -> float:
        return min(max(height, self._lower[slider]), self._upper[slider])

    def measure(
        self, seen: tuple[Vector3, Vector3] | None = None
    ) -> tuple[Vector3, Vector3] | None:
        """Return what the encoders show, heights [m] and velocities [m/s]; None for a drop-out.

        Args:
            seen: what they look at, if that is something else than the sliders at their drives.
        """
        faults = self.faults
        heights, rates = seen or (self._heights, self._velocities)
        velocities = list(rates)
        for slider, frozen in enumerate(faults.frozen_encoders):
            if frozen:
                velocities[slider] = 0.0
            else:
                height = heights[slider] + faults.encoder_offsets[slider]
                self._measured[slider] = self._rounded(height)
        if faults.drop_out > 0.0 and self._random.random() < faults.drop_out:
            return None
        return three(self._measured), three(velocities)

    def _rounded(self, height: float) -> float:
        step = self.encoder_resolution
        return round(height / step) * step if step > 0.0 else height


# Drives that take each setpoint for its period wait so long for a late one [s].
PATIENCE = 0.5


class DriveTime:
    """What the drives do in a cycle, and for how long: it is they for whom time passes.

    They go to the newest setpoint, for the time of the cycle. Or they take each setpoint for the
    period of the setpoints, however late it comes: then nothing that they do tells how busy the
    computer is.
    """

    def __init__(self, setpoint_period: float = 0.0) -> None:
        """Take each setpoint for ``setpoint_period`` [s]; 0 to go to the newest one."""
        self._setpoint_period = setpoint_period
        self._waiting: list[Setpoint] = []
        self._silence = 0.0

    def command(self, setpoint: Setpoint) -> None:
        """Give the drives a ``setpoint``."""
        if self._setpoint_period <= 0.0:
            self._waiting.clear()
        self._waiting.append(setpoint)

    def steps(self, period: float) -> list[tuple[Setpoint | None, float]]:
        """Return the steps of a cycle that lasts for a ``period`` [s].

        Returns:
            A new setpoint, or None for the last one, and how long the drives go for it [s].
            No step while a setpoint is late.
        """
        waiting, self._waiting = self._waiting, []
        if self._setpoint_period <= 0.0:
            return [(waiting[-1] if waiting else None, period)]
        if waiting:
            self._silence = 0.0
            return [(setpoint, self._setpoint_period) for setpoint in waiting]
        self._silence += period
        return [(None, period)] if self._silence > PATIENCE else []


class SimulatedOutputs:
    """Outputs that follow what they are told while there are signs of life, and else are safe."""

    def __init__(self, switched_off: Collection[str], patience: float) -> None:
        """Have no outputs yet.

        Args:
            switched_off: names of those that are 0 where there is no sign of life; the others keep
                their values.
            patience: longest time without one [s].
        """
        self._switched_off = switched_off
        self._patience = patience
        self._heard_at = -math.inf
        # By name and number: what they are to be, and are.
        self._wanted: dict[tuple[str, int], float] = {}
        self._values: dict[tuple[str, int], float] = {}

    def hear(self, now: float) -> None:
        """Take in a sign of life [s]."""
        self._heard_at = now

    def set(self, name: str, number: int, value: float) -> None:
        """Have an output changed by the next ``look``."""
        self._wanted[name, number] = value

    def look(self, now: float) -> list[tuple[str, int, float]]:
        """Return name, number and value of the outputs that change ``now`` [s]."""
        if now - self._heard_at > self._patience:
            for name, number in self._wanted:
                if name in self._switched_off:
                    self._wanted[name, number] = 0.0
        changed = self._wanted.items() - self._values.items()
        self._values.update(changed)
        return [(*key, value) for key, value in changed]
