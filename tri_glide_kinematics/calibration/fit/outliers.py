"""How well each measurement agrees with all others, and which do not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, chdtri

from tri_glide_kinematics.calibration.fit.model import MeasurementModel
from tri_glide_kinematics.calibration.fit.solving import Solution, design_of
from tri_glide_kinematics.rounding import first_largest
from tri_glide_kinematics.vectors import FloatArray

# Of so many sets of good measurements, one has a measurement that is taken for an outlier.
FALSE_ALARM = 0.01
# At most this part of the measurements is left out.
LARGEST_PART = 0.25
# Below this part of its variance, nothing of a measurement is left for a check by the others.
UNCHECKED = 1e-6
# Measurements that disagree nearly as much as the worst might be the wrong ones as well.
AS_LIKELY = 0.9
# Linear equations about the nominal machine are wrong by up to so many standard deviations.
FAR_OFF = 10.0

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
    left = 1.0 - np.square(basis).sum(axis=1)
    for rows in model.rows:
        if rows.stop - rows.start == 1:
            residual, free_part = float(solution.residuals[rows.start]), float(left[rows.start])
            checked = free_part > UNCHECKED
            error = residual / free_part if checked else 0.0
            result.append(Disagreement(residual * error, int(checked), np.array([error])))
            continue
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
