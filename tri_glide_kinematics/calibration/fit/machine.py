"""The twelve parameters of a machine: six anchor coordinates, three arms, three height offsets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite_vector
from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3

# Names of the twelve, in their order.
PARAMETER_NAMES = (
    *(f"anchor {arm} {axis}" for arm in (1, 2, 3) for axis in "xy"),
    *(f"arm length {arm}" for arm in (1, 2, 3)),
    *(f"height offset {arm}" for arm in (1, 2, 3)),
)


@dataclass(frozen=True)
class MachineParameters:
    """All that a calibration finds out about a machine.

    Attributes:
        geometry: anchors and arm lengths.
        height_offsets: what is added to a reported slider height to get the true one. Shape (3,)
            [m].
    """

    geometry: TriGlideGeometry
    height_offsets: Vector3 = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the offsets.

        Raises:
            WrongShapeError: if there are not three.
            NotFiniteError: if one of them is NaN or infinite.
        """
        offsets = finite_vector("height_offsets", self.height_offsets, 3)
        object.__setattr__(self, "height_offsets", offsets)

    @property
    def vector(self) -> FloatArray:
        """The twelve numbers: x1, y1, x2, y2, x3, y3, the arms, the offsets. Shape (12,) [m]."""
        anchors = np.ravel(self.geometry.anchors)
        return np.concatenate((anchors, self.geometry.arm_lengths, self.height_offsets))

    @classmethod
    def from_vector(cls, vector: ArrayLike) -> MachineParameters:
        """Return the parameters of such a vector.

        Raises:
            KinematicsError: if no working machine has them.
        """
        numbers = np.asarray(vector, dtype=np.float64)
        geometry = TriGlideGeometry(numbers[:6].reshape(3, 2), numbers[6:9])
        return cls(geometry, numbers[9:12].tolist())
