"""Kinematics and motion of tri-glide delta robots, and of the planar mechanisms around them."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.calibration.fit.calibrate import calibrate as calibrate
    from tri_glide_kinematics.errors import KinematicsError as KinematicsError
    from tri_glide_kinematics.errors import NotAChoiceError as NotAChoiceError
    from tri_glide_kinematics.errors import NotANumberError as NotANumberError
    from tri_glide_kinematics.errors import NotFiniteError as NotFiniteError
    from tri_glide_kinematics.errors import OutOfBoundsError as OutOfBoundsError
    from tri_glide_kinematics.errors import WrongShapeError as WrongShapeError
    from tri_glide_kinematics.mechanisms.errors import CrankLimitError as CrankLimitError
    from tri_glide_kinematics.mechanisms.errors import (
        DegenerateLinkageError as DegenerateLinkageError,
    )
    from tri_glide_kinematics.mechanisms.errors import MechanismFileError as MechanismFileError
    from tri_glide_kinematics.mechanisms.errors import NotAPoseError as NotAPoseError
    from tri_glide_kinematics.mechanisms.errors import NotAssemblableError as NotAssemblableError
    from tri_glide_kinematics.mechanisms.errors import SelfMotionError as SelfMotionError
    from tri_glide_kinematics.mechanisms.f_mechanism.mechanism import FMechanism as FMechanism
    from tri_glide_kinematics.mechanisms.four_bar.analysis import Branch as Branch
    from tri_glide_kinematics.mechanisms.four_bar.linkage import FourBar as FourBar
    from tri_glide_kinematics.mechanisms.landing_gear.gear import LandingGear as LandingGear
    from tri_glide_kinematics.motion.engine.engine import MotionEngine as MotionEngine
    from tri_glide_kinematics.motion.engine.held_motion import MotionPhase as MotionPhase
    from tri_glide_kinematics.motion.moves.search import MotionKind as MotionKind
    from tri_glide_kinematics.motion.path.errors import PathError as PathError
    from tri_glide_kinematics.motion.path.errors import PathPlaceError as PathPlaceError
    from tri_glide_kinematics.motion.path.platform_path import PlatformPath as PlatformPath
    from tri_glide_kinematics.motion.trajectory.errors import MotionError as MotionError
    from tri_glide_kinematics.motion.trajectory.errors import NoRoomError as NoRoomError
    from tri_glide_kinematics.motion.trajectory.errors import NotStartedError as NotStartedError
    from tri_glide_kinematics.motion.trajectory.errors import PlanningError as PlanningError
    from tri_glide_kinematics.motion.trajectory.errors import SliderLimitError as SliderLimitError
    from tri_glide_kinematics.motion.trajectory.errors import SliderTravelError as SliderTravelError
    from tri_glide_kinematics.motion.trajectory.limits import SliderLimits as SliderLimits
    from tri_glide_kinematics.tri_glide.errors import ArmsNeverMeetError as ArmsNeverMeetError
    from tri_glide_kinematics.tri_glide.errors import ArmTooShortError as ArmTooShortError
    from tri_glide_kinematics.tri_glide.errors import (
        CoincidentAnchorsError as CoincidentAnchorsError,
    )
    from tri_glide_kinematics.tri_glide.errors import CollinearAnchorsError as CollinearAnchorsError
    from tri_glide_kinematics.tri_glide.errors import GeometryError as GeometryError
    from tri_glide_kinematics.tri_glide.errors import NoPoseError as NoPoseError
    from tri_glide_kinematics.tri_glide.errors import (
        PlatformAboveSliderError as PlatformAboveSliderError,
    )
    from tri_glide_kinematics.tri_glide.errors import SpheresDoNotMeetError as SpheresDoNotMeetError
    from tri_glide_kinematics.tri_glide.errors import UnreachableError as UnreachableError
    from tri_glide_kinematics.tri_glide.errors import (
        WrongAssemblyModeError as WrongAssemblyModeError,
    )
    from tri_glide_kinematics.tri_glide.geometry import TriGlideGeometry as TriGlideGeometry
    from tri_glide_kinematics.tri_glide.kinematics import TriGlide as TriGlide
    from tri_glide_kinematics.workspace.errors import OutsideWorkspaceError as OutsideWorkspaceError
    from tri_glide_kinematics.workspace.limits import Cylinder as Cylinder
    from tri_glide_kinematics.workspace.limits import WorkspaceLimits as WorkspaceLimits
    from tri_glide_kinematics.workspace.workspace import Workspace as Workspace

__version__ = "0.1.0"

__all__, __getattr__, __dir__ = when_first_used(
    __name__,
    {
        "calibration.fit.calibrate": "calibrate",
        "drive_file": (
            "KinematicsError NotAChoiceError NotANumberError NotFiniteError OutOfBoundsError "
            "WrongShapeError"
        ),
        "mechanisms.errors": (
            "CrankLimitError DegenerateLinkageError MechanismFileError NotAPoseError "
            "NotAssemblableError SelfMotionError"
        ),
        "mechanisms.f_mechanism.mechanism": "FMechanism",
        "mechanisms.four_bar.analysis": "Branch",
        "mechanisms.four_bar.linkage": "FourBar",
        "mechanisms.landing_gear.gear": "LandingGear",
        "motion.engine.engine": "MotionEngine",
        "motion.engine.held_motion": "MotionPhase",
        "motion.moves.search": "MotionKind",
        "motion.path.errors": "PathError PathPlaceError",
        "motion.path.platform_path": "PlatformPath",
        "motion.trajectory.errors": (
            "MotionError NoRoomError NotStartedError PlanningError SliderLimitError "
            "SliderTravelError"
        ),
        "motion.trajectory.limits": "SliderLimits",
        "tri_glide.errors": (
            "ArmTooShortError ArmsNeverMeetError CoincidentAnchorsError CollinearAnchorsError "
            "GeometryError NoPoseError PlatformAboveSliderError SpheresDoNotMeetError "
            "UnreachableError WrongAssemblyModeError"
        ),
        "tri_glide.geometry": "TriGlideGeometry",
        "tri_glide.kinematics": "TriGlide",
        "workspace.errors": "OutsideWorkspaceError",
        "workspace.limits": "Cylinder WorkspaceLimits",
        "workspace.workspace": "Workspace",
    },
)
