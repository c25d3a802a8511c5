"""The numbers of a calibration: what is measured, what is unknown, what is known beforehand."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite, finite_vector, non_negative, positive
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text

# Measurements on a machine: touches of a plate, positions, distances.
#
# All slider heights are the *reported* ones, as the drives (and ``joint_states``) say them. A
# ``height_offset`` is what is **added** to a reported height to get the true one above the base.
#
# The place that is measured is that of the platform centre. A tip that is fixed to the platform
# moves as the centre does; its constant offset shifts all that is measured, which only matters
# where a position or a plate is given in the frame of the machine.


class CalibrationError(KinematicsError):
    """Measurements from which no calibration can be made."""


# The frame of the machine itself: positions in it are neither turned nor shifted.
BASE = "base"


@dataclass(frozen=True)
class Plate:
    """A flat plate: its surface is z = height + tilt[0] x + tilt[1] y in the frame of the machine.

    Unknown numbers are fitted, too.

    Attributes:
        name: plates of one name are one plate.
        height: of the surface at x = y = 0; None if it is not known [m].
        tilt: slopes of the surface along x and y; None if they are not known. Shape (2,).
    """

    name: str = "bed"
    height: float | None = 0.0
    tilt: tuple[float, float] | None = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if one of them is NaN or infinite.
            WrongShapeError: if there are not two slopes.
        """
        if self.height is not None:
            _store(self, "height", finite(f"height of plate {self.name!r}", self.height))
        if self.tilt is not None:
            _store(self, "tilt", finite_vector(f"tilt of plate {self.name!r}", self.tilt, 2))


@dataclass(frozen=True)
class Touch:
    """The platform touches a plate.

    Attributes:
        heights: reported ones of the sliders. Shape (3,) [m].
        plate: that is touched.
        standard_deviation: of the vertical distance between platform and plate [m].
    """

    heights: Vector3
    plate: Plate = field(default_factory=Plate)
    standard_deviation: float = 1e-5

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            WrongShapeError: if there are not three heights.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if the standard deviation is not greater than zero.
        """
        _store_heights(self, "heights", self.heights)
        _store_deviation(self, self.standard_deviation)


@dataclass(frozen=True)
class MeasuredPosition:
    """A camera or a tracker says where the platform is.

    Attributes:
        heights: reported ones of the sliders. Shape (3,) [m].
        position: that was measured. Shape (3,) [m].
        frame: of the position. ``base`` is that of the machine; any other name is a frame that is
            turned and shifted by an unknown amount, which is fitted, too.
        standard_deviation: of each coordinate [m].
    """

    heights: Vector3
    position: Vector3
    frame: str = BASE
    standard_deviation: float = 5e-5

    def __post_init__(self) -> None:
        """Check the numbers, as in ``Touch``."""
        _store_heights(self, "heights", self.heights)
        _store(self, "position", finite_vector("measured position", self.position, 3))
        _store_deviation(self, self.standard_deviation)


@dataclass(frozen=True)
class Distance:
    """The distance between two positions of the platform: ruler, calliper, gauge, printed part.

    Attributes:
        heights_from: reported ones at one end. Shape (3,) [m].
        heights_to: reported ones at the other end. Shape (3,) [m].
        distance: that was measured [m].
        standard_deviation: of it [m].
    """

    heights_from: Vector3
    heights_to: Vector3
    distance: float
    standard_deviation: float = 5e-5

    def __post_init__(self) -> None:
        """Check the numbers, as in ``Touch``; the distance has to be greater than zero, too."""
        _store_heights(self, "heights_from", self.heights_from)
        _store_heights(self, "heights_to", self.heights_to)
        _store(self, "distance", positive("measured distance", self.distance, "m"))
        _store_deviation(self, self.standard_deviation)


Measurement = Touch | MeasuredPosition | Distance


def names_of(measurements: Sequence[Measurement]) -> list[str]:
    """Return a name for each: its kind and its number among those, from 1."""
    kinds = {Touch: "touch", MeasuredPosition: "position", Distance: "distance"}
    counts: Counter[str] = Counter()
    names = []
    for one in measurements:
        kind = kinds[type(one)]
        counts[kind] += 1
        names.append(f"{kind} {counts[kind]}")
    return names


def _store(measurement: object, name: str, value: object) -> None:
    object.__setattr__(measurement, name, value)


def _store_heights(measurement: object, name: str, heights: Sequence[float]) -> None:
    _store(measurement, name, finite_vector(name, heights, 3))


def _store_deviation(measurement: object, value: float) -> None:
    _store(measurement, "standard_deviation", positive("standard_deviation", value, "m"))


# The fitted numbers: those of the machine, of plates at unknown places, of turned frames.

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


# Knowledge of a machine before anything is measured.

PRIOR_KINDS = ("anchors", "arm_lengths", "height_offsets", "common_radius", "common_arm_length")


@dataclass(frozen=True)
class Priors:
    """The nominal values with standard deviations: how far the real machine may be from them.

    The default assumes a machine that was built with care: each coordinate of an anchor is known to
    1 mm, each arm to 0.5 mm and each slider's zero to 2 mm (one standard deviation each, all
    independent and normally distributed). All anchors together may be nearer to their centre or
    farther from it, and all arms together shorter or longer, by 1 mm: a wrong radius or a wrong
    length on the drawing is wrong for all three.

    Attributes:
        anchors: standard deviation of each coordinate of each anchor [m].
        arm_lengths: standard deviation of each length [m].
        height_offsets: standard deviation of each offset [m].
        mean: around which the parameters lie; None for the nominal machine of the calibration.
        common_radius: standard deviation of what is common to the distances of all anchors from
            their centre; 0 if nothing is [m].
        common_arm_length: standard deviation of what is common to all lengths; 0 if nothing is [m].
    """

    anchors: float = 1e-3
    arm_lengths: float = 5e-4
    height_offsets: float = 2e-3
    mean: MachineParameters | None = None
    common_radius: float = 1e-3
    common_arm_length: float = 1e-3

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if a standard deviation is NaN or infinite.
            OutOfBoundsError: if one is not greater than zero, or one of what is common less.
        """
        for name in PRIOR_KINDS:
            check = non_negative if name.startswith("common") else positive
            value = check(f"standard deviation of {name}", getattr(self, name), "m")
            object.__setattr__(self, name, value)

    def deviations(self) -> FloatArray:
        """Return those of all twelve parameters without what is common. Shape (12,) [m]."""
        return np.repeat([self.anchors, self.arm_lengths, self.height_offsets], [6, 3, 3])

    def covariance(self, machine: FloatArray) -> FloatArray:
        """Return the covariance of all twelve about a ``machine``. Shape (12, 12) [m^2]."""
        outwards = machine[:6].reshape(3, 2) - machine[:6].reshape(3, 2).mean(axis=0)
        outwards = outwards / np.linalg.norm(outwards, axis=1, keepdims=True)
        common = np.zeros((MACHINE, 2))
        common[:6, 0] = self.common_radius * outwards.ravel()
        common[6:9, 1] = self.common_arm_length
        return np.asarray(np.diag(np.square(self.deviations())) + common @ common.T)

    def __str__(self) -> str:
        """Return in words what is assumed."""
        anchors, arms, offsets, radius, length = (
            number_text(1000.0 * getattr(self, name), 3) for name in PRIOR_KINDS
        )
        return (
            f"anchors within {anchors} mm in x and in y, arms within {arms} mm, height offsets "
            f"within {offsets} mm of the nominal ones, besides a radius that is wrong for all by "
            f"{radius} mm and a length of all arms by {length} mm (standard deviations)"
        )


