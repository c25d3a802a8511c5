"""Retracting landing gear of an aircraft in flight (source 003).

Frames, all right-handed, z up when the angles are zero:

- x y z does not move.
- x'y'z' is turned by the pitch angle alpha about x. The aircraft's point A moves along y', and the
  aircraft yaws about z' through A. The yaw angle itself is zero at the instant looked at.
- x'''y'''z''' is fixed to the gear: turned by the retraction angle beta about y'.

The hinge B is at (l1, 0, l2) from A in x'y'z'; the wheel centre C at (-l4, 0, -l3) from B, and the
gear's mass centre D at (3 l4/4, 0, l3/4) from C, both in the gear's frame. The rates by their axes
are yaw (omega_g) about +z', retraction (omega_i = d beta/dt) about +y' and wheel spin (omega_w)
about -x'''. An acceleration has the sign of its rate. ``docs/mechanisms/landing_gear.md`` has the
derivations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite_array, finite_vector, non_negative, positive
from tri_glide_kinematics.equal_numbers import SAME_PART
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.vectors import FloatArray


@dataclass(frozen=True, eq=False)
class Value:
    """A value: equal to another of its class with the same numbers, in arrays or not."""

    def __eq__(self, other: object) -> bool:
        """Return whether all fields have the same shapes and numbers."""
        return self._numbers() == other._numbers() if isinstance(other, Value) else NotImplemented

    def __hash__(self) -> int:
        """Return the hash of all shapes and numbers."""
        return hash(self._numbers())

    def _numbers(self) -> tuple[object, ...]:
        arrays = [np.asarray(getattr(self, field.name), np.float64) for field in fields(self)]
        return type(self), *((array.shape, *array.ravel().tolist()) for array in arrays)


@dataclass(frozen=True, eq=False)
class LandingGearMotion(Value):
    """Position and motion of the gear: each attribute a number, or an array of shape (n,).

    Attributes:
        pitch_angle: alpha, of y' above y, in [rad].
        retraction_angle: beta, in [rad].
        yaw_velocity: omega_g, about z', in [rad/s].
        retraction_velocity: omega_i, about y', in [rad/s].
        spin_velocity: omega_w, about -x''', in [rad/s].
        yaw_acceleration: alpha_g, in [rad/s^2].
        retraction_acceleration: alpha_i, in [rad/s^2].
        spin_acceleration: alpha_w, in [rad/s^2].
        forward_velocity: v_v, of A along y', in [m/s].
        forward_acceleration: a_v, of A along y', in [m/s^2].
    """

    pitch_angle: ArrayLike
    retraction_angle: ArrayLike
    yaw_velocity: ArrayLike = 0.0
    retraction_velocity: ArrayLike = 0.0
    spin_velocity: ArrayLike = 0.0
    yaw_acceleration: ArrayLike = 0.0
    retraction_acceleration: ArrayLike = 0.0
    spin_acceleration: ArrayLike = 0.0
    forward_velocity: ArrayLike = 0.0
    forward_acceleration: ArrayLike = 0.0

    def as_arrays(self) -> tuple[FloatArray, ...]:
        """Return the ten attributes as arrays of one shape with a last axis of length 1.

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            WrongShapeError: if arrays have different lengths, or more than one axis.
        """
        arrays = []
        size: int | None = None
        for field in fields(self):
            array = np.asarray(getattr(self, field.name), dtype=np.float64)
            array = finite_array(field.name, array, (size,) if array.ndim else ())
            size = array.size if array.ndim else size
            arrays.append(array)
        return tuple(array[..., np.newaxis] for array in np.broadcast_arrays(*arrays))


@dataclass(frozen=True, eq=False)
class BodyState:
    """Motion and momentum of one body, in x y z. Each array has shape (3,) or (n, 3).

    Attributes:
        position: of the mass centre, from A, in [m].
        velocity: of the mass centre, in [m/s].
        acceleration: of the mass centre, in [m/s^2].
        coriolis_acceleration: the part 2 omega_g x v_rel of the acceleration that is due to the
            motion in the yawing frame, in [m/s^2].
        angular_velocity: in [rad/s].
        angular_acceleration: in [rad/s^2].
        momentum: in [kg m/s].
        momentum_rate: in [N].
        angular_momentum: about the mass centre, in [kg m^2/s].
        angular_momentum_rate: about the mass centre, in [N m].
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    coriolis_acceleration: FloatArray
    angular_velocity: FloatArray
    angular_acceleration: FloatArray
    momentum: FloatArray
    momentum_rate: FloatArray
    angular_momentum: FloatArray
    angular_momentum_rate: FloatArray


@dataclass(frozen=True, eq=False)
class Reaction:
    """The reaction of a joint on the body that hangs on it, in x y z. Each array: (3,) or (n, 3).

    Attributes:
        position: of the joint, from A, in [m].
        force: in [N].
        moment: about the joint, in [N m].
        axial_moment: part of the moment along the joint's axis, in [N m]: what a drive must give
            and bearings cannot. Shape () or (n,).
    """

    position: FloatArray
    force: FloatArray
    moment: FloatArray
    axial_moment: FloatArray


@dataclass(frozen=True, eq=False)
class LandingGearState:
    """All that is known of the gear at an instant.

    Attributes:
        gear: the gear without its wheel; mass centre D.
        wheel: the wheel; mass centre C. Its angular velocity is the total one.
        hinge: reaction at B on the free body of gear and wheel together; axis +y'.
        axle: reaction at C on the free body of the wheel alone; axis -x''', that of the spin.
    """

    gear: BodyState
    wheel: BodyState
    hinge: Reaction
    axle: Reaction


@dataclass(frozen=True, eq=False)
class LandingGear(Value):
    """A landing gear with its wheel.

    Attributes:
        l1: from A to B along x', in [m].
        l2: from A to B along z', in [m].
        l3: from C to B along z''', in [m].
        l4: from C to B along x''', in [m].
        gear_mass: without the wheel, in [kg].
        wheel_mass: in [kg].
        gear_inertia: tensor about D in x'''y'''z''', in [kg m^2]. Shape (3, 3).
        wheel_axial_inertia: about the wheel's axis x''', in [kg m^2].
        wheel_transverse_inertia: about any diameter of the wheel through C, in [kg m^2].
        gravity: in x y z, in [m/s^2].
    """

    l1: float
    l2: float
    l3: float
    l4: float
    gear_mass: float
    wheel_mass: float
    gear_inertia: Sequence[Sequence[float]] | FloatArray
    wheel_axial_inertia: float
    wheel_transverse_inertia: float
    gravity: Sequence[float] = (0.0, 0.0, -9.80665)

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            WrongShapeError: if the inertia is not 3 by 3 or gravity has not three components.
            OutOfBoundsError: if a length is negative, a mass not positive, or an inertia not one
                that a body can have.
        """
        for name in ("l1", "l2", "l3", "l4"):
            non_negative(name, getattr(self, name), "m")
        for name in ("gear_mass", "wheel_mass"):
            positive(name, getattr(self, name), "kg")
        axial = positive("wheel_axial_inertia", self.wheel_axial_inertia, "kg m^2")
        transverse = positive("wheel_transverse_inertia", self.wheel_transverse_inertia, "kg m^2")
        if axial > 2.0 * transverse * (1.0 + SAME_PART):
            bound = f"at most twice wheel_transverse_inertia, {2.0 * transverse:.9g}"
            raise OutOfBoundsError("wheel_axial_inertia", axial, bound, "kg m^2")
        object.__setattr__(self, "gravity", finite_vector("gravity", self.gravity, 3))
        inertia = finite_array("gear_inertia", self.gear_inertia, (3, 3)).copy()
        _check_inertia("gear_inertia", inertia)
        inertia.flags.writeable = False
        object.__setattr__(self, "gear_inertia", inertia)

    def state(self, motion: LandingGearMotion) -> LandingGearState:
        """Work out motion, momentum and reactions.

        Raises:
            NotFiniteError: if a number of ``motion`` is NaN or infinite.
            WrongShapeError: if arrays of ``motion`` do not have one length.
        """
        pitch, retraction, *rates = motion.as_arrays()
        yaw_rate, retraction_rate, spin_rate = rates[0:3]
        yaw_rate2, retraction_rate2, spin_rate2 = rates[3:6]
        speed, speed_rate = rates[6:8]
        aircraft = _turn_about(0, pitch)
        gear_axes = aircraft @ _turn_about(1, retraction)
        forward, up = aircraft[..., 1], aircraft[..., 2]
        spin_axis = -gear_axes[..., 0]

        yaw, retracting, spin = yaw_rate * up, retraction_rate * forward, spin_rate * spin_axis
        omega_gear = yaw + retracting
        omega_wheel = omega_gear + spin
        alpha_yaw = yaw_rate2 * up
        alpha_gear = alpha_yaw + retraction_rate2 * forward + np.cross(yaw, retracting)
        alpha_wheel = alpha_gear + spin_rate2 * spin_axis + np.cross(omega_gear, spin)

        a_to_b = aircraft @ np.array([self.l1, 0.0, self.l2])
        b_to_c = gear_axes @ np.array([-self.l4, 0.0, -self.l3])
        b_to_d = b_to_c + gear_axes @ np.array([0.75 * self.l4, 0.0, 0.25 * self.l3])
        velocity_b = speed * forward + np.cross(yaw, a_to_b)
        acceleration_b = speed_rate * forward + _rigid_acceleration(yaw, alpha_yaw, a_to_b)

        def body(
            mass: float,
            from_hinge: FloatArray,
            omega: FloatArray,
            alpha: FloatArray,
            inertia: FloatArray,
        ) -> BodyState:
            velocity = velocity_b + np.cross(omega_gear, from_hinge)
            acceleration = acceleration_b + _rigid_acceleration(omega_gear, alpha_gear, from_hinge)
            tensor = gear_axes @ inertia @ np.swapaxes(gear_axes, -1, -2)
            angular_momentum = _apply(tensor, omega)
            return BodyState(
                position=a_to_b + from_hinge,
                velocity=velocity,
                acceleration=acceleration,
                coriolis_acceleration=2.0 * np.cross(yaw, np.cross(retracting, from_hinge)),
                angular_velocity=omega,
                angular_acceleration=alpha,
                momentum=mass * velocity,
                momentum_rate=mass * acceleration,
                angular_momentum=angular_momentum,
                angular_momentum_rate=_apply(tensor, alpha) + np.cross(omega, angular_momentum),
            )

        transverse = self.wheel_transverse_inertia
        wheel_inertia = np.diag([self.wheel_axial_inertia, transverse, transverse])
        gear_inertia = np.asarray(self.gear_inertia)
        gear = body(self.gear_mass, b_to_d, omega_gear, alpha_gear, gear_inertia)
        wheel = body(self.wheel_mass, b_to_c, omega_wheel, alpha_wheel, wheel_inertia)

        # Newton and Euler for each free body: what the joint gives is the rate of momentum less
        # what gravity gives, and moments about the joint take the arms of both into account.
        gravity = np.asarray(self.gravity, dtype=np.float64)
        force_c = wheel.momentum_rate - self.wheel_mass * gravity
        force_d = gear.momentum_rate - self.gear_mass * gravity
        moment_c = wheel.angular_momentum_rate
        moment_b = (
            gear.angular_momentum_rate
            + np.cross(b_to_d, force_d)
            + moment_c
            + np.cross(b_to_c, force_c)
        )
        return LandingGearState(
            gear=gear,
            wheel=wheel,
            hinge=Reaction(a_to_b, force_c + force_d, moment_b, _dot(moment_b, forward)),
            axle=Reaction(wheel.position, force_c, moment_c, _dot(moment_c, spin_axis)),
        )


