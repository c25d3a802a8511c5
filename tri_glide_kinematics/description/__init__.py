"""A machine in the files of other programs: URDF for RViz and Foxglove, MJCF for MuJoCo."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.description.machine import PASSIVE_JOINTS as PASSIVE_JOINTS
    from tri_glide_kinematics.description.machine import RODS as RODS
    from tri_glide_kinematics.description.machine import MachineDescription as MachineDescription
    from tri_glide_kinematics.description.machine import Parts as Parts
    from tri_glide_kinematics.description.mjcf import mjcf_text as mjcf_text
    from tri_glide_kinematics.description.urdf import urdf_text as urdf_text

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
