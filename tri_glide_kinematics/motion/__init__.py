"""Motion: targets in, jerk-limited setpoints of the sliders out; no clock and no ROS."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.engine import MotionEngine as MotionEngine
    from tri_glide_kinematics.motion.engine import MotionPhase as MotionPhase
    from tri_glide_kinematics.motion.errors import AddedBoundError as AddedBoundError
    from tri_glide_kinematics.motion.errors import MotionError as MotionError
    from tri_glide_kinematics.motion.errors import NoPathError as NoPathError
    from tri_glide_kinematics.motion.errors import NoRoomError as NoRoomError
    from tri_glide_kinematics.motion.errors import NotStartedError as NotStartedError
    from tri_glide_kinematics.motion.errors import PlanningError as PlanningError
    from tri_glide_kinematics.motion.errors import SliderLimitError as SliderLimitError
    from tri_glide_kinematics.motion.errors import SliderTravelError as SliderTravelError
    from tri_glide_kinematics.motion.limit_use import CommandStream as CommandStream
    from tri_glide_kinematics.motion.limit_use import LimitUse as LimitUse
    from tri_glide_kinematics.motion.limits import AddedBound as AddedBound
    from tri_glide_kinematics.motion.limits import CannotHoldError as CannotHoldError
    from tri_glide_kinematics.motion.limits import ForceLimits as ForceLimits
    from tri_glide_kinematics.motion.limits import PlatformSpeedLimit as PlatformSpeedLimit
    from tri_glide_kinematics.motion.limits import SampledPlan as SampledPlan
    from tri_glide_kinematics.motion.limits import SliderLimits as SliderLimits
    from tri_glide_kinematics.motion.limits import SliderState as SliderState
    from tri_glide_kinematics.motion.moves import MotionKind as MotionKind
    from tri_glide_kinematics.motion.path import PathError as PathError
    from tri_glide_kinematics.motion.path import PathPlaceError as PathPlaceError
    from tri_glide_kinematics.motion.path import PlatformPath as PlatformPath
    from tri_glide_kinematics.motion.path_timing import plan_move as plan_move
    from tri_glide_kinematics.motion.path_timing import time_path as time_path
    from tri_glide_kinematics.motion.trajectory import Trajectory as Trajectory

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
