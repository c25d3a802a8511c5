"""F-mechanism: a planar 3-RRR robot whose three cranks are driven synchronously (source 001)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.checks import array_of_shape, finite, finite_vector, positive
from tri_glide_kinematics.errors import DegenerateLinkageError, NotFiniteError
from tri_glide_kinematics.mechanisms.f_mechanism_batch import solve_batch
from tri_glide_kinematics.mechanisms.f_mechanism_closure import Linkage
from tri_glide_kinematics.mechanisms.f_mechanism_pose import FMechanismPose, FMechanismPoses
from tri_glide_kinematics.mechanisms.f_mechanism_positions import poses_at

# Platform joints closer than this, relative to the size, are one point.
_COINCIDENT = 1e-12


class FMechanism:
    """Planar 3-RRR mechanism with cranks A, B, C that turn at one speed.

    Crank A stands at the crank angle t, crank B at phase_b + t (or phase_b - t when
    counter-rotating), crank C at phase_c + t. Collinear base and platform points are allowed.
    """

    def __init__(
        self,
        base: ArrayLike,
        crank_lengths: Sequence[float],
        rod_lengths: Sequence[float],
        platform: ArrayLike,
        phase_b: float = 0.0,
        phase_c: float = 0.0,
        counter_rotating: bool = False,
    ) -> None:
        """Check and store the dimensions.

        Args:
            base: crank pivots A0, B0, C0, shape (3, 2) [m].
            crank_lengths: a_1, b_1, c_1, shape (3,) [m].
            rod_lengths: a_2, b_2, c_2, shape (3,) [m].
            platform: joints A2, B2, C2 in the platform frame, shape (3, 2) [m].
            phase_b: angle of crank B when crank A stands at zero, delta_b [rad].
            phase_c: angle of crank C when crank A stands at zero, delta_c [rad].
            counter_rotating: whether crank B turns against the others.

        Raises:
            WrongShapeError: if an array has another shape.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a length is not greater than zero.
            DegenerateLinkageError: if the three platform joints coincide, which leaves the platform
                angle undetermined.
        """
        pivots = _points("base", base)
        joints = _points("platform", platform)
        cranks = _lengths("crank_lengths", crank_lengths)
        rods = _lengths("rod_lengths", rod_lengths)
        centroid = sum(joints) / 3.0
        radius = math.sqrt(sum(abs(joint - centroid) ** 2 for joint in joints) / 3.0)
        sides = [abs(p - q) for points in (pivots, joints) for p in points for q in points]
        size = max(*cranks, *rods, *sides)
        if radius <= _COINCIDENT * size:
            raise DegenerateLinkageError(
                "platform: A2, B2 and C2 coincide, which leaves the platform angle undetermined"
            )
        self._linkage = Linkage(
            pivots=pivots,
            cranks=cranks,
            rods=rods,
            joints=joints,
            speeds=(1.0, -1.0 if counter_rotating else 1.0, 1.0),
            phases=(0.0, finite("phase_b", phase_b), finite("phase_c", phase_c)),
            size=size,
            platform_radius=radius,
        )

    @property
    def linkage(self) -> Linkage:
        """The dimensions as complex numbers."""
        return self._linkage

    @property
    def size(self) -> float:
        """The largest length of the mechanism, to which tolerances refer [m]."""
        return self._linkage.size

    @property
    def phase_b(self) -> float:
        """Angle of crank B when crank A stands at zero [rad]."""
        return self._linkage.phases[1]

    @property
    def phase_c(self) -> float:
        """Angle of crank C when crank A stands at zero [rad]."""
        return self._linkage.phases[2]

    @property
    def counter_rotating(self) -> bool:
        """Whether crank B turns against the others."""
        return self._linkage.speeds[1] < 0.0

    def with_phases(self, phase_b: float, phase_c: float) -> FMechanism:
        """The same mechanism with other phase shifts [rad].

        Raises:
            NotFiniteError: if a phase is NaN or infinite.
        """
        other = object.__new__(FMechanism)
        phases = (0.0, finite("phase_b", phase_b), finite("phase_c", phase_c))
        other._linkage = replace(self._linkage, phases=phases)
        return other

    def poses(self, crank_angle: float) -> tuple[FMechanismPose, ...]:
        """All positions of the moving triangle at one crank angle [rad].

        Returns:
            0 to 6 positions, ascending by platform angle. A double root (fold) is one position.

        Raises:
            NotFiniteError: if the angle is NaN or infinite.
            SelfMotionError: if the platform can move while the cranks stand still.
        """
        return poses_at(self._linkage, finite("crank_angle", crank_angle))

    def poses_batch(self, crank_angles: ArrayLike) -> FMechanismPoses:
        """All positions at many crank angles, shape (n,) [rad].

        Rows with a self-motion are marked and hold NaN.

        Raises:
            WrongShapeError: if the angles are not a one-dimensional array.
            NotFiniteError: if one of them is NaN or infinite.
        """
        angles = array_of_shape("crank_angles", crank_angles, (None,))
        bad = np.flatnonzero(~np.isfinite(angles))
        if bad.size:
            raise NotFiniteError(f"crank_angles[{bad[0]}]", float(angles[bad[0]]))
        return solve_batch(self._linkage, angles)


def _points(name: str, values: ArrayLike) -> tuple[complex, complex, complex]:
    array: NDArray[np.float64] = array_of_shape(name, values, (3, 2))
    a, b, c = (
        complex(*finite_vector(f"{name}[{row}]", array[row].tolist(), 2)) for row in range(3)
    )
    return a, b, c


def _lengths(name: str, values: Sequence[float]) -> tuple[float, float, float]:
    a, b, c = (
        positive(f"{name}[{index}]", value, "m")
        for index, value in enumerate(finite_vector(name, values, 3))
    )
    return a, b, c
