r"""The predicted measurements as functions of the parameters.

The platform is at p where $|C_i - p|^2 = L_i^2$, with the carriages
$C_i = (a_{ix}, a_{iy}, h_i + o_i)$.
With $w_i = C_i - p$ the differential of these three equations is
$w_i \cdot dp = w_{ix} da_{ix} + w_{iy} da_{iy} + w_{iz} do_i - L_i dL_i$,
three linear equations for $dp$ (docs/calibration_theory.md, section 2).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.calibration.fit.numbers import (
    MACHINE,
    Distance,
    MachineParameters,
    MeasuredPosition,
    Measurement,
    State,
    Touch,
    Unknowns,
    cross_matrix,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray

Kind = TypeVar("Kind", Touch, MeasuredPosition, Distance)


def positions_of(machine: FloatArray, heights: FloatArray) -> FloatArray:
    """Return the platform positions of reported ``heights``.

    Args:
        machine: the twelve parameters [m].
        heights: Shape (n, 3) [m].

    Returns:
        Shape (n, 3) [m]; NaN where the arms do not meet, everywhere if no machine is like that.
    """
    try:
        parameters = MachineParameters.from_vector(machine)
    except KinematicsError:
        return np.full_like(heights, np.nan)
    return TriGlide(parameters.geometry).forward_batch(heights + machine[9:])


def position_derivatives(machine: ArrayLike, positions: ArrayLike) -> FloatArray:
    """Return the derivatives of platform positions with respect to the twelve parameters.

    They hold for reported heights that are kept. They do not depend on z.

    Args:
        machine: the twelve parameters [m].
        positions: of the platform. Shape (n, 3) [m].

    Returns:
        Shape (n, 3, 12). NaN in, NaN out.
    """
    numbers, places = np.asarray(machine, dtype=np.float64), np.asarray(positions, dtype=np.float64)
    lengths = numbers[6:9]
    arms = np.empty((len(places), 3, 3))
    arms[:, :, :2] = numbers[:6].reshape(3, 2) - places[:, None, :2]
    squares = np.square(lengths) - np.square(arms[:, :, :2]).sum(axis=2)
    arms[:, :, 2] = np.sqrt(np.where(squares > 0.0, squares, np.nan))
    changes = np.zeros((len(places), 3, MACHINE))
    for arm in range(3):
        changes[:, arm, 2 * arm : 2 * arm + 2] = arms[:, arm, :2]
        changes[:, arm, 6 + arm] = -lengths[arm]
        changes[:, arm, 9 + arm] = arms[:, arm, 2]
    return np.asarray(np.linalg.solve(arms, changes))


class MeasurementModel:
    """The equations of some measurements: predicted minus measured, by standard deviations.

    Attributes:
        measurements: in their order.
        unknowns: the columns of the derivatives.
        rows: the equations of each measurement, as slices.
        reported_heights: of all, both ends of distances. Shape (m, 3) [m].
        count: of all equations.
    """

    def __init__(self, measurements: Sequence[Measurement], unknowns: Unknowns) -> None:
        """Prepare the equations."""
        self.measurements = tuple(measurements)
        self.unknowns = unknowns
        self.rows: list[slice] = []
        self.count = 0
        self._first: list[int] = []
        heights: list[Sequence[float]] = []
        # All equations of a plate, of a frame, and of distances are calculated at once.
        groups: dict[tuple[type, str], list[int]] = {}
        for index, one in enumerate(self.measurements):
            size = 3 if isinstance(one, MeasuredPosition) else 1
            self.rows.append(slice(self.count, self.count + size))
            self.count += size
            self._first.append(len(heights))
            heights += heights_of(one)
            groups.setdefault((type(one), target_of(one)), []).append(index)
        self.reported_heights = np.array(heights).reshape(-1, 3)
        self._groups = groups
        sizes = [rows.stop - rows.start for rows in self.rows]
        deviations = [one.standard_deviation for one in self.measurements]
        self._deviations = np.repeat(deviations, sizes)

    def without(self, dropped: Collection[int]) -> MeasurementModel:
        """Return the model of all measurements but those of these indices."""
        kept = [one for i, one in enumerate(self.measurements) if i not in dropped]
        return MeasurementModel(kept, self.unknowns)

    def places(self, state: State) -> FloatArray:
        """Return where the platform was in all measurements, both ends of distances.

        Shape (m, 3) [m].
        """
        return positions_of(state.machine, self.reported_heights)

    def first_place(self, index: int) -> int:
        """Return the row of ``places`` at which a measurement begins."""
        return self._first[index]

    def equations(self, state: State) -> tuple[FloatArray, FloatArray]:
        """Return residuals and their derivatives with respect to all unknowns.

        Returns:
            Residuals, shape (count,), and derivatives, shape (count, unknowns.size) [1/m]. NaN
            where the machine of this state does not reach.
        """
        places = self.places(state)
        derivatives = position_derivatives(state.machine, places)
        residuals = np.empty(self.count)
        matrix = np.zeros((self.count, self.unknowns.size))
        for (kind, target), indices in self._groups.items():
            first = [self._first[index] for index in indices]
            place, change = places[first], derivatives[first]
            rows = np.array([self.rows[index].start for index in indices])
            if kind is Touch:
                residuals[rows], matrix[rows] = self._touches(state, target, place, change)
            elif kind is Distance:
                last = np.add(first, 1)
                lengths = np.array([one.distance for one in self._all(Distance, indices)])
                step, turn = places[last] - place, derivatives[last] - change
                length = np.linalg.norm(step, axis=1)
                residuals[rows] = length - lengths
                # Ends in one place have no direction; the data checks refuse them.
                along = step / np.maximum(length, 1e-12)[:, None]
                matrix[rows, :MACHINE] = np.einsum("ni,nij->nj", along, turn)
            else:
                rows = (rows[:, None] + np.arange(3)).ravel()
                seen = np.array([one.position for one in self._all(MeasuredPosition, indices)])
                errors, parts = self._positions(state, target, place, change)
                residuals[rows] = (errors - seen).ravel()
                matrix[rows] = parts.reshape(len(rows), -1)
        return residuals / self._deviations, matrix / self._deviations[:, None]

    def _all(self, kind: type[Kind], indices: Sequence[int]) -> list[Kind]:
        some = [self.measurements[index] for index in indices]
        return [one for one in some if isinstance(one, kind)]

    def _touches(
        self, state: State, plate: str, places: FloatArray, changes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return heights above a plate [m], and their derivatives."""
        _, along_x, along_y = surface = state.plates[plate]
        factors = np.column_stack((np.ones(len(places)), places[:, :2]))
        matrix = np.zeros((len(places), self.unknowns.size))
        matrix[:, :MACHINE] = changes[:, 2] - along_x * changes[:, 0] - along_y * changes[:, 1]
        for column, factor in zip(self.unknowns.plates[plate], factors.T):
            if column >= 0:
                matrix[:, column] = -factor
        return places[:, 2] - factors @ surface, matrix

    def _positions(
        self, state: State, frame: str, places: FloatArray, changes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return places in a frame [m], and their derivatives."""
        matrix = np.zeros((len(places), 3, self.unknowns.size))
        if frame not in state.frames:
            matrix[:, :, :MACHINE] = changes
            return places, matrix
        placement, column = state.frames[frame], self.unknowns.frames[frame]
        turned = places @ placement.rotation.T
        matrix[:, :, :MACHINE] = placement.rotation @ changes
        for index, place in enumerate(turned):
            matrix[index, :, column : column + 3] = -cross_matrix(place)
        matrix[:, :, column + 3 : column + 6] = np.eye(3)
        return turned + placement.shift, matrix


def target_of(one: Measurement) -> str:
    """Return the name of the plate or frame of a measurement; empty for a distance."""
    if isinstance(one, Touch):
        return one.plate.name
    return one.frame if isinstance(one, MeasuredPosition) else ""


def heights_of(one: Measurement) -> list[Sequence[float]]:
    """Return the reported heights of a measurement, of both ends if it has two."""
    if isinstance(one, Distance):
        return [one.heights_from, one.heights_to]
    return [one.heights]


# The part of the workspace over which a calibration looks at the platform's position.
#
# How far a position is off does not depend on z, as sliders and arms only move up and down together
# along it. So the region is a disc in x and y.

# Radius of the disc as part of the distance of the anchors from their centre: at 200 mm, 120 mm.
PART = 0.6


@dataclass(frozen=True, eq=False)
class Region:
    """A disc, and places that are evenly spread over it.

    Attributes:
        center: x, y [m].
        radius: [m].
        places: x, y and 0. Shape (n, 3) [m].
    """

    center: tuple[float, float]
    radius: float
    places: FloatArray

    @classmethod
    def disc(cls, center: tuple[float, float], radius: float, rings: int = 5) -> Region:
        """Return a disc with one place at its centre and ``rings`` around it."""
        rows = [(center[0], center[1], 0.0)]
        for ring in range(1, rings + 1):
            # Six more in each ring than in the one before: each place stands for the same area.
            for k in range(6 * ring):
                angle, distance = math.tau * k / (6 * ring), radius * ring / rings
                x, y = distance * math.cos(angle), distance * math.sin(angle)
                rows.append((center[0] + x, center[1] + y, 0.0))
        return cls(center, radius, np.array(rows))

    @classmethod
    def of(cls, geometry: TriGlideGeometry) -> Region:
        """Return the region of a machine: the disc about the centre of its anchors.

        It is made smaller where an arm would not reach that far.
        """
        anchors = np.array(geometry.anchors)
        center = anchors.mean(axis=0)
        distances = np.linalg.norm(anchors - center, axis=1)
        reach = (np.array(geometry.arm_lengths) - distances).min()
        radius = min(PART * float(distances.mean()), 0.9 * float(reach))
        return cls.disc((float(center[0]), float(center[1])), max(radius, 0.0))

    def derivatives(self, machine: FloatArray) -> FloatArray:
        """Return the derivatives of the position at each place. Shape (n, 3, 12)."""
        return position_derivatives(machine, self.places)

    def plane_motion(self, derivatives: FloatArray) -> FloatArray:
        """Return the shift in x and y and the turn about z that fit ``derivatives`` best.

        Args:
            derivatives: of the positions at the places. Shape (n, 3, m).

        Returns:
            Shape (3, m) [m, m, rad].
        """
        basis = plane_basis(self.places, self.center).reshape(-1, 3)
        rows = derivatives.reshape(len(basis), -1)
        return np.asarray(np.linalg.lstsq(basis, rows, rcond=None)[0])


def plane_basis(places: FloatArray, center: tuple[float, float]) -> FloatArray:
    """Return how places move with a shift in x, in y, and a turn about z. Shape (n, 3, 3)."""
    basis = np.zeros((len(places), 3, 3))
    basis[:, 0, 0] = basis[:, 1, 1] = 1.0
    basis[:, 0, 2] = center[1] - places[:, 1]
    basis[:, 1, 2] = places[:, 0] - center[0]
    return basis
