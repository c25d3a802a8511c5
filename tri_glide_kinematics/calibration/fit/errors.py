"""Errors of measurements and of a calibration."""

from __future__ import annotations

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.keys import FileError
from tri_glide_kinematics.wording import number_text


class CalibrationError(KinematicsError):
    """Measurements from which no calibration can be made."""


class MeasurementFileError(FileError, CalibrationError):
    """A file of measurements cannot be read, or something in it has no meaning."""


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
