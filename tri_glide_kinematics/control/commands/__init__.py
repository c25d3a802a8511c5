"""What the controller was asked for, and what becomes of it."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.control.commands.engine_commands import CarriedOut as CarriedOut
    from tri_glide_kinematics.control.commands.engine_commands import (
        EngineCommands as EngineCommands,
    )
    from tri_glide_kinematics.control.commands.goals import GRACE as GRACE
    from tri_glide_kinematics.control.commands.goals import Goal as Goal
    from tri_glide_kinematics.control.commands.goals import GoalCode as GoalCode
    from tri_glide_kinematics.control.commands.goals import Goals as Goals
    from tri_glide_kinematics.control.commands.goals import Outcome as Outcome
    from tri_glide_kinematics.control.commands.inbox import COMMAND_INTERVAL as COMMAND_INTERVAL
    from tri_glide_kinematics.control.commands.inbox import Inbox as Inbox
    from tri_glide_kinematics.control.commands.inbox import Kind as Kind
    from tri_glide_kinematics.control.commands.inbox import NewLimits as NewLimits
    from tri_glide_kinematics.control.commands.inbox import Target as Target
    from tri_glide_kinematics.control.commands.inbox import TargetKind as TargetKind
    from tri_glide_kinematics.control.commands.inbox import TargetPath as TargetPath
    from tri_glide_kinematics.control.commands.inbox import TargetPosition as TargetPosition
    from tri_glide_kinematics.control.commands.inbox import TargetVelocity as TargetVelocity
    from tri_glide_kinematics.control.commands.inbox import TrackedTarget as TrackedTarget
    from tri_glide_kinematics.control.commands.newest_target import CAUSE_OF as CAUSE_OF
    from tri_glide_kinematics.control.commands.newest_target import NewestTarget as NewestTarget
    from tri_glide_kinematics.control.commands.streams import SLOWEST_STREAM as SLOWEST_STREAM
    from tri_glide_kinematics.control.commands.streams import Streams as Streams
    from tri_glide_kinematics.control.commands.streams import twist_stream as twist_stream

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
