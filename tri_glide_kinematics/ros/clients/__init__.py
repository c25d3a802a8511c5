"""Clients that speak to a running machine as other nodes do."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.ros.clients.goal_sender import GoalSender as GoalSender
    from tri_glide_kinematics.ros.clients.goal_sender import SentGoal as SentGoal
    from tri_glide_kinematics.ros.clients.probe_driver import ProbeDriver as ProbeDriver
    from tri_glide_kinematics.ros.clients.probe_driver import Resting as Resting
    from tri_glide_kinematics.ros.clients.step_driver import NoMachineError as NoMachineError
    from tri_glide_kinematics.ros.clients.step_driver import StepDriver as StepDriver

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
