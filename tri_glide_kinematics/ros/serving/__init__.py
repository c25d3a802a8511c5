"""Services and actions that lose no call."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.ros.serving.action_server import ActionServer as ActionServer
    from tri_glide_kinematics.ros.serving.action_server import GoalEnd as GoalEnd
    from tri_glide_kinematics.ros.serving.patient_services import CALLS as CALLS
    from tri_glide_kinematics.ros.serving.patient_services import Answers as Answers
    from tri_glide_kinematics.ros.serving.patient_services import PatientServices as PatientServices

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
