"""Picking: parts in the frame of a belt, their order, and the cycle of pick and place. No ROS."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.picking.belt import BeltMotion as BeltMotion
    from tri_glide_kinematics.picking.belt import BeltState as BeltState
    from tri_glide_kinematics.picking.belt import BeltUnknownError as BeltUnknownError
    from tri_glide_kinematics.picking.order import CycleTimes as CycleTimes
    from tri_glide_kinematics.picking.order import Pick as Pick
    from tri_glide_kinematics.picking.order import PickOrder as PickOrder
    from tri_glide_kinematics.picking.order import WayTimes as WayTimes
    from tri_glide_kinematics.picking.parts import Part as Part
    from tri_glide_kinematics.picking.parts import PartEndedError as PartEndedError
    from tri_glide_kinematics.picking.parts import PartOutcome as PartOutcome
    from tri_glide_kinematics.picking.parts import Parts as Parts
    from tri_glide_kinematics.picking.parts import Sighting as Sighting
    from tri_glide_kinematics.picking.picker import GivingUp as GivingUp
    from tri_glide_kinematics.picking.picker import GripperClosedError as GripperClosedError
    from tri_glide_kinematics.picking.picker import Machine as Machine
    from tri_glide_kinematics.picking.picker import PartEvent as PartEvent
    from tri_glide_kinematics.picking.picker import Picker as Picker
    from tri_glide_kinematics.picking.picker import PickSettings as PickSettings
    from tri_glide_kinematics.picking.picker import Renewal as Renewal
    from tri_glide_kinematics.picking.picker import RunEnd as RunEnd
    from tri_glide_kinematics.picking.places import Places as Places
    from tri_glide_kinematics.picking.places import grid as grid
    from tri_glide_kinematics.picking.simulated import Readings as Readings
    from tri_glide_kinematics.picking.simulated import SimulatedBelt as SimulatedBelt
    from tri_glide_kinematics.picking.simulated import SimulatedCamera as SimulatedCamera
    from tri_glide_kinematics.picking.simulated import SimulatedEncoder as SimulatedEncoder
    from tri_glide_kinematics.picking.simulated import SimulatedGripper as SimulatedGripper
    from tri_glide_kinematics.picking.simulated import SimulatedPart as SimulatedPart
    from tri_glide_kinematics.picking.simulated import laid_parts as laid_parts
    from tri_glide_kinematics.picking.teaching import Lessons as Lessons
    from tri_glide_kinematics.picking.teaching import NotEnoughError as NotEnoughError
    from tri_glide_kinematics.picking.teaching import NotNowError as NotNowError
    from tri_glide_kinematics.picking.teaching import Observed as Observed
    from tri_glide_kinematics.picking.teaching import Scene as Scene
    from tri_glide_kinematics.picking.teaching import TaughtBelt as TaughtBelt
    from tri_glide_kinematics.picking.teaching import TaughtCamera as TaughtCamera
    from tri_glide_kinematics.picking.teaching import TaughtCell as TaughtCell
    from tri_glide_kinematics.picking.teaching import TeachingError as TeachingError
    from tri_glide_kinematics.picking.teaching import View as View
    from tri_glide_kinematics.picking.teaching import teach_belt as teach_belt
    from tri_glide_kinematics.picking.teaching import teach_camera as teach_camera
    from tri_glide_kinematics.picking.teaching import teach_gripper as teach_gripper
    from tri_glide_kinematics.picking.teaching import teach_latency as teach_latency

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
