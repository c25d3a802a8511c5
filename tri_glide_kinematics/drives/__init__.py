"""Drives on a bus: their states, units, playing out and homing. No ROS; one seam to the bus."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.drives.playout import Playout as Playout
    from tri_glide_kinematics.drives.playout import Setpoint as Setpoint
    from tri_glide_kinematics.drives.playout import SetpointRefusedError as SetpointRefusedError
    from tri_glide_kinematics.drives.playout import farthest_off as farthest_off

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
