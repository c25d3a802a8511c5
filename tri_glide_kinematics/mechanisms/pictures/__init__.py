"""Pictures of planar mechanisms."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.pictures.skeleton import BLUE as BLUE
    from tri_glide_kinematics.mechanisms.pictures.skeleton import F_MECHANISM as F_MECHANISM
    from tri_glide_kinematics.mechanisms.pictures.skeleton import FOUR_BAR as FOUR_BAR
    from tri_glide_kinematics.mechanisms.pictures.skeleton import GREEN as GREEN
    from tri_glide_kinematics.mechanisms.pictures.skeleton import ORANGE as ORANGE
    from tri_glide_kinematics.mechanisms.pictures.skeleton import PURPLE as PURPLE
    from tri_glide_kinematics.mechanisms.pictures.skeleton import BranchCurve as BranchCurve
    from tri_glide_kinematics.mechanisms.pictures.skeleton import bounds as bounds
    from tri_glide_kinematics.mechanisms.pictures.skeleton import default_branch as default_branch
    from tri_glide_kinematics.mechanisms.pictures.skeleton import (
        default_crank_angle as default_crank_angle,
    )
    from tri_glide_kinematics.mechanisms.pictures.skeleton import (
        f_mechanism_points as f_mechanism_points,
    )
    from tri_glide_kinematics.mechanisms.pictures.skeleton import four_bar_points as four_bar_points

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
