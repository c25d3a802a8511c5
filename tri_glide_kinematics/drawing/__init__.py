"""Code that all commands that draw share."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.drawing.exit_code import find_file as find_file
    from tri_glide_kinematics.drawing.saving import DrawingError as DrawingError
    from tri_glide_kinematics.drawing.saving import save_figure as save_figure
    from tri_glide_kinematics.drawing.style import LIMIT_STYLE as LIMIT_STYLE
    from tri_glide_kinematics.drawing.style import MILLIMETRES as MILLIMETRES

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
