"""Motion along a path in nearly the least time that the limits allow."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.path_timing.planner import PathPlanner as PathPlanner
    from tri_glide_kinematics.motion.path_timing.planner import plan_move as plan_move
    from tri_glide_kinematics.motion.path_timing.planner import time_path as time_path
    from tri_glide_kinematics.motion.path_timing.windows import plan_window as plan_window

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
