"""Shaped trajectories: what a shaper makes of others, what it cuts, and the proof of that."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.shaped.bends import Bends as Bends
    from tri_glide_kinematics.motion.shaped.bends import DrivenPart as DrivenPart
    from tri_glide_kinematics.motion.shaped.shaped import LimitBounds as LimitBounds
    from tri_glide_kinematics.motion.shaped.shaped import Planned as Planned
    from tri_glide_kinematics.motion.shaped.shaped import SeriesPlan as SeriesPlan
    from tri_glide_kinematics.motion.shaped.shaped import ShapedTrajectory as ShapedTrajectory
    from tri_glide_kinematics.motion.shaped.shaped import planned_shaped as planned_shaped
    from tri_glide_kinematics.motion.shaped.slowed import SlowedPlan as SlowedPlan

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
