"""Control: what a machine's controller decides, without ROS and without a clock.

A ``controller`` is made of the ``operation`` of a machine, a ``commanded_motion`` and a
``command_queue``.
For other rooms: ``controller``, ``status`` and ``operating_state``; ``supervision`` and
``newest_target`` for its bounds; ``health`` for what a node says about itself.
"""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.control.command_queue import CYCLES_UNTIL_TOLD as CYCLES_UNTIL_TOLD
    from tri_glide_kinematics.control.command_queue import CommandQueue as CommandQueue
    from tri_glide_kinematics.control.commanded_motion import TEACH_SPEED as TEACH_SPEED
    from tri_glide_kinematics.control.commanded_motion import in_teach_mode as in_teach_mode
    from tri_glide_kinematics.control.controller import MotionController as MotionController
    from tri_glide_kinematics.control.feed_forward import FeedForward as FeedForward
    from tri_glide_kinematics.control.health import Health as Health
    from tri_glide_kinematics.control.health import Level as Level
    from tri_glide_kinematics.control.health import LoopStatistics as LoopStatistics
    from tri_glide_kinematics.control.health import delay_counts as delay_counts
    from tri_glide_kinematics.control.health import health_of as health_of
    from tri_glide_kinematics.control.health import line_of as line_of
    from tri_glide_kinematics.control.health import status_of as status_of
    from tri_glide_kinematics.control.newest_target import CAUSE_OF as CAUSE_OF
    from tri_glide_kinematics.control.newest_target import Arrival as Arrival
    from tri_glide_kinematics.control.newest_target import InPosition as InPosition
    from tri_glide_kinematics.control.newest_target import InPositionBounds as InPositionBounds
    from tri_glide_kinematics.control.newest_target import NewestTarget as NewestTarget
    from tri_glide_kinematics.control.nominal_time import NominalTime as NominalTime
    from tri_glide_kinematics.control.operating_state import DISABLED as DISABLED
    from tri_glide_kinematics.control.operating_state import FAULT as FAULT
    from tri_glide_kinematics.control.operating_state import FOLLOWERS as FOLLOWERS
    from tri_glide_kinematics.control.operating_state import IDLE as IDLE
    from tri_glide_kinematics.control.operating_state import IN_MOTION as IN_MOTION
    from tri_glide_kinematics.control.operating_state import JOGGING as JOGGING
    from tri_glide_kinematics.control.operating_state import MOVING as MOVING
    from tri_glide_kinematics.control.operating_state import PAUSED as PAUSED
    from tri_glide_kinematics.control.operating_state import STOPPING as STOPPING
    from tri_glide_kinematics.control.operating_state import TRACKING as TRACKING
    from tri_glide_kinematics.control.operating_state import WAITING as WAITING
    from tri_glide_kinematics.control.operating_state import WAS_STOPPED as WAS_STOPPED
    from tri_glide_kinematics.control.operating_state import Cause as Cause
    from tri_glide_kinematics.control.operating_state import (
        CommandRefusedError as CommandRefusedError,
    )
    from tri_glide_kinematics.control.operating_state import ControllerStatus as ControllerStatus
    from tri_glide_kinematics.control.operating_state import (
        ForbiddenTransitionError as ForbiddenTransitionError,
    )
    from tri_glide_kinematics.control.operating_state import MotionProgress as MotionProgress
    from tri_glide_kinematics.control.operating_state import OperatingState as OperatingState
    from tri_glide_kinematics.control.operating_state import Reason as Reason
    from tri_glide_kinematics.control.operating_state import StateMachine as StateMachine
    from tri_glide_kinematics.control.operation import TRAVEL_TOLERANCE as TRAVEL_TOLERANCE
    from tri_glide_kinematics.control.operation import BrokenError as BrokenError
    from tri_glide_kinematics.control.operation import StartingPlace as StartingPlace
    from tri_glide_kinematics.control.supervision import LEAST_PAUSE as LEAST_PAUSE
    from tri_glide_kinematics.control.supervision import SILENT_CYCLES as SILENT_CYCLES
    from tri_glide_kinematics.control.supervision import SLOWEST_STREAM as SLOWEST_STREAM
    from tri_glide_kinematics.control.supervision import ProgramRuns as ProgramRuns
    from tri_glide_kinematics.control.supervision import Streams as Streams
    from tri_glide_kinematics.control.supervision import SupervisionBounds as SupervisionBounds
    from tri_glide_kinematics.control.supervision import Supervisor as Supervisor
    from tri_glide_kinematics.control.supervision import ToldRun as ToldRun
    from tri_glide_kinematics.control.underway import Underway as Underway

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
