"""Outputs of a node: setpoints, states, markers and diagnostics."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.ros.outputs.command_outputs import CommandOutputs as CommandOutputs
    from tri_glide_kinematics.ros.outputs.command_outputs import plan_points as plan_points
    from tri_glide_kinematics.ros.outputs.machine_state import LATCHED as LATCHED
    from tri_glide_kinematics.ros.outputs.machine_state import STATES as STATES
    from tri_glide_kinematics.ros.outputs.machine_state import (
        DiagnosticsPublisher as DiagnosticsPublisher,
    )
    from tri_glide_kinematics.ros.outputs.machine_state import StateReports as StateReports
    from tri_glide_kinematics.ros.outputs.machine_state import cause_of as cause_of
    from tri_glide_kinematics.ros.outputs.machine_state import state_of as state_of
    from tri_glide_kinematics.ros.outputs.markers import DRIVEN as DRIVEN
    from tri_glide_kinematics.ros.outputs.markers import PROGRAMMED as PROGRAMMED
    from tri_glide_kinematics.ros.outputs.markers import TARGET as TARGET
    from tri_glide_kinematics.ros.outputs.markers import Markers as Markers
    from tri_glide_kinematics.ros.outputs.motion_state import Motion as Motion
    from tri_glide_kinematics.ros.outputs.motion_state import MotionStates as MotionStates
    from tri_glide_kinematics.ros.outputs.motion_state import read_motion as read_motion

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
