"""Kinematics and motion of tri-glide delta robots, and of the planar mechanisms around them."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.calibration import Calibration as Calibration
    from tri_glide_kinematics.calibration import CalibrationError as CalibrationError
    from tri_glide_kinematics.calibration import Distance as Distance
    from tri_glide_kinematics.calibration import MeasuredPosition as MeasuredPosition
    from tri_glide_kinematics.calibration import Plate as Plate
    from tri_glide_kinematics.calibration import Priors as Priors
    from tri_glide_kinematics.calibration import Touch as Touch
    from tri_glide_kinematics.calibration import calibrate as calibrate
    from tri_glide_kinematics.errors import KinematicsError as KinematicsError
    from tri_glide_kinematics.errors import NotAChoiceError as NotAChoiceError
    from tri_glide_kinematics.errors import NotANumberError as NotANumberError
    from tri_glide_kinematics.errors import NotFiniteError as NotFiniteError
    from tri_glide_kinematics.errors import OutOfBoundsError as OutOfBoundsError
    from tri_glide_kinematics.errors import WrongShapeError as WrongShapeError
    from tri_glide_kinematics.mechanisms import CrankLimitError as CrankLimitError
    from tri_glide_kinematics.mechanisms import DegenerateLinkageError as DegenerateLinkageError
    from tri_glide_kinematics.mechanisms import MechanismFileError as MechanismFileError
    from tri_glide_kinematics.mechanisms import NotAPoseError as NotAPoseError
    from tri_glide_kinematics.mechanisms import NotAssemblableError as NotAssemblableError
    from tri_glide_kinematics.mechanisms import SelfMotionError as SelfMotionError
    from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism as FMechanism
    from tri_glide_kinematics.mechanisms.four_bar import Branch as Branch
    from tri_glide_kinematics.mechanisms.four_bar import FourBar as FourBar
    from tri_glide_kinematics.mechanisms.landing_gear import LandingGear as LandingGear
    from tri_glide_kinematics.motion.engine import MotionEngine as MotionEngine
    from tri_glide_kinematics.motion.engine import MotionPhase as MotionPhase
    from tri_glide_kinematics.motion.errors import MotionError as MotionError
    from tri_glide_kinematics.motion.errors import NoRoomError as NoRoomError
    from tri_glide_kinematics.motion.errors import NotStartedError as NotStartedError
    from tri_glide_kinematics.motion.errors import PlanningError as PlanningError
    from tri_glide_kinematics.motion.errors import SliderLimitError as SliderLimitError
    from tri_glide_kinematics.motion.errors import SliderTravelError as SliderTravelError
    from tri_glide_kinematics.motion.limits import SliderLimits as SliderLimits
    from tri_glide_kinematics.motion.moves import MotionKind as MotionKind
    from tri_glide_kinematics.motion.path import PathError as PathError
    from tri_glide_kinematics.motion.path import PathPlaceError as PathPlaceError
    from tri_glide_kinematics.motion.path import PlatformPath as PlatformPath
    from tri_glide_kinematics.motion.path_timing import plan_move as plan_move
    from tri_glide_kinematics.motion.path_timing import time_path as time_path
    from tri_glide_kinematics.motion.trajectory import Trajectory as Trajectory
    from tri_glide_kinematics.tri_glide import ArmsNeverMeetError as ArmsNeverMeetError
    from tri_glide_kinematics.tri_glide import ArmTooShortError as ArmTooShortError
    from tri_glide_kinematics.tri_glide import CoincidentAnchorsError as CoincidentAnchorsError
    from tri_glide_kinematics.tri_glide import CollinearAnchorsError as CollinearAnchorsError
    from tri_glide_kinematics.tri_glide import GeometryError as GeometryError
    from tri_glide_kinematics.tri_glide import NoPoseError as NoPoseError
    from tri_glide_kinematics.tri_glide import PlatformAboveSliderError as PlatformAboveSliderError
    from tri_glide_kinematics.tri_glide import SpheresDoNotMeetError as SpheresDoNotMeetError
    from tri_glide_kinematics.tri_glide import TriGlide as TriGlide
    from tri_glide_kinematics.tri_glide import TriGlideGeometry as TriGlideGeometry
    from tri_glide_kinematics.tri_glide import UnreachableError as UnreachableError
    from tri_glide_kinematics.tri_glide import WrongAssemblyModeError as WrongAssemblyModeError
    from tri_glide_kinematics.workspace import Cylinder as Cylinder
    from tri_glide_kinematics.workspace import OutsideWorkspaceError as OutsideWorkspaceError
    from tri_glide_kinematics.workspace import Workspace as Workspace
    from tri_glide_kinematics.workspace import WorkspaceLimits as WorkspaceLimits

__version__ = "1.0.0"

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
