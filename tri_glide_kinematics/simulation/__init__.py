"""Simulation: a machine that follows setpoints, without ROS and without a clock."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.simulation.sliders import DriveTime as DriveTime
    from tri_glide_kinematics.simulation.sliders import PositionControl as PositionControl
    from tri_glide_kinematics.simulation.sliders import Setpoint as Setpoint
    from tri_glide_kinematics.simulation.sliders import SimulatedDrives as SimulatedDrives
    from tri_glide_kinematics.simulation.sliders import SimulatedOutputs as SimulatedOutputs
    from tri_glide_kinematics.simulation.sliders import SimulatedPlate as SimulatedPlate
    from tri_glide_kinematics.simulation.sliders import SimulatedSliders as SimulatedSliders
    from tri_glide_kinematics.simulation.sliders import SliderFaults as SliderFaults
    from tri_glide_kinematics.simulation.sliders import TrueMachine as TrueMachine
    from tri_glide_kinematics.simulation.swing import PlatformMode as PlatformMode
    from tri_glide_kinematics.simulation.swing import PlatformState as PlatformState
    from tri_glide_kinematics.simulation.swing import SimulatedSwing as SimulatedSwing
    from tri_glide_kinematics.simulation.swing import SwingModel as SwingModel

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
