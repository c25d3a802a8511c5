"""Drives on a bus: their states, units, playing out and homing. No ROS; one seam to the bus."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.drives.bus import BusError as BusError
    from tri_glide_kinematics.drives.bus import Command as Command
    from tri_glide_kinematics.drives.bus import Emergency as Emergency
    from tri_glide_kinematics.drives.bus import Entry as Entry
    from tri_glide_kinematics.drives.bus import Event as Event
    from tri_glide_kinematics.drives.bus import Foreign as Foreign
    from tri_glide_kinematics.drives.bus import Heartbeat as Heartbeat
    from tri_glide_kinematics.drives.bus import Status as Status
    from tri_glide_kinematics.drives.bus import Transfer as Transfer
    from tri_glide_kinematics.drives.can_bus import CanBus as CanBus
    from tri_glide_kinematics.drives.cia402 import DriveError as DriveError
    from tri_glide_kinematics.drives.cia402 import DriveState as DriveState
    from tri_glide_kinematics.drives.cia402 import state_of as state_of
    from tri_glide_kinematics.drives.frames import CobId as CobId
    from tri_glide_kinematics.drives.frames import Frame as Frame
    from tri_glide_kinematics.drives.frames import LineReader as LineReader
    from tri_glide_kinematics.drives.frames import cycle_frames as cycle_frames
    from tri_glide_kinematics.drives.frames import encoded as encoded
    from tri_glide_kinematics.drives.frames import event_of as event_of
    from tri_glide_kinematics.drives.group import DriveGroup as DriveGroup
    from tri_glide_kinematics.drives.group import GroupState as GroupState
    from tri_glide_kinematics.drives.group_settings import DriveSettings as DriveSettings
    from tri_glide_kinematics.drives.group_settings import DriveUnits as DriveUnits
    from tri_glide_kinematics.drives.group_settings import GroupSettings as GroupSettings
    from tri_glide_kinematics.drives.group_settings import bus_load as bus_load
    from tri_glide_kinematics.drives.playout import Playout as Playout
    from tri_glide_kinematics.drives.playout import Setpoint as Setpoint
    from tri_glide_kinematics.drives.playout import SetpointRefusedError as SetpointRefusedError
    from tri_glide_kinematics.drives.simulated.axis import Slider as Slider
    from tri_glide_kinematics.drives.simulated.axis import Switch as Switch
    from tri_glide_kinematics.drives.simulated.dictionary import AbortError as AbortError
    from tri_glide_kinematics.drives.simulated.dictionary import described as described
    from tri_glide_kinematics.drives.simulated.drive import SimulatedDrive as SimulatedDrive
    from tri_glide_kinematics.drives.simulated.terminals import Terminals as Terminals

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
