"""The fit of a machine to its measurements, without those that contradict the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, chdtri

from tri_glide_kinematics.calibration.fit.model import MeasurementModel, positions_of
from tri_glide_kinematics.calibration.fit.numbers import (
    MACHINE,
    CalibrationError,
    FramePlacement,
    Knowledge,
    MeasuredPosition,
    Spectrum,
    State,
    Touch,
    plate_numbers,
)
from tri_glide_kinematics.equal_numbers import first_largest
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text


class NoConvergenceError(CalibrationError):
    """The fit did not come to rest."""

    def __init__(self, steps: int, last: float) -> None:
        """Store the number of ``steps`` and the size of the ``last`` one (standard deviations)."""
        super().__init__(
            f"no geometry fits: after {steps} steps the parameters still move by "
            f"{number_text(last, 3)} of their standard deviations"
        )
        self.steps = steps
        self.last = last


# Gauss-Newton steps until the parameters rest, and what that says about their uncertainty.


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


# Steps of a fit that has not converged by then, and will not.
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
        # Steps that mean nothing are larger, too, where residuals are larger than stated.
        if size < REST * max(1.0, float(np.sqrt(here.chi_squared / len(here.residuals)))):
            return _moved(here, model, fitted)
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

    It makes the sum of the residuals least, not that of their squares: so a few that are wrong
    alike do not hide each other. The state is that of the start: only the residuals and their
    derivatives mean something.
    """
    here = _at_start(model, start, knowledge, judging=True)
    design, count = here.design, len(here.residuals)
    right = -np.concatenate((here.residuals, here.prior))
    left, fitted = np.zeros(count), _step(here)
    for _ in range(ROUNDS):
        weights = np.concatenate((np.maximum(np.abs(left), 1.0) ** -0.5, np.ones(len(here.prior))))
        weighted = weights[:, None] * design
        fitted = np.asarray(np.linalg.lstsq(weighted, weights * right, rcond=None)[0], float)
        left = (design @ fitted - right)[:count]
    change = design @ fitted
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


# How well each measurement agrees with all others, and which do not.

# Of so many sets of good measurements, one has a measurement that is taken for an outlier.
FALSE_ALARM = 0.01
# At most this part of the measurements is left out.
LARGEST_PART = 0.25
# Below this part of its variance, nothing of a measurement is left for a check by the others.
UNCHECKED = 1e-6
# Measurements that disagree nearly as much as the worst might be the wrong ones as well.
AS_LIKELY = 0.9
# Linear equations about the nominal machine are wrong by up to so many standard deviations.
FAR_OFF = 5.0
# Sums of weighted squares, one after the other, come so often to the least sum of residuals.
ROUNDS = 20

Fit = Callable[[MeasurementModel], Solution | None]


@dataclass(frozen=True, eq=False)
class Disagreement:
    """How a measurement differs from what all others predict.

    Attributes:
        squared: square of the difference, by its covariance; chi-squared if all is well.
        degrees: of freedom of that; 0 if the others say nothing about it.
        error: difference, predicted minus measured, by the stated standard deviation. Shape (1,) or
            (3,).
    """

    squared: float
    degrees: int
    error: FloatArray

    @property
    def size(self) -> float:
        """The difference by its standard deviation; NaN if the others say nothing."""
        return float(np.sqrt(self.squared / self.degrees)) if self.degrees else float("nan")

    def part_of(self, bound: FloatArray) -> float:
        """Return the square as a part of the ``bound`` for its degrees of freedom."""
        return self.squared / float(bound[self.degrees]) if self.degrees else 0.0


@dataclass(frozen=True, eq=False)
class RobustFit:
    """A fit without its outliers.

    Attributes:
        solution: of all other measurements.
        outliers: indices.
        doubts: for each outlier, indices of measurements that might be wrong in its place.
    """

    solution: Solution
    outliers: frozenset[int]
    doubts: dict[int, tuple[int, ...]]


