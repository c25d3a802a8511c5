"""Calibration: the machine's true geometry from measurements, with its uncertainty."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.calibration.errors import CalibrationError as CalibrationError
    from tri_glide_kinematics.calibration.errors import MeasurementFileError as MeasurementFileError
    from tri_glide_kinematics.calibration.fit import calibrate as calibrate
    from tri_glide_kinematics.calibration.machine import MachineParameters as MachineParameters
    from tri_glide_kinematics.calibration.measurement_file import MeasurementFile as MeasurementFile
    from tri_glide_kinematics.calibration.measurement_file import (
        load_measurements as load_measurements,
    )
    from tri_glide_kinematics.calibration.measurement_file import (
        save_measurements as save_measurements,
    )
    from tri_glide_kinematics.calibration.measurements import Distance as Distance
    from tri_glide_kinematics.calibration.measurements import MeasuredPosition as MeasuredPosition
    from tri_glide_kinematics.calibration.measurements import Plate as Plate
    from tri_glide_kinematics.calibration.measurements import Touch as Touch
    from tri_glide_kinematics.calibration.next_points import Proposal as Proposal
    from tri_glide_kinematics.calibration.priors import Priors as Priors
    from tri_glide_kinematics.calibration.result import Calibration as Calibration
    from tri_glide_kinematics.calibration.result import Residual as Residual

__all__, __getattr__, __dir__ = when_first_used(
    __name__,
    {
        "errors": "CalibrationError MeasurementFileError",
        "fit": "calibrate",
        "machine": "MachineParameters",
        "measurement_file": "MeasurementFile load_measurements save_measurements",
        "measurements": "Distance MeasuredPosition Plate Touch",
        "next_points": "Proposal",
        "priors": "Priors",
        "result": "Calibration Residual",
    },
)
