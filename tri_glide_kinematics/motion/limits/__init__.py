"""What bounds all motion: limits of the sliders, added bounds, and series to prove them with."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.limits.added_bounds import CannotHoldError as CannotHoldError
    from tri_glide_kinematics.motion.limits.added_bounds import ForceLimits as ForceLimits
    from tri_glide_kinematics.motion.limits.added_bounds import (
        PlatformSpeedLimit as PlatformSpeedLimit,
    )
    from tri_glide_kinematics.motion.limits.limits import EDGE_CLEARANCE as EDGE_CLEARANCE
    from tri_glide_kinematics.motion.limits.limits import QUANTITIES as QUANTITIES
    from tri_glide_kinematics.motion.limits.limits import RELATIVE_ROUNDING as RELATIVE_ROUNDING
    from tri_glide_kinematics.motion.limits.limits import TRAVEL_ROUNDING as TRAVEL_ROUNDING
    from tri_glide_kinematics.motion.limits.limits import AddedBound as AddedBound
    from tri_glide_kinematics.motion.limits.limits import PathPlaces as PathPlaces
    from tri_glide_kinematics.motion.limits.limits import PathRows as PathRows
    from tri_glide_kinematics.motion.limits.limits import SeenParts as SeenParts
    from tri_glide_kinematics.motion.limits.limits import SliderLimits as SliderLimits
    from tri_glide_kinematics.motion.limits.limits import UsedParts as UsedParts
    from tri_glide_kinematics.motion.limits.series import ORDERS as ORDERS
    from tri_glide_kinematics.motion.limits.series import SHORTEST_CELL as SHORTEST_CELL
    from tri_glide_kinematics.motion.limits.series import Series as Series
    from tri_glide_kinematics.motion.limits.series import composed as composed
    from tri_glide_kinematics.motion.limits.series import divided as divided
    from tri_glide_kinematics.motion.limits.series import dividing as dividing
    from tri_glide_kinematics.motion.limits.series import heights_of as heights_of
    from tri_glide_kinematics.motion.limits.series import largest_value as largest_value
    from tri_glide_kinematics.motion.limits.series import moved as moved
    from tri_glide_kinematics.motion.limits.series import polynomial as polynomial
    from tri_glide_kinematics.motion.limits.series import positions as positions
    from tri_glide_kinematics.motion.limits.series import quartered as quartered
    from tri_glide_kinematics.motion.limits.series import resting as resting
    from tri_glide_kinematics.motion.limits.setpoint import AT_REST as AT_REST
    from tri_glide_kinematics.motion.limits.setpoint import SampledPlan as SampledPlan
    from tri_glide_kinematics.motion.limits.setpoint import SliderState as SliderState
    from tri_glide_kinematics.motion.limits.setpoint import arms_of as arms_of
    from tri_glide_kinematics.motion.limits.setpoint import new_state as new_state
    from tri_glide_kinematics.motion.limits.setpoint import slider_state as slider_state

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
