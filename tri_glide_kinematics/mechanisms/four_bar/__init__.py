"""The four-bar linkage: positions, analysis, sweeps."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.four_bar.analysis import Branch as Branch
    from tri_glide_kinematics.mechanisms.four_bar.analysis import DeadCentre as DeadCentre
    from tri_glide_kinematics.mechanisms.four_bar.analysis import DeadCentreKind as DeadCentreKind
    from tri_glide_kinematics.mechanisms.four_bar.analysis import GrashofClass as GrashofClass
    from tri_glide_kinematics.mechanisms.four_bar.analysis import (
        NotAssemblableError as NotAssemblableError,
    )
    from tri_glide_kinematics.mechanisms.four_bar.analysis import (
        TransmissionExtremes as TransmissionExtremes,
    )
    from tri_glide_kinematics.mechanisms.four_bar.linkage import (
        AssembledFourBar as AssembledFourBar,
    )
    from tri_glide_kinematics.mechanisms.four_bar.linkage import CrankLimitError as CrankLimitError
    from tri_glide_kinematics.mechanisms.four_bar.linkage import FourBar as FourBar
    from tri_glide_kinematics.mechanisms.four_bar.linkage import SweepEvent as SweepEvent
    from tri_glide_kinematics.mechanisms.four_bar.linkage import SweepEventKind as SweepEventKind
    from tri_glide_kinematics.mechanisms.four_bar.linkage import sweep_events as sweep_events
    from tri_glide_kinematics.mechanisms.four_bar.sweep import BranchSweep as BranchSweep
    from tri_glide_kinematics.mechanisms.four_bar.sweep import FourBarPose as FourBarPose
    from tri_glide_kinematics.mechanisms.four_bar.sweep import FourBarSweep as FourBarSweep
    from tri_glide_kinematics.mechanisms.four_bar.sweep import PointMotion as PointMotion

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
