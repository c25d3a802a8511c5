"""Motion that leaves no vibration behind."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.shaping.by_place import ShaperByPlace as ShaperByPlace
    from tri_glide_kinematics.motion.shaping.by_place import Shaping as Shaping
    from tri_glide_kinematics.motion.shaping.shapers import HIGHEST_FREQUENCY as HIGHEST_FREQUENCY
    from tri_glide_kinematics.motion.shaping.shapers import LOWEST_FREQUENCY as LOWEST_FREQUENCY
    from tri_glide_kinematics.motion.shaping.shapers import MOST_DAMPING as MOST_DAMPING
    from tri_glide_kinematics.motion.shaping.shapers import MOST_MODES as MOST_MODES
    from tri_glide_kinematics.motion.shaping.shapers import Mode as Mode
    from tri_glide_kinematics.motion.shaping.shapers import Shaper as Shaper
    from tri_glide_kinematics.motion.shaping.shapers import ShaperKind as ShaperKind
    from tri_glide_kinematics.motion.shaping.shapers import residual as residual

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
