"""Transfers: from place to place, where a place may move, as one verified plan."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.transfer.legs import Station as Station
    from tri_glide_kinematics.motion.transfer.legs import TransferError as TransferError
    from tri_glide_kinematics.motion.transfer.legs import TransferPlan as TransferPlan
    from tri_glide_kinematics.motion.transfer.lifting import given_up as given_up
    from tri_glide_kinematics.motion.transfer.planner import TransferPlanner as TransferPlanner
    from tri_glide_kinematics.motion.transfer.renewing import Renewal as Renewal
    from tri_glide_kinematics.motion.transfer.ways import Ways as Ways

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
