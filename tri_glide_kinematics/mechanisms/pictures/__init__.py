"""Pictures of planar mechanisms."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.pictures.drawing import DrawnMechanism as DrawnMechanism
    from tri_glide_kinematics.mechanisms.pictures.drawing import LengthUnit as LengthUnit
    from tri_glide_kinematics.mechanisms.pictures.drawing import angle_axis as angle_axis
    from tri_glide_kinematics.mechanisms.pictures.drawing import degrees_text as degrees_text
    from tri_glide_kinematics.mechanisms.pictures.drawing import save_movie as save_movie
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
        FEWEST_SAMPLES as FEWEST_SAMPLES,
    )
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import BranchCurve as BranchCurve
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import angle_figure as angle_figure
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
        angle_that_is_drawn as angle_that_is_drawn,
    )
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
        branch_through as branch_through,
    )
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
        corners_figure as corners_figure,
    )
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import describe as describe
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
        detailed_overview as detailed_overview,
    )
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import evenly as evenly
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
        f_mechanism_movie as f_mechanism_movie,
    )
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import paths_figure as paths_figure
    from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
        positions_figure as positions_figure,
    )
    from tri_glide_kinematics.mechanisms.pictures.four_bar import angles_figure as angles_figure
    from tri_glide_kinematics.mechanisms.pictures.four_bar import (
        coupler_curve_figure as coupler_curve_figure,
    )
    from tri_glide_kinematics.mechanisms.pictures.four_bar import crank_angles as crank_angles
    from tri_glide_kinematics.mechanisms.pictures.four_bar import four_bar_movie as four_bar_movie
    from tri_glide_kinematics.mechanisms.pictures.four_bar import interval_around as interval_around
    from tri_glide_kinematics.mechanisms.pictures.picture_set import Choice as Choice
    from tri_glide_kinematics.mechanisms.pictures.picture_set import DrawingError as DrawingError
    from tri_glide_kinematics.mechanisms.pictures.picture_set import pictures_of as pictures_of
    from tri_glide_kinematics.mechanisms.pictures.skeleton import BLUE as BLUE
    from tri_glide_kinematics.mechanisms.pictures.skeleton import F_MECHANISM as F_MECHANISM
    from tri_glide_kinematics.mechanisms.pictures.skeleton import FOUR_BAR as FOUR_BAR
    from tri_glide_kinematics.mechanisms.pictures.skeleton import GREEN as GREEN
    from tri_glide_kinematics.mechanisms.pictures.skeleton import ORANGE as ORANGE
    from tri_glide_kinematics.mechanisms.pictures.skeleton import PURPLE as PURPLE
    from tri_glide_kinematics.mechanisms.pictures.skeleton import bounds as bounds
    from tri_glide_kinematics.mechanisms.pictures.skeleton import default_branch as default_branch
    from tri_glide_kinematics.mechanisms.pictures.skeleton import (
        default_crank_angle as default_crank_angle,
    )
    from tri_glide_kinematics.mechanisms.pictures.skeleton import side_by_side as side_by_side

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
