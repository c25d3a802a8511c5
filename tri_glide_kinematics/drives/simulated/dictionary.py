"""The object dictionary of a simulated drive: what its EDS file says, with the codes of CiA 301."""

from __future__ import annotations

import re
from configparser import ConfigParser
from enum import IntEnum
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tri_glide_kinematics.drives.bus import Entry
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import find_file

EDS = "simulated_drive.eds"

Address = tuple[int, int]

# Values that a limit does not tell from others: of quick stops, modes, and methods of homing.
CHOICES = {(0x605A, 0): (0, 2, 6), (0x6060, 0): (0, 6, 8), (0x6098, 0): (0, 17, 18, 35, 37)}


class Abort(IntEnum):
    """Codes by which a transfer is refused (CiA 301)."""

    UNKNOWN_COMMAND = 0x05040001
    READ_ONLY = 0x06010002
    ABSENT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    WRONG_LENGTH = 0x06070010
    NOT_ALLOWED = 0x06090030
    TOO_HIGH = 0x06090031
    TOO_LOW = 0x06090032
    GENERAL = 0x08000000
    NOT_NOW = 0x08000022


class AbortError(KinematicsError):
    """A drive refuses a transfer.

    Attributes:
        code: of CiA 301.
    """

    def __init__(self, code: int) -> None:
        """Store the ``code``."""
        super().__init__(f"aborted with 0x{code:08X}")
        self.code = code


class Described(NamedTuple):
    """An entry as the EDS file describes it; numbers of sub-indices are entries, too."""

    entry: Entry
    is_writable: bool
    is_mappable: bool
    default: int
    low: int
    high: int

    def check(self, number: int) -> None:
        """Check what is to be written.

        Raises:
            AbortError: if it is not writable, or the ``number`` not allowed.
        """
        if not self.is_writable:
            raise AbortError(Abort.READ_ONLY)
        if not self.low <= number <= self.high:
            raise AbortError(Abort.TOO_LOW if number < self.low else Abort.TOO_HIGH)
        if number not in CHOICES.get((self.entry.index, self.entry.subindex), (number,)):
            raise AbortError(Abort.NOT_ALLOWED)


@cache
def described(node: int) -> dict[Address, Described]:
    """Return all entries of the drive with the number ``node``."""
    parser = ConfigParser(interpolation=None)
    parser.read_string(find_file(Path(EDS)).read_text(encoding="ascii"))
    found = {}
    for name in parser.sections():
        place = re.fullmatch(r"([0-9A-F]{4})(?:sub([0-9A-F]))?", name)
        values = parser[name]
        if place is None or "DataType" not in values:
            continue
        # Types 2 to 4 are numbers with a sign, 5 to 7 without, of 8, 16 and 32 bits.
        kind = int(values["DataType"], 0)
        size, is_signed = 1 << (kind - 2) % 3, kind < 5
        entry = Entry(int(place[1], 16), int(place[2] or "0", 16), size, is_signed)
        _, _, default = values["DefaultValue"].rpartition("$NODEID+")
        lowest = -(1 << 8 * size - 1) if is_signed else 0
        number = int(default, 0) + (node if "$NODEID" in values["DefaultValue"] else 0)
        low = int(values.get("LowLimit", str(lowest)), 0)
        high = int(values.get("HighLimit", str(lowest + (1 << 8 * size) - 1)), 0)
        is_writable, is_mappable = "w" in values["AccessType"], values["PDOMapping"] == "1"
        found[entry.index, entry.subindex] = Described(
            entry, is_writable, is_mappable, number, low, high
        )
    return found
