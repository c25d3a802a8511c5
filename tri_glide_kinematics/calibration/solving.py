"""Gauss-Newton steps until the parameters rest, and what that says about their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.calibration.errors import NoConvergenceError
from tri_glide_kinematics.calibration.knowledge import Knowledge, Spectrum
from tri_glide_kinematics.calibration.model import MeasurementModel
from tri_glide_kinematics.calibration.unknowns import MACHINE, State
from tri_glide_kinematics.vectors import FloatArray

STEPS = 60
# A step is halved up to so many times if the residuals grow.
HALVINGS = 30
# At rest, a step changes the residuals by less than this (standard deviations). Rounding leaves up
# to 1e-6 where a plate of unknown height is the only thing that was touched.
REST = 1e-5


@dataclass(frozen=True, eq=False)
class Solution:
    """A fit that came to rest.

    Attributes:
        state: all that was fitted.
        residuals: predicted minus measured, by standard deviations. Shape (n,).
        matrix: their derivatives by all unknowns. Shape (n, m) [1/m].
        spectrum: what the data say about the machine, taken where the fit began.
        basis: the directions of the machine in which it was fitted. Shape (12, k).
        prior: distance from the mean of the priors, by standard deviations. Shape (k,) or (0,).
    """

    state: State
    residuals: FloatArray
    matrix: FloatArray
    spectrum: Spectrum
    basis: FloatArray
    prior: FloatArray

    @property
    def design(self) -> FloatArray:
        """Derivatives of all equations, priors last, by what was fitted. Shape (n + p, k + a)."""
        return design_of(self.matrix, self.basis, len(self.prior))

    @property
    def chi_squared(self) -> float:
        """Sum of the squares of all residuals, those of the priors included."""
        return float(self.residuals @ self.residuals + self.prior @ self.prior)

    @property
    def degrees_of_freedom(self) -> int:
        """Number of equations less that of fitted numbers."""
        rows, columns = self.design.shape
        return rows - columns


def solve(
    model: MeasurementModel, start: State, knowledge: Knowledge, *, judging: bool = False
) -> Solution:
    """Return the machine, plates and frames that fit the measurements best.

    Fitted are the directions of the machine that the data determine. The others stay exactly as
    they are at the start, so that nothing wanders along them.

    Args:
        model: of the measurements.
        start: with the mean of what is known of the machine.
        knowledge: of the machine before anything is measured.
        judging: whether to fit so many directions that the residuals tell the noise.

    Raises:
        NoConvergenceError: if the fit does not come to rest.
    """
    residuals, matrix = model.equations(start)
    spectrum = knowledge.spectrum(matrix)
    fitted_count = spectrum.judged if judging else spectrum.determined
    directions = spectrum.directions[:, :fitted_count]
    basis = knowledge.scale @ directions

    def prior(state: State) -> FloatArray:
        if not knowledge.is_prior:
            return np.empty(0)
        change = np.linalg.solve(knowledge.scale, state.machine - knowledge.mean)
        return np.asarray(directions.T @ change)

    state, distance = start, prior(start)
    size = np.inf
    for _ in range(STEPS):
        design = design_of(matrix, basis, len(distance))
        right = -np.concatenate((residuals, distance))
        fitted = np.linalg.lstsq(design, right, rcond=None)[0]
        size = float(np.linalg.norm(design @ fitted))
        if size < REST:
            return Solution(state, residuals, matrix, spectrum, basis, distance)
        step = np.concatenate((basis @ fitted[: basis.shape[1]], fitted[basis.shape[1] :]))
        cost = float(right @ right)
        for halving in range(HALVINGS):
            following = model.unknowns.moved(state, step / 2.0**halving)
            new_residuals, new_matrix = model.equations(following)
            new_distance = prior(following)
            new_cost = float(new_residuals @ new_residuals + new_distance @ new_distance)
            # A machine that does not reach gives NaN, which is not below either.
            if new_cost <= cost * (1.0 + 1e-12) + REST * REST:
                break
        else:
            break
        state, residuals, matrix, distance = following, new_residuals, new_matrix, new_distance
    raise NoConvergenceError(STEPS, size)


def design_of(matrix: FloatArray, basis: FloatArray, priors: int = 0) -> FloatArray:
    """Return derivatives by what is fitted; the rows of ``priors`` last."""
    machine, others = matrix[:, :MACHINE] @ basis, matrix[:, MACHINE:]
    below = np.zeros((priors, basis.shape[1] + others.shape[1]))
    below[:, : basis.shape[1]] = np.eye(priors, basis.shape[1])
    return np.concatenate((np.concatenate((machine, others), axis=1), below))
