"""Moves to a position, jogs and stops, from rest or in motion."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.moves.hard_braking import hardest_braking as hardest_braking
    from tri_glide_kinematics.motion.moves.line_entry import Entry as Entry
    from tri_glide_kinematics.motion.moves.line_entry import LineToPosition as LineToPosition
    from tri_glide_kinematics.motion.moves.line_moves import LinearMotion as LinearMotion
    from tri_glide_kinematics.motion.moves.line_moves import LineJoining as LineJoining
    from tri_glide_kinematics.motion.moves.line_timing import NORM as NORM
    from tri_glide_kinematics.motion.moves.line_timing import LineTiming as LineTiming
    from tri_glide_kinematics.motion.moves.line_timing import parametrise as parametrise
    from tri_glide_kinematics.motion.moves.search import REACHED as REACHED
    from tri_glide_kinematics.motion.moves.search import MotionKind as MotionKind
    from tri_glide_kinematics.motion.moves.search import MotionPlanner as MotionPlanner
    from tri_glide_kinematics.motion.moves.search import SliderMotion as SliderMotion
    from tri_glide_kinematics.motion.moves.stopping import LONGEST_TRACKED as LONGEST_TRACKED
    from tri_glide_kinematics.motion.moves.stopping import NEARLY as NEARLY
    from tri_glide_kinematics.motion.moves.stopping import Along as Along
    from tri_glide_kinematics.motion.moves.stopping import inside as inside
    from tri_glide_kinematics.motion.moves.stopping import own_stop as own_stop

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
