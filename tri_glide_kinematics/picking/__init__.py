"""Picking: parts on a belt, seen by cameras, from the first view to their one outcome."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.picking.teaching import MirrorImageError as MirrorImageError
    from tri_glide_kinematics.picking.teaching import NoFitError as NoFitError
    from tri_glide_kinematics.picking.teaching import Observed as Observed
    from tri_glide_kinematics.picking.teaching import TaughtBelt as TaughtBelt
    from tri_glide_kinematics.picking.teaching import TaughtCamera as TaughtCamera
    from tri_glide_kinematics.picking.teaching import TaughtGripper as TaughtGripper
    from tri_glide_kinematics.picking.teaching import TaughtLatency as TaughtLatency
    from tri_glide_kinematics.picking.teaching import TeachingError as TeachingError
    from tri_glide_kinematics.picking.teaching import TooFewError as TooFewError
    from tri_glide_kinematics.picking.teaching import TooNearError as TooNearError
    from tri_glide_kinematics.picking.teaching import UncertainError as UncertainError
    from tri_glide_kinematics.picking.teaching import teach_belt as teach_belt
    from tri_glide_kinematics.picking.teaching import teach_camera as teach_camera
    from tri_glide_kinematics.picking.teaching import teach_gripper as teach_gripper
    from tri_glide_kinematics.picking.teaching import teach_latency as teach_latency

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