# Without priors, a direction is fitted if the data fix it better than this [m]: worse than that,
# the nominal machine of a careful builder is the better guess.
FITTED = 1e-3

# Without priors, how well residuals agree with each other is judged after a fit in all directions
# that the data fix better than this [m]: those between explain residuals, but are not believed.
JUDGED = 2e-3

# With priors all directions are fitted; one counts as determined if the data at least halve its
# standard deviation.
LEARNED = 0.5

# Directions whose standard deviation is larger than this are not in the data at all [m].
ENDLESS = 1.0


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Mean and covariance of the machine before anything is measured.

    Attributes:
        mean: the machine that is assumed. Shape (12,) [m].
        scale: machine = mean + scale u. Shape (12, 12).
        is_prior: whether u has the covariance 1; without priors nothing is known of it.
    """

    mean: FloatArray
    scale: FloatArray
    is_prior: bool

    @classmethod
    def of(cls, nominal: FloatArray, priors: Priors | None) -> Knowledge:
        """Return what ``priors`` say of a ``nominal`` machine; None for nothing."""
        if priors is None:
            return cls(nominal, np.eye(MACHINE), False)
        mean = nominal if priors.mean is None else priors.mean.vector
        return cls(mean, np.asarray(np.linalg.cholesky(priors.covariance(mean)), float), True)

    def spectrum(self, matrix: FloatArray) -> Spectrum:
        """Return what equations with these derivatives say about u.

        Args:
            matrix: derivatives of residuals by all unknowns, by standard deviations. Shape (n, m)
                [1/m].
        """
        machine, others = matrix[:, :MACHINE] @ self.scale, matrix[:, MACHINE:]
        if others.shape[1]:
            # A direction that plates and frames explain as well says nothing about the machine.
            machine = machine - others @ np.linalg.lstsq(others, machine, rcond=None)[0]
        # Rows of zeros, so that there is a direction for each parameter.
        padded = np.concatenate((machine, np.zeros((MACHINE, MACHINE))))
        left, strengths, directions = np.linalg.svd(padded, full_matrices=False)
        return Spectrum(strengths, directions.T, left[: len(matrix)], self.is_prior)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Directions of u and how strongly the data speak about each.

    Attributes:
        strengths: inverse of the standard deviation by the data alone, falling. Shape (12,).
        directions: columns, at right angles to each other. Shape (12, 12).
        changes: of the residuals along each direction, of unit length. Shape (n, 12).
        is_prior: see ``Knowledge``.
    """

    strengths: FloatArray
    directions: FloatArray
    changes: FloatArray
    is_prior: bool

    @property
    def deviations(self) -> FloatArray:
        """Standard deviation of u along each direction; infinite without any knowledge of it."""
        if self.is_prior:
            return np.asarray(1.0 / np.sqrt(1.0 + np.square(self.strengths)))
        with np.errstate(divide="ignore"):
            deviations = 1.0 / self.strengths
        return np.where(deviations < ENDLESS, deviations, np.inf)

    def errors(self, residuals: FloatArray) -> FloatArray:
        """Return how far off the machine that leaves these may be along each direction.

        Without priors, directions that are not fitted stay as they were assumed to be, so that the
        way to where the data see the machine is an error, too. Shape (12,), root mean squares.
        """
        deviations = self.deviations
        if self.is_prior:
            return deviations
        ways = np.where(np.isfinite(deviations), deviations, 0.0) * (residuals @ self.changes)
        return np.hypot(deviations, ways)

    @property
    def determined(self) -> int:
        """Number of directions that the data determine; they are the first."""
        return int((self.deviations < (LEARNED if self.is_prior else FITTED)).sum())

    @property
    def judged(self) -> int:
        """Number of directions that are fitted to judge the residuals; they are the first."""
        return len(self.strengths) if self.is_prior else int((self.deviations < JUDGED).sum())
