"""The fitted numbers: those of the machine, of plates at unknown places, of turned frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.calibration.fit.measurements import (
    BASE,
    MeasuredPosition,
    Measurement,
    Plate,
    Touch,
)
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


MACHINE = len(PARAMETER_NAMES)


@dataclass(frozen=True, eq=False)
class FramePlacement:
    """The pose of the frame of a camera or tracker: a position p is R p + shift in it.

    Attributes:
        rotation: R. Shape (3, 3).
        shift: Shape (3,) [m].
    """

    rotation: FloatArray
    shift: FloatArray


@dataclass(frozen=True, eq=False)
class State:
    """Values of all that is fitted.

    Attributes:
        machine: as ``MachineParameters.vector``. Shape (12,) [m].
        plates: height [m] and two slopes of each plate, known or not. Each of shape (3,).
        frames: of each name but ``base``.
    """

    machine: FloatArray
    plates: dict[str, FloatArray]
    frames: dict[str, FramePlacement]


@dataclass(frozen=True)
class Unknowns:
    """The order of all unknown numbers: the machine, then plates, then frames.

    Attributes:
        plates: name and the columns of height and slopes, -1 for each that is known.
        frames: name and its first column; three of turning, then three of shift.
        size: number of columns.
    """

    plates: dict[str, tuple[int, int, int]]
    frames: dict[str, int]
    size: int

    @classmethod
    def of(cls, measurements: Sequence[Measurement]) -> Unknowns:
        """Return the unknowns of these measurements."""
        column = MACHINE
        plates: dict[str, tuple[int, int, int]] = {}
        frames: dict[str, int] = {}
        for one in measurements:
            if isinstance(one, Touch) and one.plate.name not in plates:
                columns = []
                for known in (one.plate.height is not None, *[one.plate.tilt is not None] * 2):
                    columns.append(-1 if known else column)
                    column += not known
                plates[one.plate.name] = (columns[0], columns[1], columns[2])
            if isinstance(one, MeasuredPosition) and one.frame not in (BASE, *frames):
                frames[one.frame] = column
                column += 6
        return cls(plates, frames, column)

    def moved(self, state: State, step: FloatArray) -> State:
        """Return the state after a ``step`` of all unknowns. Shape (size,)."""
        plates = {}
        for name, columns in self.plates.items():
            change = [0.0 if column < 0 else float(step[column]) for column in columns]
            plates[name] = state.plates[name] + change
        frames = {}
        for name, column in self.frames.items():
            frame = state.frames[name]
            turn = rotation_by(step[column : column + 3])
            frames[name] = FramePlacement(
                turn @ frame.rotation, frame.shift + step[column + 3 : column + 6]
            )
        return replace(state, machine=state.machine + step[:MACHINE], plates=plates, frames=frames)


def plate_numbers(plate: Plate) -> FloatArray:
    """Return height and slopes of a plate, zeros for what is not known. Shape (3,)."""
    return np.array([plate.height or 0.0, *(plate.tilt or (0.0, 0.0))])


def cross_matrix(vector: FloatArray) -> FloatArray:
    """Return the matrix that multiplies crosswise from the left. Shape (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_by(vector: FloatArray) -> FloatArray:
    """Return the rotation about ``vector`` by its length [rad] (Rodrigues). Shape (3, 3)."""
    angle = float(np.linalg.norm(vector))
    matrix = cross_matrix(vector)
    # sinc and the half-angle form stay exact as the angle goes to zero.
    half = np.sinc(angle / (2.0 * np.pi))
    return np.asarray(
        np.eye(3) + np.sinc(angle / np.pi) * matrix + 0.5 * half * half * matrix @ matrix
    )
