"""Calibration: measurements in, the machine and what is known of it out."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.calibration.fit.calibrating import (
        NoMachineThereError as NoMachineThereError,
    )
    from tri_glide_kinematics.calibration.fit.calibrating import OnePlaceError as OnePlaceError
    from tri_glide_kinematics.calibration.fit.calibrating import (
        TooFewMeasurementsError as TooFewMeasurementsError,
    )
    from tri_glide_kinematics.calibration.fit.calibrating import WrongUnitError as WrongUnitError
    from tri_glide_kinematics.calibration.fit.calibrating import calibrate as calibrate
    from tri_glide_kinematics.calibration.fit.calibrating import check_machine as check_machine
    from tri_glide_kinematics.calibration.fit.measurement_file import FIRST_LINE as FIRST_LINE
    from tri_glide_kinematics.calibration.fit.measurement_file import (
        MeasurementFile as MeasurementFile,
    )
    from tri_glide_kinematics.calibration.fit.measurement_file import (
        MeasurementFileError as MeasurementFileError,
    )
    from tri_glide_kinematics.calibration.fit.measurement_file import (
        load_measurements as load_measurements,
    )
    from tri_glide_kinematics.calibration.fit.measurement_file import (
        measurement_text as measurement_text,
    )
    from tri_glide_kinematics.calibration.fit.measurement_file import (
        save_measurements as save_measurements,
    )
    from tri_glide_kinematics.calibration.fit.model import MeasurementModel as MeasurementModel
    from tri_glide_kinematics.calibration.fit.model import Region as Region
    from tri_glide_kinematics.calibration.fit.model import plane_basis as plane_basis
    from tri_glide_kinematics.calibration.fit.model import (
        position_derivatives as position_derivatives,
    )
    from tri_glide_kinematics.calibration.fit.model import positions_of as positions_of
    from tri_glide_kinematics.calibration.fit.numbers import BASE as BASE
    from tri_glide_kinematics.calibration.fit.numbers import PARAMETER_NAMES as PARAMETER_NAMES
    from tri_glide_kinematics.calibration.fit.numbers import (
        CalibrationError as CalibrationError,
    )
    from tri_glide_kinematics.calibration.fit.numbers import Distance as Distance
    from tri_glide_kinematics.calibration.fit.numbers import FramePlacement as FramePlacement
    from tri_glide_kinematics.calibration.fit.numbers import Knowledge as Knowledge
    from tri_glide_kinematics.calibration.fit.numbers import MachineParameters as MachineParameters
    from tri_glide_kinematics.calibration.fit.numbers import (
        MeasuredPosition as MeasuredPosition,
    )
    from tri_glide_kinematics.calibration.fit.numbers import Measurement as Measurement
    from tri_glide_kinematics.calibration.fit.numbers import Plate as Plate
    from tri_glide_kinematics.calibration.fit.numbers import Priors as Priors
    from tri_glide_kinematics.calibration.fit.numbers import State as State
    from tri_glide_kinematics.calibration.fit.numbers import Touch as Touch
    from tri_glide_kinematics.calibration.fit.numbers import Unknowns as Unknowns
    from tri_glide_kinematics.calibration.fit.numbers import rotation_by as rotation_by
    from tri_glide_kinematics.calibration.fit.result import Calibration as Calibration
    from tri_glide_kinematics.calibration.fit.result import Proposal as Proposal
    from tri_glide_kinematics.calibration.fit.result import Residual as Residual
    from tri_glide_kinematics.calibration.fit.result import in_words as in_words
    from tri_glide_kinematics.calibration.fit.result import named_directions as named_directions
    from tri_glide_kinematics.calibration.fit.solving import placement as placement
    from tri_glide_kinematics.calibration.fit.solving import starting_state as starting_state

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
