"""Calibration: the machine's true geometry from measurements, with its uncertainty."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.calibration.excitation import Excitation as Excitation
    from tri_glide_kinematics.calibration.excitation import NoMovesError as NoMovesError
    from tri_glide_kinematics.calibration.excitation import exciting_moves as exciting_moves
    from tri_glide_kinematics.calibration.fit import Calibration as Calibration
    from tri_glide_kinematics.calibration.fit import CalibrationError as CalibrationError
    from tri_glide_kinematics.calibration.fit import Distance as Distance
    from tri_glide_kinematics.calibration.fit import MachineParameters as MachineParameters
    from tri_glide_kinematics.calibration.fit import MeasuredPosition as MeasuredPosition
    from tri_glide_kinematics.calibration.fit import MeasurementFile as MeasurementFile
    from tri_glide_kinematics.calibration.fit import MeasurementFileError as MeasurementFileError
    from tri_glide_kinematics.calibration.fit import Plate as Plate
    from tri_glide_kinematics.calibration.fit import Priors as Priors
    from tri_glide_kinematics.calibration.fit import Proposal as Proposal
    from tri_glide_kinematics.calibration.fit import Residual as Residual
    from tri_glide_kinematics.calibration.fit import Touch as Touch
    from tri_glide_kinematics.calibration.fit import calibrate as calibrate
    from tri_glide_kinematics.calibration.fit import load_measurements as load_measurements
    from tri_glide_kinematics.calibration.fit import save_measurements as save_measurements

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
