"""Motion: targets in, jerk-limited setpoints of the sliders out; no clock and no ROS."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.command_stream import CommandStream as CommandStream
    from tri_glide_kinematics.motion.engine import MotionEngine as MotionEngine
    from tri_glide_kinematics.motion.errors import MotionError as MotionError
    from tri_glide_kinematics.motion.errors import NoPathError as NoPathError
    from tri_glide_kinematics.motion.errors import NoRoomError as NoRoomError
    from tri_glide_kinematics.motion.errors import NotStartedError as NotStartedError
    from tri_glide_kinematics.motion.errors import PlanningError as PlanningError
    from tri_glide_kinematics.motion.errors import SliderLimitError as SliderLimitError
    from tri_glide_kinematics.motion.errors import SliderTravelError as SliderTravelError
    from tri_glide_kinematics.motion.held_motion import MotionPhase as MotionPhase
    from tri_glide_kinematics.motion.limit_use import LimitUse as LimitUse
    from tri_glide_kinematics.motion.limits import SliderLimits as SliderLimits
    from tri_glide_kinematics.motion.paths.errors import PathError as PathError
    from tri_glide_kinematics.motion.paths.errors import PathPlaceError as PathPlaceError
    from tri_glide_kinematics.motion.paths.platform_path import PlatformPath as PlatformPath
    from tri_glide_kinematics.motion.planner import MotionKind as MotionKind
    from tri_glide_kinematics.motion.plans import SampledPlan as SampledPlan
    from tri_glide_kinematics.motion.plans import SliderState as SliderState

__all__, __getattr__, __dir__ = when_first_used(
    __name__,
    {
        "command_stream": "CommandStream",
        "engine": "MotionEngine",
        "errors": (
            "MotionError NoPathError NoRoomError NotStartedError PlanningError SliderLimitError "
            "SliderTravelError"
        ),
        "held_motion": "MotionPhase",
        "limit_use": "LimitUse",
        "limits": "SliderLimits",
        "paths.errors": "PathError PathPlaceError",
        "paths.platform_path": "PlatformPath",
        "planner": "MotionKind",
        "plans": "SampledPlan SliderState",
    },
)
