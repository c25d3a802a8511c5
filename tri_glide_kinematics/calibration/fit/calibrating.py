"""Calibration: measurements are checked, and the machine's true geometry is found from them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.special import chdtr, chdtrc

from tri_glide_kinematics.calibration.fit.model import MeasurementModel, Region, heights_of
from tri_glide_kinematics.calibration.fit.numbers import (
    MACHINE,
    PARAMETER_NAMES,
    PRIOR_KINDS,
    CalibrationError,
    Distance,
    Knowledge,
    MachineParameters,
    MeasuredPosition,
    Measurement,
    Plate,
    Priors,
    State,
    Touch,
    Unknowns,
    names_of,
)
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
from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.wording import number_text

# Checks of measurements before anything is fitted: too few, at one point, another unit.


class TooFewMeasurementsError(CalibrationError):
    """There are not enough numbers for what is unknown."""

    def __init__(self, what: str, count: int, needed: int, why: str) -> None:
        """Store the ``count`` of ``what`` and how many are ``needed``, with the reason in words."""
        super().__init__(f"{count} {what}: at least {needed} are needed {why}")
        self.what = what
        self.count = count
        self.needed = needed


class OnePlaceError(CalibrationError):
    """All measurements were made in about the same place, and so say about the same."""

    def __init__(self, count: int, extent: float, needed: float) -> None:
        """Store the ``count``, their ``extent`` and the one that is ``needed`` [m]."""
        super().__init__(
            f"all {count} measurements lie within {number_text(1000.0 * extent, 3)} mm of each "
            f"other in x and y: spread them over {number_text(1000.0 * needed, 3)} mm at least"
        )
        self.count = count
        self.extent = extent
        self.needed = needed


class WrongUnitError(CalibrationError):
    """A number is so large or so small that it is probably given in another unit."""

    def __init__(self, what: str, value: float, expected: str, question: str) -> None:
        """Store ``what`` it is, its ``value`` [m], what was ``expected``, and the ``question``."""
        super().__init__(f"{what} = {number_text(value, scale=0.0)} m, {expected}: {question}")
        self.what = what
        self.value = value


class NoMachineThereError(CalibrationError):
    """The nominal machine cannot stand where a measurement says that it stood."""

    def __init__(self, what: str, reason: str) -> None:
        """Store which measurement it is, and the ``reason``."""
        super().__init__(
            f"{what} does not fit the nominal machine at all: {reason}; "
            "are geometry, height offsets and unit right?"
        )
        self.what = what


# Numbers that have to be left for the machine after those that plates and frames take.
LEFT = 3
# Positions that fix a frame.
FRAME_POSITIONS = 3
# Measurements within this part of the region's diameter are in one place.
SPREAD = 0.1
# Lengths larger or smaller than the longest arm by this factor are in another unit.
FAR_FROM_AN_ARM = 100.0
# Standard deviations as parts of the longest arm: larger or smaller is another unit.
LARGEST_DEVIATION = 0.05
SMALLEST_DEVIATION = 1e-7
# The nominal machine explains a measurement to within this part of the longest arm.
WORST_FIT = 0.2

# Largest length that is taken from a file; it is the bound of the nodes' parameters, too [m].
LARGEST_LENGTH = 10.0
# A shorter arm is in another unit [m].
SHORTEST_ARM = 0.001

IN_MILLIMETRES = "is it in millimetres (unit: mm)?"
IN_METRES = "is it in metres (unit: m)?"


def check_plates(measurements: Sequence[Measurement]) -> None:
    """Check that all touches of a plate say the same of it.

    Raises:
        CalibrationError: if two do not.
    """
    plates: dict[str, Plate] = {}
    for one in measurements:
        if isinstance(one, Touch) and plates.setdefault(one.plate.name, one.plate) != one.plate:
            raise CalibrationError(
                f"two plates have the name {one.plate.name!r}: {plates[one.plate.name]} and "
                f"{one.plate}"
            )


def check_count(model: MeasurementModel) -> None:
    """Check that there are enough numbers for plates, frames and something about the machine.

    Raises:
        TooFewMeasurementsError: if there are not.
    """
    touches = Counter(one.plate.name for one in model.measurements if isinstance(one, Touch))
    seen = Counter(one.frame for one in model.measurements if isinstance(one, MeasuredPosition))
    others = model.unknowns.size - MACHINE
    taken = f" ({others} are taken by plates and frames)" if others else ""
    wanted = []
    for name, columns in model.unknowns.plates.items():
        unknown, why = sum(column >= 0 for column in columns), "to fit what is not known of it"
        wanted.append((f"touches of plate {name!r}", touches[name], unknown, why))
    for name in model.unknowns.frames:
        what, why = f"positions in frame {name!r}", "to fit how it is turned and shifted"
        wanted.append((what, seen[name], FRAME_POSITIONS, why))
    why = f"to say something of a machine{taken}"
    wanted.append(("measured numbers", model.count, others + LEFT, why))
    for what, count, needed, why in wanted:
        if count < needed:
            raise TooFewMeasurementsError(what, count, needed, why)


def _check_unit(
    what: str, length: float, expected: str, least: float = 0.0, most: float = math.inf
) -> None:
    """Check that a ``length`` has the size of one in metres, from ``least`` to ``most``.

    Raises:
        WrongUnitError: if it has not; its text asks for the unit.
    """
    if abs(length) > most:
        raise WrongUnitError(what, length, expected, IN_MILLIMETRES)
    if abs(length) < least:
        raise WrongUnitError(what, length, expected, IN_METRES)


def check_machine(machine: MachineParameters) -> None:
    """Check that a nominal machine has the size of one.

    Raises:
        WrongUnitError: if it does not; its text asks for the unit.
    """
    expected = f"at most {LARGEST_LENGTH:g} m is expected, of an arm at least {SHORTEST_ARM:g} m"
    for name, value in zip(PARAMETER_NAMES, machine.vector.tolist()):
        least = SHORTEST_ARM if name.startswith("arm length") else 0.0
        _check_unit(f"nominal {name}", value, expected, least, LARGEST_LENGTH)


def check_units(
    measurements: Sequence[Measurement], priors: Priors | None, longest_arm: float
) -> None:
    """Check that all lengths may belong to a machine with such an arm.

    Raises:
        WrongUnitError: if one does not; its text asks for the unit.
    """
    expected = f"the longest arm {number_text(longest_arm)} m"
    far, near = FAR_FROM_AN_ARM * longest_arm, longest_arm / FAR_FROM_AN_ARM
    narrow, wide = SMALLEST_DEVIATION * longest_arm, LARGEST_DEVIATION * longest_arm
    largest_height = 0.0
    for name, one in zip(names_of(measurements), measurements):
        height = max((value for row in heights_of(one) for value in row), key=abs)
        largest_height = max(largest_height, abs(height))
        _check_unit(f"height of {name}", height, expected, most=far)
        if isinstance(one, MeasuredPosition):
            coordinate = max(one.position, key=abs)
            _check_unit(f"coordinate of {name}", coordinate, expected, most=far)
        elif isinstance(one, Distance):
            _check_unit(f"length of {name}", one.distance, expected, near, far)
        else:
            height = one.plate.height or 0.0
            _check_unit(f"height of plate {one.plate.name!r}", height, expected, most=far)
        what = f"standard deviation of {name}"
        _check_unit(what, one.standard_deviation, expected, narrow, wide)
    if measurements:
        _check_unit("largest height", largest_height, expected, near)
    for name in PRIOR_KINDS if priors is not None else ():
        what = f"standard deviation of {name} in the priors"
        _check_unit(what, getattr(priors, name), expected, most=longest_arm)


def check_reach(model: MeasurementModel, state: State) -> None:
    """Check that the nominal machine can stand where it was measured, or nearly so.

    Raises:
        NoMachineThereError: if it cannot.
    """
    places = model.places(state)
    longest = float(state.machine[6:9].max())
    residuals, _ = model.equations(state)
    for index, (name, one) in enumerate(zip(names_of(model.measurements), model.measurements)):
        first = model.first_place(index)
        if np.isnan(places[first : first + len(heights_of(one))]).any():
            raise NoMachineThereError(name, "its arms do not meet at these heights")
        off = float(np.abs(residuals[model.rows[index]]).max()) * one.standard_deviation
        if off > WORST_FIT * longest:
            raise NoMachineThereError(name, f"it is {number_text(off, 3)} m off")


def check_spread(model: MeasurementModel, state: State, region: Region) -> None:
    """Check that the measurements are spread over more than one place.

    Raises:
        OnePlaceError: if they are not.
    """
    places = model.places(state)[:, :2]
    extent = 2.0 * float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())
    needed = SPREAD * 2.0 * region.radius
    if extent < needed:
        raise OnePlaceError(len(model.measurements), extent, needed)


# Calibration: from measurements to the machine's true geometry.

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
    check_units(measurements, priors, max(nominal.arm_lengths))
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
