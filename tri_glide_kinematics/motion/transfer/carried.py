r"""A motion that is carried: that of a frame which moves is added to a motion in the frame.

In the frame of a belt a part rests. There the platform moves along a path $q(s(t))$ and comes to
rest at the part, and in the frame of the machine it is at $q(s(t)) + c(t)$, where the carriage
$c(t)$ goes over from the rest of one place to the motion of the next. So the descent is upright in
the frame of the belt, and how deep it goes does not depend on what the belt does.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.polynomial import Polynomial

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import (
    AT_REST,
    Series,
    SliderLimits,
    SliderState,
    arms_of,
    moved,
    polynomial,
    slider_state,
)
from tri_glide_kinematics.motion.moves import inside
from tri_glide_kinematics.motion.shaped import LimitBounds, SeriesPlan
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import MixedSeries, TimeScaling, Trajectory
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3, ascending, combined, minus
from tri_glide_kinematics.workspace import Workspace

# Number of instants at which it is looked quickly whether a motion is inside.
QUICK_LOOKS = 17

# Instants that are closer are one [s].
SAME_INSTANT = 1e-9


def moves(frame: MovingTarget) -> bool:
    """Return whether a ``frame``, or a place, moves or is about to."""
    return any(frame.velocity) or any(frame.acceleration)


def resting_after(frame: MovingTarget, duration: float) -> MovingTarget:
    """Return where a ``frame`` rests if it comes to rest evenly in a ``duration`` [s]."""
    still = combined(1.0, frame.position, 0.5 * duration, frame.velocity)
    still = combined(1.0, still, duration * duration / 12.0, frame.acceleration)
    return MovingTarget(still, AT_REST, AT_REST)


class Carriage:
    """Displacement of a frame over time: quintic between knots, at rest outside of them.

    A frame is told as a ``MovingTarget``, whose position is by how much it is displaced.

    Attributes:
        times: of the knots, ascending. Shape (k + 1,) [s].
    """

    def __init__(self, times: Sequence[float], states: Sequence[MovingTarget]) -> None:
        """Prepare the displacement that has these ``states`` at these ``times`` [s]."""
        self.times = np.array(times)
        axes = np.array([state[:3] for state in states]).transpose(1, 2, 0)
        scalings = [TimeScaling(self.times, *axes[:, axis]) for axis in range(3)]
        self._table = np.stack([each.coefficients() for each in scalings], axis=1)
        self._knots: list[float] = self.times.tolist()
        # Of each piece, for each axis: six coefficients.
        self._rows = [tuple(self._table[:, :, i].T.ravel().tolist()) for i in range(len(times) - 1)]

    @classmethod
    def onto(
        cls,
        begins: Sequence[tuple[float, MovingTarget]],
        place: MovingTarget,
        goal: Vector3,
        instants: Iterable[float],
    ) -> Carriage:
        """Return one that goes over to a place that moves.

        Args:
            begins: times [s], and how it moves then.
            place: as of time 0; what is carried ends there.
            goal: where that ends in the frame. Shape (3,) [m].
            instants: at which it moves as the place does, ascending [s].
        """
        times, states = (list(each) for each in zip(*begins))
        for time in instants:
            if time > times[-1] + SAME_INSTANT:
                there = place.after(time)
                times.append(time)
                states.append(there._replace(position=minus(there.position, goal)))
        return cls(times, states)

    def at(self, time: float) -> MovingTarget:
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
            return MovingTarget(displacement, AT_REST, AT_REST)
        return MovingTarget(displacement, velocity, acceleration)

    def lowest(self, begin: float, end: float) -> float:
        """Return the least displacement by z between two times [m]."""
        times = [begin, end]
        for knot, row in zip(self._knots, self._rows):
            # Where z turns. A time at which it does not is one more that is looked at.
            turns = knot + Polynomial(row[12:]).deriv().roots().real
            times += [knot, *turns.tolist()]
        return min(self.at(time).position[2] for time in times if begin <= time <= end)

    def series(self, times: FloatArray, half: FloatArray) -> Series:
        """Return Taylor series of the displacement [m]; see ``Trajectory.mixed_series``."""
        inside = np.clip(times, self.times[0], self.times[-1])
        index = np.searchsorted(self.times, inside, side="right") - 1
        index = np.minimum(index, len(self.times) - 2)
        coefficients = moved(self._table[..., index], inside - self.times[index])
        coefficients[1:, :, (times < self.times[0]) | (times > self.times[-1])] = 0.0
        return polynomial(coefficients, half)


class CarriedPlan(SeriesPlan):
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
        super().__init__(machine, end - begin)
        self.base, self.carriage, self.begin = base, carriage, begin
        self._arms = arms_of(machine.geometry)
        self._rests = end >= carriage.times[-1]

    def platform_at(self, machine: TriGlide, time: float) -> tuple[float, ...]:
        """Return how the platform moves at a ``time`` [s]."""
        if time >= self.duration and self._rests:
            time = self.duration
            still = self.carriage.at(self.begin + time).position
            carried = MovingTarget(still, AT_REST, AT_REST)
        else:
            time = max(time, 0.0)
            carried = self.carriage.at(self.begin + time)
        x, y, z, vx, vy, vz, ax, ay, az = self.base.platform_at(machine, self.begin + time)
        (dx, dy, dz), (ux, uy, uz), (bx, by, bz), *_ = carried
        return x + dx, y + dy, z + dz, vx + ux, vy + uy, vz + uz, ax + bx, ay + by, az + bz

    def at(self, time: float) -> SliderState:
        """Return the setpoint at a ``time`` [s]; outside, that of the start or of the end."""
        return slider_state(self._arms, self.platform_at(self._machine, time))

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

    def use_inside(self, region: Workspace, limits: SliderLimits) -> Interruptible[LimitBounds]:
        """Return how much of the ``limits`` is used; where they are kept, it is inside a region.

        Raises:
            KinematicsError: if it is not.
        """
        # Out of reach there is nothing to prove.
        for time in np.linspace(0.0, self.duration, QUICK_LOOKS).tolist():
            region.check_position(self.platform_at(self._machine, time)[:3])
        use = yield from self.limit_use(limits, 0.0, region)
        if use.keeps_limits:
            yield from inside(self, region, limits)
        return use


def first_proved(
    motions: Iterable[CarriedPlan], region: Workspace, limits: SliderLimits
) -> Interruptible[CarriedPlan]:
    """Return the first of some ``motions``, made in turn, that keeps limits and workspace.

    Raises:
        KinematicsError: if none does; it is why the last one does not.
    """
    refusal: KinematicsError | None = None
    for motion in motions:
        try:
            (yield from motion.use_inside(region, limits)).check(limits)
            return motion
        except KinematicsError as error:
            refusal = error
        yield
    assert refusal is not None
    raise refusal
