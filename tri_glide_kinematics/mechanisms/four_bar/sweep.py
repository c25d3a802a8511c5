"""The motion of a four-bar linkage over an array of crank angles, on both branches.

What the loop yields is stored; what follows from it (angles, the crank pin, points of the coupler
plane) is worked out when it is asked for. Plane vectors are complex numbers inside.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.checks import finite, member
from tri_glide_kinematics.equal_numbers import directions, wrapped
from tri_glide_kinematics.mechanisms.four_bar.analysis import Branch, LinkLengths
from tri_glide_kinematics.vectors import FloatArray, Point

ComplexArray = NDArray[np.complex128]

SINGULAR_SINE = 1e-7
"""Coupler and rocker count as in line if the sine of the angle between them is not above this."""


@dataclass(frozen=True)
class GroundFrame:
    """The position of the ground link in the plane.

    Attributes:
        crank_pivot: x and y of the crank pivot, in [m].
        angle: from the x axis to the line from crank pivot to rocker pivot, in [rad].
    """

    crank_pivot: tuple[float, float] = (0.0, 0.0)
    angle: float = 0.0

    @cached_property
    def rotation(self) -> complex:
        """Unit vector along the ground."""
        return cmath.rect(1.0, self.angle)

    def place(self, points: ComplexArray) -> FloatArray:
        """Return points given in the ground frame as x and y in the plane. Shape (n, 2)."""
        return _as_pairs(complex(*self.crank_pivot) + self.rotation * points)

    def turn(self, vectors: ComplexArray) -> FloatArray:
        """Return vectors given in the ground frame as x and y in the plane. Shape (n, 2)."""
        return _as_pairs(self.rotation * vectors)


@dataclass(frozen=True, eq=False)
class PointMotion:
    """Motion of a point of the coupler plane over n crank angles.

    Attributes:
        position: in [m]. Shape (n, 2).
        velocity: in [m/s]. Shape (n, 2).
        acceleration: in [m/s^2]. Shape (n, 2).
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class Sweep:
    """The motion over n crank angles. Rows beyond the crank's limits are NaN.

    Attributes:
        lengths: of the linkage.
        frame: where it lies.
        crank_angles: in [rad], from the x axis of the plane. Shape (n,).
        crank_velocities: in [rad/s]. Shape () or (n,).
        crank_accelerations: in [rad/s^2]. Shape () or (n,).
        motion: x and y of the rocker pin in the ground frame in [m]; coupler and rocker velocity in
            [rad/s]; coupler and rocker acceleration in [rad/s^2]. Shape (6, n) of one branch,
            (2, 6, n) of the open and the crossed one.
    """

    lengths: LinkLengths
    frame: GroundFrame
    crank_angles: FloatArray
    crank_velocities: FloatArray
    crank_accelerations: FloatArray
    motion: FloatArray


