"""The landing gear: motion, momentum and reactions."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.landing_gear.gear import BodyState as BodyState
    from tri_glide_kinematics.mechanisms.landing_gear.gear import LandingGear as LandingGear
    from tri_glide_kinematics.mechanisms.landing_gear.gear import (
        LandingGearMotion as LandingGearMotion,
    )
    from tri_glide_kinematics.mechanisms.landing_gear.gear import (
        LandingGearState as LandingGearState,
    )
    from tri_glide_kinematics.mechanisms.landing_gear.gear import Reaction as Reaction

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
