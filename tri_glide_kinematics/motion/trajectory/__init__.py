"""Trajectories to rest: their curves and time scalings, and the proof that they keep limits."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.trajectory.added_bounds import AddedBound as AddedBound
    from tri_glide_kinematics.motion.trajectory.added_bounds import AddedUse as AddedUse
    from tri_glide_kinematics.motion.trajectory.added_bounds import PathPlaces as PathPlaces
    from tri_glide_kinematics.motion.trajectory.added_bounds import PathRows as PathRows
    from tri_glide_kinematics.motion.trajectory.added_bounds import (
        PlatformSpeedLimit as PlatformSpeedLimit,
    )
    from tri_glide_kinematics.motion.trajectory.added_bounds import UsableParts as UsableParts
    from tri_glide_kinematics.motion.trajectory.added_bounds import added_use as added_use
    from tri_glide_kinematics.motion.trajectory.added_bounds import check_added as check_added
    from tri_glide_kinematics.motion.trajectory.added_bounds import checked as checked
    from tri_glide_kinematics.motion.trajectory.added_bounds import gentler as gentler
    from tri_glide_kinematics.motion.trajectory.added_bounds import kept as kept
    from tri_glide_kinematics.motion.trajectory.along_curve import CurvePlan as CurvePlan
    from tri_glide_kinematics.motion.trajectory.along_curve import LinePlan as LinePlan
    from tri_glide_kinematics.motion.trajectory.along_curve import PathPlan as PathPlan
    from tri_glide_kinematics.motion.trajectory.along_curve import bounds_along as bounds_along
    from tri_glide_kinematics.motion.trajectory.along_curve import with_added as with_added
    from tri_glide_kinematics.motion.trajectory.bends import Bends as Bends
    from tri_glide_kinematics.motion.trajectory.cubic import SAME_TIME as SAME_TIME
    from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan as CubicPlan
    from tri_glide_kinematics.motion.trajectory.cubic import StraightPlan as StraightPlan
    from tri_glide_kinematics.motion.trajectory.cubic import TrackedStep as TrackedStep
    from tri_glide_kinematics.motion.trajectory.curve_bounds import (
        NO_BACKWARD_SPEED as NO_BACKWARD_SPEED,
    )
    from tri_glide_kinematics.motion.trajectory.curve_bounds import Bounds as Bounds
    from tri_glide_kinematics.motion.trajectory.curve_bounds import blocks as blocks
    from tri_glide_kinematics.motion.trajectory.curve_bounds import bounds_of as bounds_of
    from tri_glide_kinematics.motion.trajectory.curve_bounds import check_along as check_along
    from tri_glide_kinematics.motion.trajectory.curve_bounds import (
        derivative_bounds as derivative_bounds,
    )
    from tri_glide_kinematics.motion.trajectory.curve_bounds import smooth_parts as smooth_parts
    from tri_glide_kinematics.motion.trajectory.curves import Curve as Curve
    from tri_glide_kinematics.motion.trajectory.curves import HeightDerivatives as HeightDerivatives
    from tri_glide_kinematics.motion.trajectory.curves import PathHeights as PathHeights
    from tri_glide_kinematics.motion.trajectory.curves import Slowing as Slowing
    from tri_glide_kinematics.motion.trajectory.curves import StraightLine as StraightLine
    from tri_glide_kinematics.motion.trajectory.errors import SOUND as SOUND
    from tri_glide_kinematics.motion.trajectory.errors import AddedBoundError as AddedBoundError
    from tri_glide_kinematics.motion.trajectory.errors import CutBendError as CutBendError
    from tri_glide_kinematics.motion.trajectory.errors import MotionError as MotionError
    from tri_glide_kinematics.motion.trajectory.errors import NewerGoalError as NewerGoalError
    from tri_glide_kinematics.motion.trajectory.errors import NoPathError as NoPathError
    from tri_glide_kinematics.motion.trajectory.errors import NoRoomError as NoRoomError
    from tri_glide_kinematics.motion.trajectory.errors import NotStartedError as NotStartedError
    from tri_glide_kinematics.motion.trajectory.errors import PathTimingError as PathTimingError
    from tri_glide_kinematics.motion.trajectory.errors import PlanningError as PlanningError
    from tri_glide_kinematics.motion.trajectory.errors import PlanTooLongError as PlanTooLongError
    from tri_glide_kinematics.motion.trajectory.errors import SliderLimitError as SliderLimitError
    from tri_glide_kinematics.motion.trajectory.force_limits import (
        CannotHoldError as CannotHoldError,
    )
    from tri_glide_kinematics.motion.trajectory.force_limits import ForceLimits as ForceLimits
    from tri_glide_kinematics.motion.trajectory.knots import knots_with_blend as knots_with_blend
    from tri_glide_kinematics.motion.trajectory.knots import lasting as lasting
    from tri_glide_kinematics.motion.trajectory.knots import merged as merged
    from tri_glide_kinematics.motion.trajectory.knots import shortest_piece as shortest_piece
    from tri_glide_kinematics.motion.trajectory.knots import with_knots_of as with_knots_of
    from tri_glide_kinematics.motion.trajectory.limits import EDGE_CLEARANCE as EDGE_CLEARANCE
    from tri_glide_kinematics.motion.trajectory.limits import QUANTITIES as QUANTITIES
    from tri_glide_kinematics.motion.trajectory.limits import RELATIVE_ROUNDING as RELATIVE_ROUNDING
    from tri_glide_kinematics.motion.trajectory.limits import TRAVEL_ROUNDING as TRAVEL_ROUNDING
    from tri_glide_kinematics.motion.trajectory.limits import SliderLimits as SliderLimits
    from tri_glide_kinematics.motion.trajectory.phases import CoordinateProfile as CoordinateProfile
    from tri_glide_kinematics.motion.trajectory.phases import Phases as Phases
    from tri_glide_kinematics.motion.trajectory.phases import after as after
    from tri_glide_kinematics.motion.trajectory.phases import evaluate as evaluate
    from tri_glide_kinematics.motion.trajectory.phases import first_of as first_of
    from tri_glide_kinematics.motion.trajectory.phases import rest_to_rest as rest_to_rest
    from tri_glide_kinematics.motion.trajectory.phases import total_duration as total_duration
    from tri_glide_kinematics.motion.trajectory.ruckig_planner import RuckigPlanner as RuckigPlanner
    from tri_glide_kinematics.motion.trajectory.ruckig_planner import (
        Synchronization as Synchronization,
    )
    from tri_glide_kinematics.motion.trajectory.shaped import DrivenPart as DrivenPart
    from tri_glide_kinematics.motion.trajectory.shaped import LimitBounds as LimitBounds
    from tri_glide_kinematics.motion.trajectory.shaped import Planned as Planned
    from tri_glide_kinematics.motion.trajectory.shaped import ShapedTrajectory as ShapedTrajectory
    from tri_glide_kinematics.motion.trajectory.shaped import planned_shaped as planned_shaped
    from tri_glide_kinematics.motion.trajectory.slowed import SlowedPlan as SlowedPlan
    from tri_glide_kinematics.motion.trajectory.time_scaling import PathScaling as PathScaling
    from tri_glide_kinematics.motion.trajectory.time_scaling import PathStart as PathStart
    from tri_glide_kinematics.motion.trajectory.time_scaling import TimeScaling as TimeScaling
    from tri_glide_kinematics.motion.trajectory.trajectory import AT_REST as AT_REST
    from tri_glide_kinematics.motion.trajectory.trajectory import SampledPlan as SampledPlan
    from tri_glide_kinematics.motion.trajectory.trajectory import SequencePlan as SequencePlan
    from tri_glide_kinematics.motion.trajectory.trajectory import SliderState as SliderState
    from tri_glide_kinematics.motion.trajectory.trajectory import Trajectory as Trajectory

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
