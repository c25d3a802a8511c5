"""A calibration while it is made: probing, the file of the session, and its report."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.calibration.session.leading import KEPT as KEPT
    from tri_glide_kinematics.calibration.session.leading import Delivery as Delivery
    from tri_glide_kinematics.calibration.session.leading import HeightRecord as HeightRecord
    from tri_glide_kinematics.calibration.session.leading import Leader as Leader
    from tri_glide_kinematics.calibration.session.leading import Leading as Leading
    from tri_glide_kinematics.calibration.session.leading import LeadingError as LeadingError
    from tri_glide_kinematics.calibration.session.leading import MachineView as MachineView
    from tri_glide_kinematics.calibration.session.leading import (
        RecordingError as RecordingError,
    )
    from tri_glide_kinematics.calibration.session.probing import BACK_TOLERANCE as BACK_TOLERANCE
    from tri_glide_kinematics.calibration.session.probing import ProbeSettings as ProbeSettings
    from tri_glide_kinematics.calibration.session.probing import probe as probe
    from tri_glide_kinematics.calibration.session.session import NO_PLACE as NO_PLACE
    from tri_glide_kinematics.calibration.session.session import NOT_SAID as NOT_SAID
    from tri_glide_kinematics.calibration.session.session import SavingError as SavingError
    from tri_glide_kinematics.calibration.session.session import Session as Session
    from tri_glide_kinematics.calibration.session.session import (
        UncertaintyMap as UncertaintyMap,
    )
    from tri_glide_kinematics.calibration.session.session import (
        contradiction as contradiction,
    )
    from tri_glide_kinematics.calibration.session.session import (
        keep_measurements as keep_measurements,
    )
    from tri_glide_kinematics.calibration.session.session import (
        length_text as length_text,
    )
    from tri_glide_kinematics.calibration.session.session import (
        new_session_file as new_session_file,
    )
    from tri_glide_kinematics.calibration.session.session import parameter_text as parameter_text
    from tri_glide_kinematics.calibration.session.session import proposed as proposed
    from tri_glide_kinematics.calibration.session.session import report as report
    from tri_glide_kinematics.calibration.session.session import save_parameters as save_parameters
    from tri_glide_kinematics.calibration.session.session import solved as solved
    from tri_glide_kinematics.calibration.session.session import workspace_of as workspace_of
    from tri_glide_kinematics.calibration.session.swinging import ACCELEROMETER as ACCELEROMETER
    from tri_glide_kinematics.calibration.session.swinging import STOPS as STOPS
    from tri_glide_kinematics.calibration.session.swinging import IkSettings as IkSettings
    from tri_glide_kinematics.calibration.session.swinging import SwingSettings as SwingSettings
    from tri_glide_kinematics.calibration.session.swinging import swing_moves as swing_moves
    from tri_glide_kinematics.calibration.session.swinging import swing_search as swing_search

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