@dataclass(frozen=True, eq=False)
class BranchSweep(Sweep):
    """One ``branch`` over n crank angles."""

    branch: Branch

    @property
    def coupler_velocities(self) -> FloatArray:
        """In [rad/s]; NaN at a limit, where it is infinite. Shape (n,)."""
        return self._row(2)

    @property
    def rocker_velocities(self) -> FloatArray:
        """In [rad/s]; NaN at a limit, where it is infinite. Shape (n,)."""
        return self._row(3)

    @property
    def coupler_accelerations(self) -> FloatArray:
        """In [rad/s^2]; NaN at a limit. Shape (n,)."""
        return self._row(4)

    @property
    def rocker_accelerations(self) -> FloatArray:
        """In [rad/s^2]; NaN at a limit. Shape (n,)."""
        return self._row(5)

    @property
    def is_reachable(self) -> NDArray[np.bool_]:
        """Whether the linkage can be closed at the crank angle. Shape (n,)."""
        reachable: NDArray[np.bool_] = ~np.isnan(self.motion[0])
        return reachable

    @property
    def is_singular(self) -> NDArray[np.bool_]:
        """Whether coupler and rocker are in line: on a limit or a change point. Shape (n,).

        There the crank does not determine the motion. At a change point the rates are those of the
        branch that passes it smoothly; on a limit they are NaN.
        """
        with np.errstate(invalid="ignore"):
            singular: NDArray[np.bool_] = np.sin(self.transmission_angles) <= SINGULAR_SINE
        return singular

    @property
    def crank_pins(self) -> FloatArray:
        """Positions of the crank pin, in [m]; NaN beyond the limits. Shape (n, 2)."""
        return self.frame.place(np.where(self.is_reachable, self._crank, np.nan))

    @property
    def rocker_pins(self) -> FloatArray:
        """Positions of the rocker pin, in [m]. Shape (n, 2)."""
        if self.frame == GroundFrame():
            return self.motion[0:2].T
        return self.frame.place(self._rocker_pin)

    @property
    def coupler_angles(self) -> FloatArray:
        """From the x axis to the line from crank pin to rocker pin, in (-pi, pi]. Shape (n,)."""
        return directions(self.frame.rotation * self._coupler)

    @property
    def rocker_angles(self) -> FloatArray:
        """From the x axis to the line from rocker pivot to rocker pin, in (-pi, pi]. Shape (n,)."""
        return directions(self.frame.rotation * self._rocker)

    @property
    def transmission_angles(self) -> FloatArray:
        """Angle between coupler and rocker at the rocker pin, in [0, pi]. Shape (n,)."""
        angles: FloatArray = np.abs(np.angle(self._rocker * self._coupler.conj()))
        return angles

    def point_of_coupler_plane(self, x: float, y: float) -> PointMotion:
        """Motion of a point that is fixed to the coupler: its positions are a coupler curve.

        Args:
            x: from the crank pin along the line to the rocker pin, in [m].
            y: to the left of it, in [m].

        Raises:
            NotFiniteError: if a coordinate is NaN or infinite.
        """
        offset = complex(finite("x", x), finite("y", y)) / self.lengths.coupler * self._coupler
        position = self._crank + offset
        velocity = 1j * (self.crank_velocities * self._crank + self.coupler_velocities * offset)
        acceleration = (1j * self.crank_accelerations - self.crank_velocities**2) * self._crank + (
            1j * self.coupler_accelerations - self.coupler_velocities**2
        ) * offset
        return PointMotion(
            self.frame.place(position), self.frame.turn(velocity), self.frame.turn(acceleration)
        )

    def _row(self, index: int) -> FloatArray:
        row: FloatArray = self.motion[index]
        return row

    @property
    def _crank(self) -> ComplexArray:
        """Crank pivot to crank pin in the ground frame, in [m]."""
        crank: ComplexArray = self.lengths.crank * np.exp(
            1j * (self.crank_angles - self.frame.angle)
        )
        return crank

    @property
    def _rocker_pin(self) -> ComplexArray:
        """Crank pivot to rocker pin in the ground frame, in [m]."""
        pin: ComplexArray = self.motion[0] + 1j * self.motion[1]
        return pin

    @property
    def _coupler(self) -> ComplexArray:
        """Crank pin to rocker pin in the ground frame, in [m]."""
        return self._rocker_pin - self._crank

    @property
    def _rocker(self) -> ComplexArray:
        """Rocker pivot to rocker pin in the ground frame, in [m]."""
        return self._rocker_pin - self.lengths.ground


class FourBarSweep(Sweep):
    """Both branches over n crank angles.

    A branch is followed by its identity (:class:`Branch`), never by nearness to the row before, so
    a row does not depend on the other rows.
    """

    @property
    def open(self) -> BranchSweep:
        """The open branch."""
        return self.branch(Branch.OPEN)

    @property
    def crossed(self) -> BranchSweep:
        """The crossed branch."""
        return self.branch(Branch.CROSSED)

    def branch(self, branch: Branch) -> BranchSweep:
        """Return one of the two branches.

        Raises:
            NotAChoiceError: if ``branch`` is no ``Branch``, but its name, for example.
        """
        return BranchSweep(
            self.lengths,
            self.frame,
            self.crank_angles,
            self.crank_velocities,
            self.crank_accelerations,
            self.motion[0 if member("branch", branch, Branch) is Branch.OPEN else 1],
            branch,
        )


