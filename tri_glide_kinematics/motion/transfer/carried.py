r"""A motion that is carried: that of a frame which moves is added to a motion in the frame.

In the frame of a belt a part rests. There the platform moves along a path $q(s(t))$ and comes to
rest at the part, and in the frame of the machine it is at $q(s(t)) + c(t)$, where the carriage
$c(t)$ goes over from the rest of one place to the motion of the next. So the descent is upright in
the frame of the belt, and how deep it goes does not depend on what the belt does.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.limits import (
    AT_REST,
    SampledPlan,
    Series,
    SliderLimits,
    SliderState,
    arms_of,
    moved,
    polynomial,
    slider_state,
)
from tri_glide_kinematics.motion.shaped import DrivenPart, LimitBounds, ShapedTrajectory
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.trajectory import MixedSeries, TimeScaling, Trajectory
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3, ascending
from tri_glide_kinematics.workspace import Workspace

# One impulse at once changes nothing.
_UNSHAPED = Shaper((0.0,), (1.0,))


class FrameState(NamedTuple):
    """How a frame is displaced at one instant, and how that changes.

    Attributes:
        displacement: Shape (3,) [m].
        velocity: Shape (3,) [m/s].
        acceleration: Shape (3,) [m/s^2].
    """

    displacement: Vector3
    velocity: Vector3
    acceleration: Vector3


class Carriage:
    """Displacement of a frame over time: quintic between knots, at rest outside of them.

    Attributes:
        times: of the knots, ascending. Shape (k + 1,) [s].
    """

    def __init__(self, times: Sequence[float], states: Sequence[FrameState]) -> None:
        """Prepare the displacement that has these ``states`` at these ``times`` [s]."""
        self.times = np.array(times)
        axes = np.array(states).transpose(1, 2, 0)
        scalings = [TimeScaling(self.times, *axes[:, axis]) for axis in range(3)]
        self._table = np.stack([each.coefficients() for each in scalings], axis=1)
        self._knots: list[float] = self.times.tolist()
        # Of each piece, for each axis: six coefficients.
        self._rows = [tuple(self._table[:, :, i].T.ravel().tolist()) for i in range(len(times) - 1)]

    def at(self, time: float) -> FrameState:
        """Return how the frame is displaced at a ``time`` [s]."""
        inside = min(max(time, self._knots[0]), self._knots[-1])
        index = min(max(bisect_right(self._knots, inside) - 1, 0), len(self._rows) - 1)
        t, row = inside - self._knots[index], self._rows[index]
        values = []
        for axis in (0, 6, 12):
            c0, c1, c2, c3, c4, c5 = row[axis : axis + 6]
            values.append(
                (
                    c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
                    c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
                    2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
                )
            )
        displacement, velocity, acceleration = zip(*values)
        if time > self._knots[-1] or time < self._knots[0]:
            return FrameState(displacement, AT_REST, AT_REST)
        return FrameState(displacement, velocity, acceleration)

    def series(self, times: FloatArray, half: FloatArray) -> Series:
        """Return Taylor series of the displacement [m]; see ``Trajectory.mixed_series``."""
        inside = np.clip(times, self.times[0], self.times[-1])
        index = np.searchsorted(self.times, inside, side="right") - 1
        index = np.minimum(index, len(self.times) - 2)
        coefficients = moved(self._table[..., index], inside - self.times[index])
        coefficients[1:, :, (times < self.times[0]) | (times > self.times[-1])] = 0.0
        return polynomial(coefficients, half)


class CarriedPlan(Trajectory):
    """A plan in a frame that moves, from an instant of it on.

    Attributes:
        base: the motion in the frame.
        carriage: how the frame moves; its times are those of the ``base``.
        begin: time in the base at which this begins [s].
        duration: until the next plan takes over, or all rests [s].
    """

    def __init__(
        self,
        machine: TriGlide,
        base: Trajectory,
        carriage: Carriage,
        end: float,
        begin: float = 0.0,
    ) -> None:
        """Carry a ``base`` from ``begin`` to ``end``, times in it [s]."""
        self.base, self.carriage, self.begin = base, carriage, begin
        self.duration = end - begin
        self._machine = machine
        self._arms = arms_of(machine.geometry)
        self._rests = end >= carriage.times[-1]
        self._shaped: ShapedTrajectory | None = None

    def platform_at(self, machine: TriGlide, time: float) -> tuple[float, ...]:
        """Return how the platform moves at a ``time`` [s]."""
        if time >= self.duration and self._rests:
            time = self.duration
            still = self.carriage.at(self.begin + time).displacement
            carried = FrameState(still, AT_REST, AT_REST)
        else:
            time = max(time, 0.0)
            carried = self.carriage.at(self.begin + time)
        x, y, z, vx, vy, vz, ax, ay, az = self.base.platform_at(machine, self.begin + time)
        (dx, dy, dz), (ux, uy, uz), (bx, by, bz) = carried
        return x + dx, y + dy, z + dz, vx + ux, vy + uy, vz + uz, ax + bx, ay + by, az + bz

    def at(self, time: float) -> SliderState:
        """Return the setpoint at a ``time`` [s]; outside, that of the start or of the end."""
        return slider_state(self._arms, self.platform_at(self._machine, time))

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        states = [self.at(time) for time in np.asarray(times).tolist()]
        return SampledPlan(times, *np.array(states).reshape(-1, 3, 3).transpose(1, 0, 2))

    def knots(self) -> FloatArray:
        """Return the instants between which it is smooth: those of both motions."""
        knots = np.concatenate((self.base.knots(), self.carriage.times)) - self.begin
        inside = knots[(knots > 0.0) & (knots < self.duration)]
        return ascending(np.concatenate(((0.0,), inside, (self.duration,))))

    def mixed_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> MixedSeries:
        """Return Taylor series of the platform's position: the sum of both."""
        there = self.begin + times
        carried = self.carriage.series(there, half)
        series = self.base.platform_series(machine, there, half).plus(carried)
        return series, np.zeros(len(times), dtype=bool)

    def limit_use(
        self, limits: SliderLimits, since: float = 0.0, region: Workspace | None = None
    ) -> Interruptible[LimitBounds]:
        """Return bounds of how much of the limits is used, from the time ``since`` [s] on."""
        if self._shaped is None:
            driven = (DrivenPart(0.0, self, 0.0),)
            self._shaped = ShapedTrajectory(self._machine, _UNSHAPED, driven)
        return (yield from self._shaped.limit_use(limits, since, region))

    def check_sliders(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Compare bounds of the derivatives with the limits.

        Raises:
            SliderLimitError: if a limit may be exceeded.
        """
        at_once(self.checking_sliders(limits, since))

    def checking_sliders(self, limits: SliderLimits, since: float = 0.0) -> Interruptible[None]:
        """Do the same, in pieces."""
        (yield from self.limit_use(limits.with_added(), since)).check(limits.with_added())

    def checking_inside(self, region: Workspace, limits: SliderLimits) -> Interruptible[None]:
        """Check travel, and all of the way."""
        if self._shaped is None:
            at_once(self.limit_use(limits, 0.0, region))
        assert self._shaped is not None
        return self._shaped.checking_inside(region, limits)
