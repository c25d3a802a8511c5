"""What goes into a landing gear and what comes out: its motion, and its state at an instant."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite_array
from tri_glide_kinematics.vectors import FloatArray


@dataclass(frozen=True, eq=False)
class Value:
    """What is equal to another of its class with the same numbers, be they in arrays or not."""

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
    """Where the gear is and how it moves: each attribute a number, or an array of shape (n,).

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
    """What a joint does to the body that hangs on it, in x y z. Each array: (3,) or (n, 3).

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
