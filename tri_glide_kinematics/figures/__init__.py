"""Figures: pictures of motions and mechanisms."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.figures.errors import DrawingError as DrawingError
    from tri_glide_kinematics.figures.mechanisms.pictures import save_pictures as save_pictures
    from tri_glide_kinematics.figures.motion import motion_figure as motion_figure

__all__, __getattr__, __dir__ = when_first_used(
    __name__,
    {
        "errors": "DrawingError",
        "mechanisms.pictures": "save_pictures",
        "motion": "motion_figure",
    },
)