def _as_pairs(vectors: ComplexArray) -> FloatArray:
    """Return complex numbers as x and y. Shape (n, 2)."""
    return np.ascontiguousarray(vectors).view(np.float64).reshape(-1, 2)


@dataclass(frozen=True)
class FourBarPose:
    """One position of a linkage with its rates.

    Attributes:
        branch: the branch it lies on.
        crank_angle: as asked for, in [rad].
        coupler_angle: from the x axis to the line from crank pin to rocker pin, in (-pi, pi].
        rocker_angle: from the x axis to the line from rocker pivot to rocker pin, in (-pi, pi].
        coupler_velocity: in [rad/s].
        rocker_velocity: in [rad/s].
        coupler_acceleration: in [rad/s^2].
        rocker_acceleration: in [rad/s^2].
        crank_pivot: in [m].
        crank_pin: in [m].
        rocker_pin: in [m].
        rocker_pivot: in [m].
        transmission_angle: between coupler and rocker at the rocker pin, from 0 to pi, in [rad].
        is_singular: whether coupler and rocker are in line. On a limit of the crank the four rates
            are NaN then, at a change point they are those of the smooth motion of the branch.
    """

    branch: Branch
    crank_angle: float
    coupler_angle: float
    rocker_angle: float
    coupler_velocity: float
    rocker_velocity: float
    coupler_acceleration: float
    rocker_acceleration: float
    crank_pivot: Point
    crank_pin: Point
    rocker_pin: Point
    rocker_pivot: Point
    transmission_angle: float
    is_singular: bool
    _sweep: BranchSweep = field(repr=False, compare=False)

    def point_of_coupler_plane(self, x: float, y: float) -> PointMotion:
        """Motion of a point that is fixed to the coupler; its arrays have shape (2,).

        Args:
            x: from the crank pin along the line to the rocker pin, in [m].
            y: to the left of it, in [m].

        Raises:
            NotFiniteError: if a coordinate is NaN or infinite.
        """
        motion = self._sweep.point_of_coupler_plane(x, y)
        return PointMotion(motion.position[0], motion.velocity[0], motion.acceleration[0])

    @classmethod
    def of(cls, sweep: BranchSweep, rocker_pivot: Point) -> FourBarPose:
        """Take the pose from the only row of a sweep; ``rocker_pivot`` is its place in [m]."""
        # As the sweep works them out, but once and without arrays: those cost more than the motion.
        frame, crank_angle = sweep.frame, float(sweep.crank_angles[0])
        x, y, a, b, c, d = sweep.motion[:, 0].tolist()
        rates = (a, b, c, d)
        rocker_pin = complex(x, y)
        crank_pin = cmath.rect(sweep.lengths.crank, crank_angle - frame.angle)
        coupler, rocker = rocker_pin - crank_pin, rocker_pin - sweep.lengths.ground
        transmission_angle = abs(cmath.phase(rocker * coupler.conjugate()))
        pivot = complex(*frame.crank_pivot)
        first, second = (pivot + frame.rotation * pin for pin in (crank_pin, rocker_pin))
        return cls(
            sweep.branch,
            crank_angle,
            wrapped(cmath.phase(frame.rotation * coupler)),
            wrapped(cmath.phase(frame.rotation * rocker)),
            *rates,
            frame.crank_pivot,
            (first.real, first.imag),
            (second.real, second.imag),
            rocker_pivot,
            transmission_angle,
            math.sin(transmission_angle) <= SINGULAR_SINE,
            sweep,
        )
