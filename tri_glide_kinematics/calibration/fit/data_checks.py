"""Checks of measurements before anything is fitted: too few, at one point, another unit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from tri_glide_kinematics.calibration.fit.measurements import (
    CalibrationError,
    Distance,
    MeasuredPosition,
    Measurement,
    Plate,
    Touch,
    names_of,
)
from tri_glide_kinematics.calibration.fit.model import MeasurementModel, Region, heights_of
from tri_glide_kinematics.calibration.fit.unknowns import (
    MACHINE,
    PARAMETER_NAMES,
    PRIOR_KINDS,
    MachineParameters,
    Priors,
    State,
)
from tri_glide_kinematics.wording import number_text


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


def check_machine(machine: MachineParameters) -> None:
    """Check that a nominal machine has the size of one.

    Raises:
        WrongUnitError: if it does not; its text asks for the unit.
    """
    for name, value in zip(PARAMETER_NAMES, machine.vector.tolist()):
        if abs(value) > LARGEST_LENGTH:
            expected = f"at most {LARGEST_LENGTH:g} m is expected"
            raise WrongUnitError(f"nominal {name}", value, expected, IN_MILLIMETRES)
        if name.startswith("arm length") and value < SHORTEST_ARM:
            expected = f"at least {SHORTEST_ARM:g} m is expected"
            raise WrongUnitError(f"nominal {name}", value, expected, IN_METRES)


def check_priors(priors: Priors, longest_arm: float) -> None:
    """Check that no standard deviation of what is assumed is as long as an arm.

    Raises:
        WrongUnitError: if one is; its text asks for the unit.
    """
    expected = f"the longest arm {number_text(longest_arm)} m"
    for name in PRIOR_KINDS:
        value = getattr(priors, name)
        if value > longest_arm:
            what = f"standard deviation of {name} in the priors"
            raise WrongUnitError(what, value, expected, IN_MILLIMETRES)


def check_units(measurements: Sequence[Measurement], longest_arm: float) -> None:
    """Check that all lengths may belong to a machine with such an arm.

    Raises:
        WrongUnitError: if one does not; its text asks for the unit.
    """
    expected = f"the longest arm {number_text(longest_arm)} m"
    largest_height = 0.0
    for name, one in zip(names_of(measurements), measurements):
        heights = max((value for row in heights_of(one) for value in row), key=abs)
        largest_height = max(largest_height, abs(heights))
        lengths = {f"height of {name}": heights}
        if isinstance(one, MeasuredPosition):
            lengths[f"coordinate of {name}"] = max(one.position, key=abs)
        if isinstance(one, Touch) and one.plate.height is not None:
            lengths[f"height of plate {one.plate.name!r}"] = one.plate.height
        if isinstance(one, Distance):
            lengths[f"length of {name}"] = one.distance
            if one.distance < longest_arm / FAR_FROM_AN_ARM:
                raise WrongUnitError(f"length of {name}", one.distance, expected, IN_METRES)
        for what, value in lengths.items():
            if abs(value) > FAR_FROM_AN_ARM * longest_arm:
                raise WrongUnitError(what, value, expected, IN_MILLIMETRES)
        deviation = one.standard_deviation
        if deviation > LARGEST_DEVIATION * longest_arm:
            raise WrongUnitError(
                f"standard deviation of {name}", deviation, expected, IN_MILLIMETRES
            )
        if deviation < SMALLEST_DEVIATION * longest_arm:
            raise WrongUnitError(f"standard deviation of {name}", deviation, expected, IN_METRES)
    if measurements and largest_height < longest_arm / FAR_FROM_AN_ARM:
        raise WrongUnitError("largest height", largest_height, expected, IN_METRES)


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
