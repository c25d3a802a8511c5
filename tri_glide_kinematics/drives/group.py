"""Three drives that are led as one: set up, enabled, fed with targets, homed and stopped together.

It is told the time, and waits for nothing: what takes long is a procedure that goes on in each
cycle.
"""

from __future__ import annotations

from enum import Enum

from tri_glide_kinematics.drives.bus import Bus
from tri_glide_kinematics.drives.group_settings import GroupSettings
from tri_glide_kinematics.drives.playout import Setpoint


class GroupState(Enum):
    """What the three drives do together.

    Attributes:
        SILENT: they are not heard, or are being set up.
        OFF: they are ready, without torque.
        ENABLING: on the way to ON; nothing moves.
        ON: they have torque, and follow setpoints, or hold where none have come.
        BRAKING: on the way to rest: setpoints have ceased, or it was asked for.
        HOLDING: at rest, with torque. Setpoints are not followed: it takes an enabling.
        HOMING: they look for their switches.
        FAULT: they were told to stop quickly; ``message`` says why. It takes a reset.
        BUS_LOST: nothing can be sent, and nothing is sent. It takes a reset.
    """

    SILENT = "silent"
    OFF = "off"
    ENABLING = "enabling"
    ON = "on"
    BRAKING = "braking"
    HOLDING = "holding"
    HOMING = "homing"
    FAULT = "fault"
    BUS_LOST = "bus lost"


class DriveGroup:
    """Three drives on a bus.

    Attributes:
        state: what they do.
        message: why, for people; of a fault it names axis, error code (0x603F) and EMCY.
        heights: of the sliders [m]; None before homing, and where a drive is not heard.
        velocities: of the sliders [m/s], as measured; None with ``heights``.
        is_homed: whether all of them know their heights.
        waiting_axes: those that still look for their switches, 0 to 2.
        remarks: what was found while setting up and can be lived with.
        load: share of time for which the cycles use the bus.
        axes: what each axis is, for people.
        delay: momentary delay of the playing out [s].
    """

    def __init__(self, bus: Bus, settings: GroupSettings) -> None:
        """Listen first: nothing is sent before ``step`` has heard that nobody else leads.

        Args:
            bus: with the drives.
            settings: checked when they are made.
        """
        raise NotImplementedError

    def step(self, now: float) -> None:
        """Take in what has come, decide, and send heartbeat, commands and one SYNC.

        To be called once in each period. Nothing else sends heartbeat or SYNC, so who hangs is
        silent, and the drives stop by themselves. Raises nothing: a bus that is lost is a state.

        Args:
            now: time of a steady clock [s].
        """

    def put(self, setpoint: Setpoint, now: float) -> bool:
        """Store a setpoint. Returns whether it will be followed: only in ON, and if homed.

        Raises:
            KinematicsError: if it is not finite or its time goes back (``Playout.put``), or if it
                is the first after an enabling and lies farther from the held heights than
                ``start_distance``. Nothing moves for it.
        """

    def enable(self, now: float) -> None:
        """Begin to give torque where the sliders are: from OFF and HOLDING. Nothing moves.

        Raises:
            DriveError: in another state, but for ON and ENABLING.
        """

    def disable(self, now: float) -> None:
        """Bring the sliders to rest, then take the torque away; in FAULT it takes that away, too.

        Raises:
            DriveError: in SILENT and BUS_LOST.
        """

    def reset(self, now: float) -> None:
        """Set the drives up anew after FAULT or BUS_LOST, and reset their faults; never enables.

        Raises:
            DriveError: in another state.
        """

    def home(self, now: float) -> None:
        """Begin to look for the switches: from OFF, HOLDING and ON at rest. It ends in ON.

        Raises:
            DriveError: in another state.
        """

    def cancel_home(self, now: float) -> None:
        """Stop the homing: the sliders brake, and then it is HOLDING.

        Raises:
            DriveError: where no homing is under way.
        """