def leave_one_out(model: MeasurementModel, solution: Solution) -> list[Disagreement]:
    """Return the disagreement of each measurement of the solution, were it left out of the fit."""
    basis = np.linalg.qr(solution.design)[0]
    result = []
    for rows in model.rows:
        part = basis[rows]
        # With H the part of the hat matrix: residual = (1 - H) error, covariance (1 - H)^-1.
        values, vectors = np.linalg.eigh(np.eye(len(part)) - part @ part.T)
        turned = vectors.T @ solution.residuals[rows]
        free = values > UNCHECKED
        errors = np.where(free, turned / np.where(free, values, 1.0), 0.0)
        result.append(Disagreement(float(turned @ errors), int(free.sum()), vectors @ errors))
    return result


def disagreement(model: MeasurementModel, solution: Solution, index: int) -> Disagreement:
    """Return that of a measurement which the solution has not seen."""
    residuals, matrix = model.equations(solution.state)
    rows = model.rows[index]
    part = design_of(matrix[rows], solution.basis)
    spread = np.linalg.lstsq(solution.design.T, part.T, rcond=None)[0]
    covariance = np.eye(len(part)) + spread.T @ spread
    error = residuals[rows]
    squared = float(error @ np.linalg.solve(covariance, error))
    return Disagreement(squared, len(part), error)


def robust_fit(model: MeasurementModel, fit: Fit, roughly: Fit) -> RobustFit:
    """Fit without the measurements that disagree with the others.

    The worst one is left out until the rest agrees, or a quarter is left out: first those that are
    far off, which a rough fit tells without being led astray. Then each comes back that agrees with
    the rest after all, by the noise that the rest shows: measurements that are all worse than
    stated are no outliers.

    Args:
        model: of all measurements.
        fit: returns the fit of some; None if they are not enough.
        roughly: the same, by linear equations.
    """
    doubts: dict[int, tuple[int, ...]] = {}
    dropped: list[int] = []
    _leave_out(model, roughly, FAR_OFF, dropped, doubts)
    solution = _leave_out(model, fit, 1.0, dropped, doubts)
    bound = _bounds(len(model.measurements))
    while dropped:
        noise = max(1.0, solution.chi_squared / max(solution.degrees_of_freedom, 1))
        parts = [disagreement(model, solution, i).part_of(bound) / noise for i in dropped]
        best = first_largest(np.negative(parts))
        if parts[best] > 1.0:
            break
        doubts.pop(dropped.pop(best))
        returned = fit(model.without(dropped))
        assert returned is not None
        solution = returned
    return RobustFit(solution, frozenset(dropped), doubts)


def _leave_out(
    model: MeasurementModel,
    fit: Fit,
    factor: float,
    dropped: list[int],
    doubts: dict[int, tuple[int, ...]],
) -> Solution:
    """Add the worst measurements to those that are ``dropped``, and return the fit of the rest.

    Args:
        model: of all measurements.
        fit: of some.
        factor: by which the noise may be larger than stated.
        dropped: indices, in the order in which they were left out.
        doubts: as in ``RobustFit``.
    """
    count = len(model.measurements)
    bound = _bounds(count) * factor * factor
    solution = fit(model.without(dropped))
    assert solution is not None
    while len(dropped) < int(LARGEST_PART * count):
        kept = [i for i in range(count) if i not in dropped]
        parts = [one.part_of(bound) for one in leave_one_out(model.without(dropped), solution)]
        if max(parts) <= 1.0 and _agrees(solution, factor):
            break
        worst = first_largest(parts)
        following = fit(model.without([*dropped, kept[worst]]))
        if following is None:
            break
        doubts[kept[worst]] = tuple(
            kept[i]
            for i, part in enumerate(parts)
            if i != worst and part > max(1.0, AS_LIKELY**2 * parts[worst])
        )
        dropped.append(kept[worst])
        solution = following
    return solution


def _bounds(count: int) -> FloatArray:
    """Return the largest squares of good measurements, by their degrees of freedom (1 to 3)."""
    return np.asarray(chdtri([1, 1, 2, 3], FALSE_ALARM / count))


def _agrees(solution: Solution, factor: float) -> bool:
    """Return whether the residuals are as large as stated, or larger by a factor."""
    freedom = solution.degrees_of_freedom
    squares = solution.chi_squared / (factor * factor)
    return freedom <= 0 or bool(chdtrc(freedom, squares) > FALSE_ALARM)
