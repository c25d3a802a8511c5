"""Calibration: from measurements to the machine's true geometry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.special import chdtr, chdtrc

from tri_glide_kinematics.calibration.fit.data_checks import (
    TooFewMeasurementsError,
    check_count,
    check_machine,
    check_plates,
    check_priors,
    check_reach,
    check_spread,
    check_units,
)
from tri_glide_kinematics.calibration.fit.measurements import (
    Distance,
    MeasuredPosition,
    Measurement,
    Plate,
    Touch,
    names_of,
)
from tri_glide_kinematics.calibration.fit.model import MeasurementModel, Region
from tri_glide_kinematics.calibration.fit.result import (
    Calibration,
    Residual,
    covariance_of,
    unidentified_of,
)
from tri_glide_kinematics.calibration.fit.solving import (
    FALSE_ALARM,
    RobustFit,
    Solution,
    disagreement,
    leave_one_out,
    robust_fit,
    solve,
    solve_at_once,
    starting_state,
)
from tri_glide_kinematics.calibration.fit.unknowns import (
    Knowledge,
    MachineParameters,
    Priors,
    State,
    Unknowns,
)
from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.wording import number_text

DEFAULT_PRIORS = Priors()
# One of 16,000 good measurements leaves a residual of so many standard deviations.
LARGE_RESIDUAL = 4.0


def calibrate(
    nominal: TriGlideGeometry,
    touches: Iterable[Touch] = (),
    positions: Iterable[MeasuredPosition] = (),
    distances: Iterable[Distance] = (),
    priors: Priors | None = DEFAULT_PRIORS,
    *,
    height_offsets: Sequence[float] = (0.0, 0.0, 0.0),
) -> Calibration:
    """Find the machine that explains the measurements best.

    Fitted are the anchors, the arm lengths and the height offsets (twelve numbers), and height,
    tilt, turn and shift of plates and frames that are not known. The result says what the data do
    not determine; there, the machine stays as it was assumed to be.

    Args:
        nominal: the machine as it is assumed to be.
        touches: of plates.
        positions: that were measured.
        distances: that were measured.
        priors: how far the real machine may be from the nominal one; None if that is not known at
            all, so that only the data count. The default is explained in ``Priors``.
        height_offsets: nominal ones: what is added to reported heights. Shape (3,) [m].

    Raises:
        CalibrationError: if the measurements are too few, all in one place, probably in another
            unit, or not of a machine that is anything like the nominal one.
        WrongShapeError: if there are not three height offsets.
        KinematicsError: if a number is not finite or out of bounds.
    """
    assumed = MachineParameters(nominal, height_offsets)  # type: ignore[arg-type]
    measurements: list[Measurement] = [*touches, *positions, *distances]
    check_machine(assumed)
    check_plates(measurements)
    unknowns = Unknowns.of(measurements)
    model = MeasurementModel(measurements, unknowns)
    check_count(model)
    check_units(measurements, max(nominal.arm_lengths))
    if priors is not None:
        check_priors(priors, max(nominal.arm_lengths))
    start = starting_state(model, assumed.vector)
    check_reach(model, start)
    check_spread(model, start, Region.of(nominal))
    knowledge = Knowledge.of(assumed.vector, priors)

    def fit(some: MeasurementModel, roughly: bool = False) -> Solution | None:
        try:
            check_count(some)
        except TooFewMeasurementsError:
            return None
        begin = starting_state(some, knowledge.mean)
        if roughly:
            return solve_at_once(some, begin, knowledge)
        return solve(some, begin, knowledge, judging=True)

    found = robust_fit(model, fit, partial(fit, roughly=True))
    solution = found.solution
    if priors is None:
        kept = model.without(found.outliers)
        solution = solve(kept, starting_state(kept, knowledge.mean), knowledge)
        solution = solve(kept, solution.state, knowledge)
    residuals = _residuals(model, found, solution)
    return Calibration(
        machine=MachineParameters.from_vector(solution.state.machine),
        nominal=assumed,
        priors=None if priors is None else replace(priors, mean=priors.mean or assumed),
        unidentified=unidentified_of(solution, knowledge),
        covariance=covariance_of(solution, knowledge),
        residuals=residuals,
        plates=_plates(measurements, solution.state),
        frames=solution.state.frames,
        chi_squared=solution.chi_squared,
        degrees_of_freedom=solution.degrees_of_freedom,
        warnings=_warnings(found, solution, residuals),
        _solution=solution,
        _knowledge=knowledge,
        _unknowns=unknowns,
    )


def _residuals(
    model: MeasurementModel, found: RobustFit, solution: Solution
) -> tuple[Residual, ...]:
    """Return what the ``solution`` leaves of all measurements, outliers too."""
    kept = iter(leave_one_out(model.without(found.outliers), found.solution))
    values, _ = model.equations(solution.state)
    result = []
    for index, name in enumerate(names_of(model.measurements)):
        one = model.measurements[index]
        out = index in found.outliers
        left_out = disagreement(model, found.solution, index) if out else next(kept)
        unit = one.standard_deviation
        result.append(
            Residual(
                name,
                one,
                tuple((unit * values[model.rows[index]]).tolist()),
                tuple((unit * left_out.error).tolist()),
                left_out.size,
                out,
            )
        )
    return tuple(result)


def _plates(measurements: Sequence[Measurement], state: State) -> dict[str, Plate]:
    """Return the plates with all numbers, known and fitted."""
    names = {one.plate.name for one in measurements if isinstance(one, Touch)}
    plates = {}
    for name in sorted(names):
        height, along_x, along_y = state.plates[name].tolist()
        plates[name] = Plate(name, height, (along_x, along_y))
    return plates


def _warnings(
    found: RobustFit, solution: Solution, residuals: Sequence[Residual]
) -> tuple[str, ...]:
    """Return in words what a user should look at."""
    warnings = []
    for index in sorted(found.outliers):
        one = residuals[index]
        off = float(np.abs(one.left_out).max())
        text = (
            f"{one.name} contradicts the others by {number_text(1000.0 * off, 3)} mm and was left "
            "out"
        )
        if found.doubts[index]:
            others = ", ".join(residuals[i].name for i in found.doubts[index])
            text += f"; the data cannot tell it well from: {others}"
        if len(solution.prior):
            text += "; or the machine is farther off than the priors say"
        warnings.append(text)
    freedom, squares = solution.degrees_of_freedom, solution.chi_squared
    noise = max(1.0, float(np.sqrt(squares / max(freedom, 1))))
    for one in residuals:
        off = float(np.abs(one.error).max())
        size = off / (noise * one.measurement.standard_deviation)
        if size > LARGE_RESIDUAL and not one.is_outlier:
            warnings.append(
                f"{one.name} is {number_text(1000.0 * off, 3)} mm off on this machine, "
                f"{number_text(size, 3)} standard deviations"
            )
    if freedom > 0:
        value, spread = number_text(squares, 3), number_text(float(np.sqrt(2.0 * freedom)), 2)
        factor = number_text(float(np.sqrt(squares / freedom)), 2)
        expected = f"chi-squared is {value}, expected {freedom} ± {spread}"
        if chdtrc(freedom, squares) < FALSE_ALARM:
            warnings.append(
                f"{expected}: the residuals are {factor} times as large as the stated standard "
                "deviations allow, and so is the true uncertainty"
            )
        elif chdtr(freedom, squares) < FALSE_ALARM:
            warnings.append(
                f"{expected}: the residuals are only {factor} times as large as the stated "
                "standard deviations; the measurements seem to be better than stated"
            )
    unchecked = [one.name for one in residuals if np.isnan(one.size)]
    if unchecked:
        warnings.append(f"no other measurement checks {', '.join(unchecked)}")
    return tuple(warnings)
