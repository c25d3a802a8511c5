"""Trajectories to rest: their curves and time scalings, and the proof that they keep limits."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.trajectory.along_curve import CurvePlan as CurvePlan
    from tri_glide_kinematics.motion.trajectory.along_curve import LinePlan as LinePlan
    from tri_glide_kinematics.motion.trajectory.along_curve import PathPlan as PathPlan
    from tri_glide_kinematics.motion.trajectory.along_curve import bounds_along as bounds_along
    from tri_glide_kinematics.motion.trajectory.along_curve import with_added as with_added
    from tri_glide_kinematics.motion.trajectory.cubic import SAME_TIME as SAME_TIME
    from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan as CubicPlan
    from tri_glide_kinematics.motion.trajectory.cubic import SliderProfile as SliderProfile
    from tri_glide_kinematics.motion.trajectory.cubic import StraightPlan as StraightPlan
    from tri_glide_kinematics.motion.trajectory.cubic import TrackedStep as TrackedStep
    from tri_glide_kinematics.motion.trajectory.cubic import lasting as lasting
    from tri_glide_kinematics.motion.trajectory.cubic import with_knots_of as with_knots_of
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
    from tri_glide_kinematics.motion.trajectory.curves import SpeedSteps as SpeedSteps
    from tri_glide_kinematics.motion.trajectory.curves import StraightLine as StraightLine
    from tri_glide_kinematics.motion.trajectory.phases import CoordinateProfile as CoordinateProfile
    from tri_glide_kinematics.motion.trajectory.phases import Phases as Phases
    from tri_glide_kinematics.motion.trajectory.phases import after as after
    from tri_glide_kinematics.motion.trajectory.phases import cut_to as cut_to
    from tri_glide_kinematics.motion.trajectory.phases import evaluate as evaluate
    from tri_glide_kinematics.motion.trajectory.phases import knots as knots
    from tri_glide_kinematics.motion.trajectory.phases import merged as merged
    from tri_glide_kinematics.motion.trajectory.phases import rest_to_rest as rest_to_rest
    from tri_glide_kinematics.motion.trajectory.phases import shortest_piece as shortest_piece
    from tri_glide_kinematics.motion.trajectory.phases import total_duration as total_duration
    from tri_glide_kinematics.motion.trajectory.ruckig_planner import RuckigPlanner as RuckigPlanner
    from tri_glide_kinematics.motion.trajectory.time_scaling import PathStart as PathStart
    from tri_glide_kinematics.motion.trajectory.time_scaling import TimeScaling as TimeScaling
    from tri_glide_kinematics.motion.trajectory.trajectory import MixedSeries as MixedSeries
    from tri_glide_kinematics.motion.trajectory.trajectory import SequencePlan as SequencePlan
    from tri_glide_kinematics.motion.trajectory.trajectory import Trajectory as Trajectory
    from tri_glide_kinematics.motion.trajectory.trajectory import UsableParts as UsableParts
    from tri_glide_kinematics.motion.trajectory.trajectory import check_added as check_added
    from tri_glide_kinematics.motion.trajectory.trajectory import checked as checked
    from tri_glide_kinematics.motion.trajectory.trajectory import close_to as close_to
    from tri_glide_kinematics.motion.trajectory.trajectory import gentler as gentler
    from tri_glide_kinematics.motion.trajectory.trajectory import joined_series as joined_series
    from tri_glide_kinematics.motion.trajectory.trajectory import kept as kept

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
