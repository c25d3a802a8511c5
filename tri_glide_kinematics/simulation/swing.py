r"""A simulated platform that swings on its arms: second-order modes along x, y and z. No ROS.

Along one axis, a mode follows where the platform would be if nothing gave way, $u(t)$:

$$\ddot x + 2\zeta\omega\,(\dot x - \dot u) + \omega^2 (x - u) = 0.$$

For the swing $s = x - u$ this is $\ddot s + 2\zeta\omega\dot s + \omega^2 s = -\ddot u$. Where u is
linear in time, s swings freely; where its velocity changes, that of s changes by the opposite. So
between two steps the solution is known in closed form, and it is exact for any step.

Several modes along one axis swing side by side, each with its share: $x = u + \sum_k q_k s_k$.
What the shares leave of 1 follows u without any swing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from tri_glide_kinematics.checks import finite, finite_vector
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.motion.shaping import Mode
from tri_glide_kinematics.vectors import Vector3, three

AXES = 3


@dataclass(frozen=True)
class PlatformMode:
    """A mode along one axis.

    Attributes:
        axis: 0 to 2 for x, y and z.
        frequencies: without damping, at each of the points of its ``SwingModel``. Shape (n,) [Hz].
        damping: as part of the critical damping.
        share: of the swing along the axis, above 0 and up to 1.
    """

    axis: int
    frequencies: tuple[float, ...]
    damping: float
    share: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if one is NaN or infinite.
            OutOfBoundsError: if one is outside its bounds; those of ``Mode`` hold, too.
        """
        if self.axis not in range(AXES):
            raise OutOfBoundsError("axis", self.axis, "0, 1 or 2")
        for frequency in self.frequencies:
            Mode(frequency, self.damping)
        share = finite("share", self.share)
        if not 0.0 < share <= 1.0:
            raise OutOfBoundsError("share", share, "above 0 and at most 1")


@dataclass(frozen=True)
class SwingModel:
    """How a platform swings; without modes, it does not.

    Attributes:
        modes: along any of the axes, each with a frequency for each point.
        points: where the frequencies are known. Shape (n, 3) [m]. Between them, the squares of the
            distances weigh: the nearest point counts most, and far from all, each counts as much.
    """

    modes: tuple[PlatformMode, ...] = ()
    points: tuple[Vector3, ...] = ((0.0, 0.0, 0.0),)

    def __post_init__(self) -> None:
        """Check that all fits together.

        Raises:
            NotFiniteError: if a coordinate is NaN or infinite.
            WrongShapeError: if a mode has not one frequency for each point.
            OutOfBoundsError: if the shares of an axis are more than 1.
            KinematicsError: if there is no point, or one of them is given twice.
        """
        for index, point in enumerate(self.points):
            finite_vector(f"points[{index}]", point, AXES)
        if not self.points or len(set(self.points)) < len(self.points):
            raise KinematicsError(f"{len(self.points)} points must be different, and at least 1")
        for mode in self.modes:
            if len(mode.frequencies) != len(self.points):
                shape = (len(mode.frequencies),)
                raise WrongShapeError("frequencies", shape, f"({len(self.points)},)")
        for axis, letter in enumerate("xyz"):
            total = math.fsum(mode.share for mode in self.modes if mode.axis == axis)
            if total > 1.0 + 1e-9:
                raise OutOfBoundsError(f"sum of the shares along {letter}", total, "at most 1")

    def frequencies(self, position: Vector3) -> list[float]:
        """Return the frequency of each mode at a ``position`` [m]. Shape (number of modes,) [Hz].

        By inverse squared distances (Shepard 1968): at a point it is the one given there, and never
        outside the range of those given.
        """
        if len(self.points) == 1:
            return [mode.frequencies[0] for mode in self.modes]
        squares = [
            sum((a - b) ** 2 for a, b in zip(point, position, strict=True)) for point in self.points
        ]
        nearest = min(squares)
        # As parts of the nearest one: so no weight is infinite, at a point itself neither.
        weights = [nearest / square if square > 0.0 else 1.0 for square in squares]
        total = math.fsum(weights)
        return [
            math.fsum(weight * f for weight, f in zip(weights, mode.frequencies)) / total
            for mode in self.modes
        ]


class PlatformState(NamedTuple):
    """Where a platform that swings is, and what an accelerometer on it feels of its motion.

    Attributes:
        position: Shape (3,) [m].
        velocity: Shape (3,) [m/s].
        acceleration: without gravity. Shape (3,) [m/s^2].
    """

    position: Vector3
    velocity: Vector3
    acceleration: Vector3


class SimulatedSwing:
    """The swing of a platform that is led along places, one after the other.

    Attributes:
        model: how it swings. Another one counts from the next step on; with as many modes, the
            swing goes on, else it begins anew.
    """

    def __init__(self, position: Vector3, model: SwingModel | None = None) -> None:
        """Begin at rest at a ``position`` [m]."""
        self.model = model or SwingModel()
        self._position = position
        self._velocity: Vector3 = (0.0, 0.0, 0.0)
        # Of each mode: how far it is from where it is led, and how fast.
        self._swings: list[tuple[float, float]] = []

    def step(self, position: Vector3, dt: float) -> PlatformState:
        """Lead the platform in a straight line to a ``position`` [m], within ``dt`` [s].

        Returns:
            Where it is then. An axis without modes has the mean acceleration of the step.
        """
        (x, y, z), (vx, vy, vz) = position, self._velocity
        x0, y0, z0 = self._position
        velocity = ((x - x0) / dt, (y - y0) / dt, (z - z0) / dt)
        change = (velocity[0] - vx, velocity[1] - vy, velocity[2] - vz)
        stiff = (change[0] / dt, change[1] / dt, change[2] / dt)
        state = PlatformState(position, velocity, stiff)
        if self.model.modes:
            state = self._swung(state, change, dt)
        else:
            self._swings = []
        self._position, self._velocity = position, velocity
        return state

    def _swung(self, led: PlatformState, change: Vector3, dt: float) -> PlatformState:
        """Return where a platform is that is ``led`` as one without modes would move.

        In the step of ``dt`` [s] its velocity is another one by ``change`` [m/s].
        """
        modes = self.model.modes
        same = len(self._swings) == len(modes)
        swings = list(self._swings) if same else [(0.0, 0.0)] * len(modes)
        frequencies = self.model.frequencies(self._position)
        places, speeds, accelerations = (list(numbers) for numbers in led)
        for index, (mode, frequency) in enumerate(zip(modes, frequencies)):
            axis, share = mode.axis, mode.share
            swing, rate = swings[index]
            swing, rate = _free(swing, rate - change[axis], frequency, mode.damping, dt)
            swings[index] = swing, rate
            omega = math.tau * frequency
            felt = -omega * (2.0 * mode.damping * rate + omega * swing)
            places[axis] += share * swing
            speeds[axis] += share * rate
            accelerations[axis] += share * (felt - led.acceleration[axis])
        self._swings = swings
        return PlatformState(three(places), three(speeds), three(accelerations))


def _free(
    swing: float, rate: float, frequency: float, damping: float, dt: float
) -> tuple[float, float]:
    """Return a swing [m] and its rate [m/s] after ``dt`` [s] in which nothing disturbs it."""
    omega = math.tau * frequency
    damped = omega * math.sqrt(1.0 - damping * damping)
    decay = damping * omega
    left = math.exp(-decay * dt)
    cosine, sine = math.cos(damped * dt), math.sin(damped * dt) / damped
    return (
        left * (swing * (cosine + decay * sine) + rate * sine),
        left * (rate * (cosine - decay * sine) - swing * omega * omega * sine),
    )
