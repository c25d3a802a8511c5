"""Inputs of a node: targets, goals, measurements and calls."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.ros.inputs.machine_requests import NODE_ENDS as NODE_ENDS
    from tri_glide_kinematics.ros.inputs.machine_requests import MachineServices as MachineServices
    from tri_glide_kinematics.ros.inputs.machine_requests import MotionActions as MotionActions
    from tri_glide_kinematics.ros.inputs.path_messages import path_points as path_points
    from tri_glide_kinematics.ros.inputs.slider_measurements import (
        SliderMeasurements as SliderMeasurements,
    )
    from tri_glide_kinematics.ros.inputs.slider_measurements import StampedReading as StampedReading
    from tri_glide_kinematics.ros.inputs.transfer_messages import renewal_of as renewal_of

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
