"""Words and states of a drive by CiA 402 (IEC 61800-7-201)."""

from __future__ import annotations

from enum import IntEnum

from tri_glide_kinematics.drives.bus import Entry
from tri_glide_kinematics.errors import KinematicsError


class DriveError(KinematicsError):
    """A drive does not do what it is asked for, or cannot: the text says which, and numbers."""

    def __init__(self, text: str, axis: int | None = None) -> None:
        """Store what is wrong, and the number of the ``axis`` from 1, if it is one."""
        super().__init__(text)
        self.axis = axis


class DriveState(IntEnum):
    """States of the state machine of a drive; the numbers are what a status word says of them."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08

    @property
    def text(self) -> str:
        """What CiA 402 calls it."""
        return self.name.replace("_", " ")


FAULTS = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)

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

_STATES = {state.value: state for state in DriveState}


def state_of(status_word: int) -> DriveState | None:
    """Return the state that a status word tells; None for a pattern that is no state."""
    # Other bits may have any value, and in some states that of the quick stop, too.
    return _STATES.get(status_word & 0x6F, _STATES.get(status_word & 0x4F))
