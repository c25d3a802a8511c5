"""How much of a CAN bus the cycles of the drives take."""

from __future__ import annotations

from tri_glide_kinematics.drives.bus import BusError
from tri_glide_kinematics.wording import number_text

# Above this it is told, above that refused: what is left is for heartbeats, messages of faults,
# transfers, and frames that are repeated.
LARGEST_GOOD_LOAD = 0.6
LARGEST_LOAD = 0.8


class BusTooSlowError(BusError):
    """The cycles of the drives do not fit into the bus."""

    def __init__(self, load: float, bitrate: int, period: float) -> None:
        """Store the ``load`` at a ``bitrate`` [bit/s] and a ``period`` [s]."""
        super().__init__(
            f"the bus of {bitrate} bit/s is in use for {100 * load:.0f} % of the time with a "
            f"period of {number_text(1e3 * period)} ms; "
            f"at most {100 * LARGEST_LOAD:.0f} % is allowed"
        )
        self.load = load


def frame_bits(data_bytes: int) -> int:
    """Return the longest that a frame with an identifier of 11 bits can be, with its gap [bits].

    Stuffed bits come after each fifth equal bit, the last of them the first of the next five; 34
    bits besides the data are stuffed, 13 are not (ISO 11898-1).
    """
    stuffed = 34 + 8 * data_bytes
    return stuffed + 13 + (stuffed - 1) // 4


def bus_load(bitrate: int, period: float, sends_velocity: bool = False) -> float:
    """Return the share of time for which SYNC and PDOs of three drives use the bus, at the most.

    Args:
        bitrate: of the bus [bit/s].
        period: from one SYNC to the next [s].
        sends_velocity: whether a second PDO goes to each drive.
    """
    of_drive = 2 * frame_bits(6) + (frame_bits(4) if sends_velocity else 0)
    return (3 * of_drive + frame_bits(0)) / (bitrate * period)
