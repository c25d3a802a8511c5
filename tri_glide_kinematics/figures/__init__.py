"""Figures: pictures of motions, machines, calibrations and swings."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.figures.calibration_pictures import (
        calibration_figure as calibration_figure,
    )
    from tri_glide_kinematics.figures.calibration_pictures import ringdown_figure as ringdown_figure
    from tri_glide_kinematics.figures.machine import machine_figure as machine_figure
    from tri_glide_kinematics.figures.motion import Mark as Mark
    from tri_glide_kinematics.figures.motion import Span as Span
    from tri_glide_kinematics.figures.motion import file_figure as file_figure
    from tri_glide_kinematics.figures.motion import label_centres as label_centres
    from tri_glide_kinematics.figures.motion import motion_figure as motion_figure

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
