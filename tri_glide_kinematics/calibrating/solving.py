"""From what a file of measurements holds to a calibration."""

from __future__ import annotations

from tri_glide_kinematics.calibration.fit import calibrate
from tri_glide_kinematics.calibration.measurement_file import MeasurementFile
from tri_glide_kinematics.calibration.result import Calibration


def solved(content: MeasurementFile) -> Calibration:
    """Return the calibration.

    Raises:
        CalibrationError: if there is none, with the reason.
    """
    return calibrate(
        content.nominal.geometry,
        content.touches,
        content.positions,
        content.distances,
        content.priors,
        height_offsets=content.nominal.height_offsets,
    )
