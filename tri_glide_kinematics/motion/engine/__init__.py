"""The engine: commands in, setpoints out; it always holds a verified trajectory to rest."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.engine.commands import Command as Command
    from tri_glide_kinematics.motion.engine.commands import Follow as Follow
    from tri_glide_kinematics.motion.engine.commands import GoalCode as GoalCode
    from tri_glide_kinematics.motion.engine.commands import Jog as Jog
    from tri_glide_kinematics.motion.engine.commands import MotionPhase as MotionPhase
    from tri_glide_kinematics.motion.engine.commands import Move as Move
    from tri_glide_kinematics.motion.engine.commands import NewLimits as NewLimits
    from tri_glide_kinematics.motion.engine.commands import Outcome as Outcome
    from tri_glide_kinematics.motion.engine.commands import PathOutputs as PathOutputs
    from tri_glide_kinematics.motion.engine.commands import TargetKind as TargetKind
    from tri_glide_kinematics.motion.engine.commands import Track as Track
    from tri_glide_kinematics.motion.engine.commands import Transfer as Transfer
    from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits as DriveLimits
    from tri_glide_kinematics.motion.engine.engine import MotionEngine as MotionEngine
    from tri_glide_kinematics.motion.engine.held_motion import HeldMotion as HeldMotion
    from tri_glide_kinematics.motion.engine.held_motion import PathProgress as PathProgress
    from tri_glide_kinematics.motion.engine.held_motion import PlanRole as PlanRole
    from tri_glide_kinematics.motion.engine.replanning import Replanning as Replanning
    from tri_glide_kinematics.motion.engine.tracker import Tracker as Tracker
    from tri_glide_kinematics.motion.engine.transferring import TransferProgress as TransferProgress
    from tri_glide_kinematics.motion.transfer import Station as Station

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
