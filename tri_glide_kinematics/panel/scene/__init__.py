"""The machine and its workspace in three dimensions."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.panel.scene.scene import Pose as Pose
    from tri_glide_kinematics.panel.scene.scene import Scene as Scene
    from tri_glide_kinematics.panel.scene.scene import light_plainly as light_plainly
    from tri_glide_kinematics.panel.scene.scene import view_of as view_of
    from tri_glide_kinematics.panel.scene.shapes import Parts as Parts
    from tri_glide_kinematics.panel.scene.shapes import Quaternion as Quaternion
    from tri_glide_kinematics.panel.scene.shapes import rod_pair as rod_pair
    from tri_glide_kinematics.panel.scene.shapes import skin as skin
    from tri_glide_kinematics.panel.scene.shapes import turned as turned

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
