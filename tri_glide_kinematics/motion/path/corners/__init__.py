"""How the corners of a path are rounded."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.path.corners.corrections import (
        corrections_of as corrections_of,
    )
    from tri_glide_kinematics.motion.path.corners.joints import LEAST_RATE as LEAST_RATE
    from tri_glide_kinematics.motion.path.corners.joints import RoundedJoints as RoundedJoints
    from tri_glide_kinematics.motion.path.corners.joints import ShapedCorners as ShapedCorners
    from tri_glide_kinematics.motion.path.corners.joints import joints_of as joints_of
    from tri_glide_kinematics.motion.path.corners.joints import lengths_of as lengths_of
    from tri_glide_kinematics.motion.path.corners.rounding import MAX_ROUNDS as MAX_ROUNDS
    from tri_glide_kinematics.motion.path.corners.rounding import SMALLER as SMALLER
    from tri_glide_kinematics.motion.path.corners.rounding import enveloped as enveloped
    from tri_glide_kinematics.motion.path.corners.rounding import least_widths as least_widths
    from tri_glide_kinematics.motion.path.corners.rounding import widths_behind as widths_behind
    from tri_glide_kinematics.motion.path.corners.rounding import widths_kept as widths_kept
    from tri_glide_kinematics.motion.path.corners.rounding import widths_of as widths_of
    from tri_glide_kinematics.motion.path.corners.widths import (
        FARTHEST_SWING as FARTHEST_SWING,
    )
    from tri_glide_kinematics.motion.path.corners.widths import SWING_REACH as SWING_REACH
    from tri_glide_kinematics.motion.path.corners.widths import Widths as Widths

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
