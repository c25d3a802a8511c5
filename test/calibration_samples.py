"""Calibrations of one wrong machine, for what is written and drawn of them."""

from functools import cache

from testing.wrong_machines import NOMINAL, WRONG_BY, drawn
from tri_glide_kinematics.calibration.fit import Calibration, MeasurementFile, Touch
from tri_glide_kinematics.calibration.session import solved

SEED = 11


@cache
def measured(has_priors: bool = True, outlier: float = 0.0) -> MeasurementFile:
    """Return thirteen touches and a distance; the third touch is wrong by ``outlier`` [m]."""
    machine, rng = drawn(SEED)
    touches = machine.touches(rng)
    heights = tuple(height + outlier for height in touches[2].heights)
    touches[2] = Touch(heights, touches[2].plate, touches[2].standard_deviation)
    priors = WRONG_BY if has_priors else None
    return MeasurementFile(NOMINAL, priors, tuple(touches), (), tuple(machine.one_distance(rng)))


@cache
def calibration(has_priors: bool = True, outlier: float = 0.0) -> Calibration:
    """Return the calibration of these."""
    return solved(measured(has_priors, outlier))
