"""Figures: pictures of motions and mechanisms."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.drawing.saving import DrawingError as DrawingError
    from tri_glide_kinematics.figures.motion import motion_figure as motion_figure
    from tri_glide_kinematics.mechanisms.pictures.pictures import save_pictures as save_pictures

__all__, __getattr__, __dir__ = when_first_used(
    __name__,
    {
        "motion": "motion_figure",
    },
)
