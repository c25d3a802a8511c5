r"""What the measurements should have been, and how that changes with the parameters.

The platform is at p where $|C_i - p|^2 = L_i^2$, with the carriages
$C_i = (a_{ix}, a_{iy}, h_i + o_i)$.
With $w_i = C_i - p$ the differential of these three equations is
$w_i \cdot dp = w_{ix} da_{ix} + w_{iy} da_{iy} + w_{iz} do_i - L_i dL_i$,
three linear equations for $dp$ (docs/calibration_theory.md, section 2).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.calibration.machine import MachineParameters
from tri_glide_kinematics.calibration.measurements import (
    Distance,
    MeasuredPosition,
    Measurement,
    Touch,
)
from tri_glide_kinematics.calibration.unknowns import MACHINE, State, Unknowns, cross_matrix
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide.kinematics import TriGlide
from tri_glide_kinematics.vectors import FloatArray


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
        heights: list[Sequence[float]] = []
        self._first: list[int] = []
        self.count = 0
        for one in self.measurements:
            size = 3 if isinstance(one, MeasuredPosition) else 1
            self.rows.append(slice(self.count, self.count + size))
            self.count += size
            self._first.append(len(heights))
            heights += heights_of(one)
        self.reported_heights = np.array(heights).reshape(-1, 3)

    def without(self, dropped: Collection[int]) -> MeasurementModel:
        """Return the model of all measurements but those of these indices."""
        kept = [one for i, one in enumerate(self.measurements) if i not in dropped]
        return MeasurementModel(kept, self.unknowns)

    def places(self, state: State) -> FloatArray:
        """Return where the platform was in all measurements, both ends of distances.

        Shape (n, 3) [m].
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
        for one, rows, first in zip(self.measurements, self.rows, self._first):
            row = matrix[rows]
            residuals[rows] = self._fill(
                one, state, places[first : first + 2], derivatives[first : first + 2], row
            )
            residuals[rows] /= one.standard_deviation
            row /= one.standard_deviation
        return residuals, matrix

    def _fill(
        self,
        one: Measurement,
        state: State,
        places: FloatArray,
        derivatives: FloatArray,
        row: FloatArray,
    ) -> FloatArray | float:
        """Return predicted minus measured [m], and write its derivatives to ``row``."""
        place, change = places[0], derivatives[0]
        if isinstance(one, Touch):
            surface = state.plates[one.plate.name]
            factors = np.array([1.0, place[0], place[1]])
            row[0, :MACHINE] = change[2] - surface[1] * change[0] - surface[2] * change[1]
            for column, factor in zip(self.unknowns.plates[one.plate.name], factors):
                if column >= 0:
                    row[0, column] = -factor
            return float(place[2] - factors @ surface)
        if isinstance(one, Distance):
            step = places[1] - place
            length = float(np.linalg.norm(step))
            # Ends in one place have no direction; the data checks refuse them.
            row[0, :MACHINE] = step @ (derivatives[1] - change) / max(length, 1e-12)
            return length - one.distance
        if one.frame not in state.frames:
            row[:, :MACHINE] = change
            return place - np.array(one.position)
        frame, column = state.frames[one.frame], self.unknowns.frames[one.frame]
        turned = frame.rotation @ place
        row[:, :MACHINE] = frame.rotation @ change
        row[:, column : column + 3] = -cross_matrix(turned)
        row[:, column + 3 : column + 6] = np.eye(3)
        return np.asarray(turned + frame.shift - np.array(one.position))


def heights_of(one: Measurement) -> list[Sequence[float]]:
    """Return the reported heights of a measurement, of both ends if it has two."""
    if isinstance(one, Distance):
        return [one.heights_from, one.heights_to]
    return [one.heights]
