"""Paths of lines and arcs, their corners rounded to a tolerance."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.path.driven_path import DrivenPath as DrivenPath
    from tri_glide_kinematics.motion.path.errors import PathError as PathError
    from tri_glide_kinematics.motion.path.errors import PathPlaceError as PathPlaceError
    from tri_glide_kinematics.motion.path.platform_path import PlatformPath as PlatformPath

__all__, __getattr__, __dir__ = when_first_used(
    __name__,
    {
        "driven_path": "DrivenPath",
        "drive_file": "PathError PathPlaceError",
        "platform_path": "PlatformPath",
    },
)
