"""Ring-down: the modes of a machine from a decaying swing, or why they are not known."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.calibration.ringdown.modes import CombinedModes as CombinedModes
    from tri_glide_kinematics.calibration.ringdown.modes import NotKnown as NotKnown
    from tri_glide_kinematics.calibration.ringdown.modes import Oscillation as Oscillation
    from tri_glide_kinematics.calibration.ringdown.modes import RingDown as RingDown
    from tri_glide_kinematics.calibration.ringdown.modes import combine_modes as combine_modes
    from tri_glide_kinematics.calibration.ringdown.modes import find_modes as find_modes
    from tri_glide_kinematics.calibration.ringdown.recording import Quantity as Quantity
    from tri_glide_kinematics.calibration.ringdown.recording import Recording as Recording
    from tri_glide_kinematics.calibration.ringdown.recording import (
        RecordingFileError as RecordingFileError,
    )
    from tri_glide_kinematics.calibration.ringdown.recording import (
        load_recording as load_recording,
    )
    from tri_glide_kinematics.calibration.ringdown.recording import (
        save_recording as save_recording,
    )
    from tri_glide_kinematics.calibration.ringdown.report import ModeFileError as ModeFileError
    from tri_glide_kinematics.calibration.ringdown.report import NoModeError as NoModeError
    from tri_glide_kinematics.calibration.ringdown.report import combined_report as combined_report
    from tri_glide_kinematics.calibration.ringdown.report import mode_text as mode_text
    from tri_glide_kinematics.calibration.ringdown.report import ringdown_report as ringdown_report
    from tri_glide_kinematics.calibration.ringdown.report import save_modes as save_modes

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
