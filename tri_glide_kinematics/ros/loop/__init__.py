"""The loop of a node with a period: its cycle first, all else in what time is left."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.ros.loop.cycle_loop import FORGETTING as FORGETTING
    from tri_glide_kinematics.ros.loop.cycle_loop import Cycle as Cycle
    from tri_glide_kinematics.ros.loop.cycle_loop import CycleLoop as CycleLoop
    from tri_glide_kinematics.ros.loop.cycle_loop import ErrorLog as ErrorLog
    from tri_glide_kinematics.ros.loop.cycle_loop import PlanningTime as PlanningTime

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
