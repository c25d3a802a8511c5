"""Words and states of a drive by CiA 402 (IEC 61800-7-201)."""

from __future__ import annotations

from enum import Enum, IntEnum

from tri_glide_kinematics.drives.bus import Entry
from tri_glide_kinematics.errors import KinematicsError


class DriveError(KinematicsError):
    """A drive does not do what it is asked for; the text names the axis, object and numbers."""

    def __init__(self, text: str, axis: int | None = None) -> None:
        """Store what is wrong, and the number of the ``axis`` from 1, if it is one."""
        super().__init__(text)
        self.axis = axis


class DriveState(Enum):
    """States of the state machine of a drive."""

    NOT_READY = "NOT READY TO SWITCH ON"
    SWITCH_ON_DISABLED = "SWITCH ON DISABLED"
    READY = "READY TO SWITCH ON"
    SWITCHED_ON = "SWITCHED ON"
    OPERATION_ENABLED = "OPERATION ENABLED"
    QUICK_STOP = "QUICK STOP ACTIVE"
    FAULT_REACTION = "FAULT REACTION ACTIVE"
    FAULT = "FAULT"


FAULTS = (DriveState.FAULT, DriveState.FAULT_REACTION)

CONTROL_WORD = Entry(0x6040, 0, 2)
STATUS_WORD = Entry(0x6041, 0, 2)
ERROR_CODE = Entry(0x603F, 0, 2)
MODE = Entry(0x6060, 0, 1, is_signed=True)
MODE_SHOWN = Entry(0x6061, 0, 1, is_signed=True)


class Mode(IntEnum):
    """Modes of operation that are used: object 0x6060."""

    HOMING = 6
    POSITION = 8


# Control words (object 0x6040).
DISABLE_VOLTAGE = 0x00
QUICK_STOP = 0x02
SHUTDOWN = 0x06
SWITCH_ON = 0x07
ENABLE_OPERATION = 0x0F
START_HOMING = 0x1F
RESET_FAULT = 0x80

# Bits of the status word (object 0x6041) in the mode for homing.
TARGET_REACHED = 1 << 10
HOMING_ATTAINED = 1 << 12
HOMING_ERROR = 1 << 13

# All other bits may have any value: some belong to the maker of the drive.
_SEVEN_STATES = {
    0x21: DriveState.READY,
    0x23: DriveState.SWITCHED_ON,
    0x27: DriveState.OPERATION_ENABLED,
    0x07: DriveState.QUICK_STOP,
}
_OTHER_STATES = {
    0x00: DriveState.NOT_READY,
    0x40: DriveState.SWITCH_ON_DISABLED,
    0x0F: DriveState.FAULT_REACTION,
    0x08: DriveState.FAULT,
}

# What leads on towards SWITCHED ON, from each state from which something does.
_TOWARDS_SWITCHED_ON = {
    DriveState.QUICK_STOP: DISABLE_VOLTAGE,
    DriveState.SWITCH_ON_DISABLED: SHUTDOWN,
    DriveState.READY: SWITCH_ON,
    DriveState.SWITCHED_ON: SWITCH_ON,
    DriveState.OPERATION_ENABLED: SWITCH_ON,
}


def state_of(status_word: int) -> DriveState | None:
    """Return the state that a status word tells; None for a pattern that is no state."""
    state = _SEVEN_STATES.get(status_word & 0x6F)
    return state or _OTHER_STATES.get(status_word & 0x4F)


def word_towards_switched_on(state: DriveState | None) -> int:
    """Return the control word that leads a drive to SWITCHED ON, and no farther."""
    return DISABLE_VOLTAGE if state is None else _TOWARDS_SWITCHED_ON.get(state, DISABLE_VOLTAGE)
