"""Recordings of the sliders: whether setpoints keep all limits, and what efforts tell; no ROS."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.recordings.efforts import masses_report as masses_report
    from tri_glide_kinematics.recordings.efforts import measured_masses as measured_masses
    from tri_glide_kinematics.recordings.efforts import save_masses as save_masses
    from tri_glide_kinematics.recordings.faults import FaultRecorder as FaultRecorder
    from tri_glide_kinematics.recordings.faults import fault_folder as fault_folder
    from tri_glide_kinematics.recordings.faults import fault_recordings as fault_recordings
    from tri_glide_kinematics.recordings.judgement import Judgement as Judgement
    from tri_glide_kinematics.recordings.judgement import Kind as Kind
    from tri_glide_kinematics.recordings.judgement import Violation as Violation
    from tri_glide_kinematics.recordings.judgement import WrongPeriodError as WrongPeriodError
    from tri_glide_kinematics.recordings.judgement import judge as judge
    from tri_glide_kinematics.recordings.setpoint_files import DEFINITION as DEFINITION
    from tri_glide_kinematics.recordings.setpoint_files import MESSAGE as MESSAGE
    from tri_glide_kinematics.recordings.setpoint_files import Recording as Recording
    from tri_glide_kinematics.recordings.setpoint_files import RecordingError as RecordingError
    from tri_glide_kinematics.recordings.setpoint_files import load_recording as load_recording
    from tri_glide_kinematics.recordings.setpoint_files import save_csv as save_csv
    from tri_glide_kinematics.recordings.setpoint_files import save_mcap as save_mcap

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
