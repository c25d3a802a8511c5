"""Pictures of a calibration, and the command that makes one from a file."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.figures.calibration.command import PARAMETERS as PARAMETERS
    from tri_glide_kinematics.figures.calibration.command import PICTURE as PICTURE
    from tri_glide_kinematics.figures.calibration.command import REPORT as REPORT
    from tri_glide_kinematics.figures.calibration.pictures import OUTLIER_COLOR as OUTLIER_COLOR
    from tri_glide_kinematics.figures.calibration.pictures import (
        calibration_figure as calibration_figure,
    )
    from tri_glide_kinematics.figures.calibration.pictures import draw_maps as draw_maps
    from tri_glide_kinematics.figures.calibration.pictures import draw_residuals as draw_residuals

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
