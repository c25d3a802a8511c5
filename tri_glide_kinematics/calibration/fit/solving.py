"""Gauss-Newton steps until the parameters rest, and what that says about their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tri_glide_kinematics.calibration.fit.errors import NoConvergenceError
from tri_glide_kinematics.calibration.fit.measurements import MeasuredPosition, Touch
from tri_glide_kinematics.calibration.fit.model import MeasurementModel, positions_of
from tri_glide_kinematics.calibration.fit.priors import Knowledge, Spectrum
from tri_glide_kinematics.calibration.fit.unknowns import (
    MACHINE,
    FramePlacement,
    State,
    plate_numbers,
)
from tri_glide_kinematics.vectors import FloatArray


def starting_state(model: MeasurementModel, machine: FloatArray) -> State:
    """Return the state with this machine and the plates and frames that fit it best.

    Args:
        model: of the measurements.
        machine: the twelve parameters [m]. It has to reach all that was measured.
    """
    touches: dict[str, list[Touch]] = {}
    positions: dict[str, list[MeasuredPosition]] = {}
    for one in model.measurements:
        if isinstance(one, Touch):
            touches.setdefault(one.plate.name, []).append(one)
        elif isinstance(one, MeasuredPosition) and one.frame in model.unknowns.frames:
            positions.setdefault(one.frame, []).append(one)
    plates, frames = {}, {}
    for name, some in touches.items():
        places = positions_of(machine, np.array([touch.heights for touch in some]))
        surface = plate_numbers(some[0].plate)
        free = np.array(model.unknowns.plates[name]) >= 0
        factors = np.column_stack((np.ones(len(places)), places[:, :2]))
        surface[free] = np.linalg.lstsq(
            factors[:, free], places[:, 2] - factors @ surface, rcond=None
        )[0]
        plates[name] = surface
    for name, seen in positions.items():
        places = positions_of(machine, np.array([one.heights for one in seen]))
        frames[name] = placement(places, np.array([one.position for one in seen]))
    return State(machine, plates, frames)


def placement(places: FloatArray, seen: FloatArray) -> FramePlacement:
    """Return the turn and shift that bring ``places`` to where they were ``seen`` (Kabsch).

    Args:
        places: in the frame of the machine. Shape (n, 3) [m].
        seen: the same in the other frame. Shape (n, 3) [m].
    """
    center, seen_center = places.mean(axis=0), seen.mean(axis=0)
    left, _, right = np.linalg.svd((seen - seen_center).T @ (places - center))
    # A reflection fits places in one plane as well as a turn does: it is none.
    signs = np.array([1.0, 1.0, np.linalg.det(left) * np.linalg.det(right)])
    rotation = (left * signs) @ right
    return FramePlacement(rotation, seen_center - rotation @ center)


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
    here = _at_start(model, start, knowledge, judging)
    size = np.inf
    for _ in range(STEPS):
        fitted = _step(here)
        size = float(np.linalg.norm(here.design @ fitted))
        if size < REST:
            return here
        for halving in range(HALVINGS):
            following = _moved(here, model, fitted / 2.0**halving)
            # A machine that does not reach gives NaN, which is not below either.
            if following.chi_squared <= here.chi_squared * (1.0 + 1e-12) + REST * REST:
                break
        else:
            break
        here = following
    raise NoConvergenceError(STEPS, size)


def solve_at_once(model: MeasurementModel, start: State, knowledge: Knowledge) -> Solution:
    """Return the solution of the linear equations at the start, which no data can lead astray.

    The state is that of the start: only the residuals and their derivatives mean something.
    """
    here = _at_start(model, start, knowledge, judging=True)
    fitted = _step(here)
    change = here.design @ fitted
    count = len(here.residuals)
    coordinates = here.prior + change[count:]
    return replace(here, residuals=here.residuals + change[:count], prior=coordinates)


def _at_start(
    model: MeasurementModel, start: State, knowledge: Knowledge, judging: bool
) -> Solution:
    """Return what is known before the first step."""
    residuals, matrix = model.equations(start)
    spectrum = knowledge.spectrum(matrix)
    count = spectrum.judged if judging else spectrum.determined
    basis = knowledge.scale @ spectrum.directions[:, :count]
    # The start is the mean of the priors.
    prior = np.zeros(count if knowledge.is_prior else 0)
    return Solution(start, residuals, matrix, spectrum, basis, prior)


def _step(here: Solution) -> FloatArray:
    """Return the change of what is fitted that the linear equations ask for."""
    right = -np.concatenate((here.residuals, here.prior))
    return np.asarray(np.linalg.lstsq(here.design, right, rcond=None)[0])


def _moved(here: Solution, model: MeasurementModel, fitted: FloatArray) -> Solution:
    """Return the solution after a step; residuals of NaN where the machine does not reach."""
    count = here.basis.shape[1]
    step = np.concatenate((here.basis @ fitted[:count], fitted[count:]))
    state = model.unknowns.moved(here.state, step)
    residuals, matrix = model.equations(state)
    if not np.isfinite(matrix).all():
        residuals = np.full_like(residuals, np.nan)
    prior = here.prior + fitted[: len(here.prior)]
    return replace(here, state=state, residuals=residuals, matrix=matrix, prior=prior)


def design_of(matrix: FloatArray, basis: FloatArray, priors: int = 0) -> FloatArray:
    """Return derivatives by what is fitted; the rows of ``priors`` last."""
    machine, others = matrix[:, :MACHINE] @ basis, matrix[:, MACHINE:]
    below = np.zeros((priors, basis.shape[1] + others.shape[1]))
    below[:, : basis.shape[1]] = np.eye(priors, basis.shape[1])
    return np.concatenate((np.concatenate((machine, others), axis=1), below))
