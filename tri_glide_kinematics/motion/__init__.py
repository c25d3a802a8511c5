"""Motion: targets in, jerk-limited setpoints of the sliders out; no clock and no ROS."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.engine.engine import MotionEngine as MotionEngine
    from tri_glide_kinematics.motion.engine.held_motion import MotionPhase as MotionPhase
    from tri_glide_kinematics.motion.limit_use import CommandStream as CommandStream
    from tri_glide_kinematics.motion.limit_use import LimitUse as LimitUse
    from tri_glide_kinematics.motion.moves.search import MotionKind as MotionKind
    from tri_glide_kinematics.motion.path.errors import PathError as PathError
    from tri_glide_kinematics.motion.path.errors import PathPlaceError as PathPlaceError
    from tri_glide_kinematics.motion.path.platform_path import PlatformPath as PlatformPath
    from tri_glide_kinematics.motion.trajectory.cubic import SampledPlan as SampledPlan
    from tri_glide_kinematics.motion.trajectory.cubic import SliderState as SliderState
    from tri_glide_kinematics.motion.trajectory.errors import MotionError as MotionError
    from tri_glide_kinematics.motion.trajectory.errors import NoPathError as NoPathError
    from tri_glide_kinematics.motion.trajectory.errors import NoRoomError as NoRoomError
    from tri_glide_kinematics.motion.trajectory.errors import NotStartedError as NotStartedError
    from tri_glide_kinematics.motion.trajectory.errors import PlanningError as PlanningError
    from tri_glide_kinematics.motion.trajectory.errors import SliderLimitError as SliderLimitError
    from tri_glide_kinematics.motion.trajectory.errors import SliderTravelError as SliderTravelError
    from tri_glide_kinematics.motion.trajectory.limits import SliderLimits as SliderLimits

__all__, __getattr__, __dir__ = when_first_used(
    __name__,
    {
        "engine.engine": "MotionEngine",
        "engine.held_motion": "MotionPhase",
        "limit_use": "CommandStream LimitUse",
        "moves.search": "MotionKind",
        "path.errors": "PathError PathPlaceError",
        "path.platform_path": "PlatformPath",
        "trajectory.cubic": "SampledPlan SliderState",
        "trajectory.errors": (
            "MotionError "
            "NoPathError "
            "NoRoomError "
            "NotStartedError "
            "PlanningError "
            "SliderLimitError "
            "SliderTravelError "
        ),
        "trajectory.limits": "SliderLimits",
    },
)
