"""Following a target that moves: one certified step after the other."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.tracking.clearance import first_certified as first_certified
    from tri_glide_kinematics.motion.tracking.follower import Follower as Follower
    from tri_glide_kinematics.motion.tracking.moving_target import FOLLOW_HORIZON as FOLLOW_HORIZON
    from tri_glide_kinematics.motion.tracking.moving_target import (
        LONGEST_HORIZON as LONGEST_HORIZON,
    )
    from tri_glide_kinematics.motion.tracking.moving_target import MovingTarget as MovingTarget
    from tri_glide_kinematics.motion.tracking.moving_target import TargetMotion as TargetMotion
    from tri_glide_kinematics.motion.tracking.moving_target import ToldPlaces as ToldPlaces
    from tri_glide_kinematics.motion.tracking.moving_target import ToldVelocity as ToldVelocity
    from tri_glide_kinematics.motion.tracking.moving_target import Wanted as Wanted
    from tri_glide_kinematics.motion.tracking.moving_target import WantedVelocity as WantedVelocity
    from tri_glide_kinematics.motion.tracking.slider_way import SliderWay as SliderWay
    from tri_glide_kinematics.motion.tracking.slider_way import braking_alone as braking_alone
    from tri_glide_kinematics.motion.tracking.slider_way import braking_together as braking_together
    from tri_glide_kinematics.motion.tracking.slider_way import to_zero as to_zero
    from tri_glide_kinematics.motion.tracking.velocity_tracking import SLOWEST_JOG as SLOWEST_JOG

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
