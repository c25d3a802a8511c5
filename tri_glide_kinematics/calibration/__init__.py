"""Calibration: the machine's true geometry from measurements, with its uncertainty."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.calibration.fit.calibrate import calibrate as calibrate
    from tri_glide_kinematics.calibration.fit.errors import CalibrationError as CalibrationError
    from tri_glide_kinematics.calibration.fit.errors import (
        MeasurementFileError as MeasurementFileError,
    )
    from tri_glide_kinematics.calibration.fit.machine import MachineParameters as MachineParameters
    from tri_glide_kinematics.calibration.fit.measurement_file import (
        MeasurementFile as MeasurementFile,
    )
    from tri_glide_kinematics.calibration.fit.measurement_file import (
        load_measurements as load_measurements,
    )
    from tri_glide_kinematics.calibration.fit.measurement_file import (
        save_measurements as save_measurements,
    )
    from tri_glide_kinematics.calibration.fit.measurements import Distance as Distance
    from tri_glide_kinematics.calibration.fit.measurements import (
        MeasuredPosition as MeasuredPosition,
    )
    from tri_glide_kinematics.calibration.fit.measurements import Plate as Plate
    from tri_glide_kinematics.calibration.fit.measurements import Touch as Touch
    from tri_glide_kinematics.calibration.fit.next_points import Proposal as Proposal
    from tri_glide_kinematics.calibration.fit.priors import Priors as Priors
    from tri_glide_kinematics.calibration.fit.result import Calibration as Calibration
    from tri_glide_kinematics.calibration.fit.result import Residual as Residual

__all__, __getattr__, __dir__ = when_first_used(
    __name__,
    {
        "fit.calibrate": "calibrate",
        "fit.errors": "CalibrationError MeasurementFileError",
        "fit.machine": "MachineParameters",
        "fit.measurement_file": "MeasurementFile load_measurements save_measurements",
        "fit.measurements": "Distance MeasuredPosition Plate Touch",
        "fit.next_points": "Proposal",
        "fit.priors": "Priors",
        "fit.result": "Calibration Residual",
    },
)