def _check_inertia(name: str, inertia: FloatArray) -> None:
    """Check that a body can have this inertia tensor about its mass centre."""
    scale = float(np.abs(inertia).max())
    skew = inertia - inertia.T
    row, column = np.unravel_index(int(np.abs(skew).argmax()), skew.shape)
    if abs(skew[row, column]) > SAME_PART * scale:
        bound = f"equal to {name}[{column}][{row}] = {inertia[column, row]:.9g}"
        raise OutOfBoundsError(
            f"{name}[{row}][{column}]", float(inertia[row, column]), bound, "kg m^2"
        )
    smallest, middle, largest = np.linalg.eigvalsh(inertia).tolist()
    # That of a thin rod is zero, whatever rounding makes of it.
    if smallest <= SAME_PART * largest:
        raise OutOfBoundsError(f"smallest principal value of {name}", smallest, "greater than 0")
    if largest > (smallest + middle) * (1.0 + SAME_PART):
        bound = f"at most the sum of the other two, {smallest + middle:.9g}"
        raise OutOfBoundsError(f"largest principal value of {name}", largest, bound)


def _turn_about(axis: int, angle: FloatArray) -> FloatArray:
    """Rotation matrices about a coordinate axis. ``angle`` has shape (..., 1), they (..., 3, 3)."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix: FloatArray = np.zeros((*angle.shape[:-1], 3, 3))
    cos, sin = np.cos(angle[..., 0]), np.sin(angle[..., 0])
    matrix[..., axis, axis] = 1.0
    matrix[..., first, first] = matrix[..., second, second] = cos
    matrix[..., second, first] = sin
    matrix[..., first, second] = -sin
    return matrix


def _rigid_acceleration(omega: FloatArray, alpha: FloatArray, arm: FloatArray) -> FloatArray:
    """Acceleration of the end of an arm of a rigid body against its beginning."""
    return np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))


def _apply(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Product of matrices (..., 3, 3) with vectors (..., 3)."""
    return (matrix @ vector[..., np.newaxis])[..., 0]


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """Inner product along the last axis."""
    return np.asarray((first * second).sum(axis=-1))
