"""What is watched while a drive looks for its switch."""

from __future__ import annotations

from tri_glide_kinematics.drives.axis import Axis
from tri_glide_kinematics.drives.cia402 import HOMING_ATTAINED, HOMING_ERROR, TARGET_REACHED

# So long a drive may go on telling that it has attained its home, of the time before [s].
STALE = 0.5

# What is so many times as fast as it may be is no motion: the drive has begun to count anew.
NEW_COUNT = 3.0


class Search:
    """A drive that has been told to look for its switch.

    Attributes:
        axis: with the drive.
    """

    def __init__(self, axis: Axis, now: float) -> None:
        """Begin at ``now`` [s]."""
        self.axis = axis
        self._began = now
        self._is_under_way = False
        self._count = axis.position
        # Since it began, up positive [m].
        self._way = self._highest = 0.0

    def has_ended(self, now: float) -> bool:
        """Take in what the drive has told, and return whether it has attained its home.

        Raises:
            DriveError: if it fails, takes too long, or goes where no switch can be.
        """
        axis, word, time = self.axis, self.axis.status_word, now - self._began
        group, drive = axis.group, axis.settings
        step = drive.units.direction * (axis.position - self._count) / axis.per_metre
        self._count = axis.position
        if axis.fastest <= NEW_COUNT * group.homing_speed:
            self._way += step
            self._highest = max(self._highest, self._way)
        self._is_under_way |= not word & (HOMING_ATTAINED | HOMING_ERROR) or time > STALE
        if self._is_under_way and word & HOMING_ERROR:
            raise axis.error("tells an error of homing")
        if self._is_under_way and word & HOMING_ATTAINED and word & TARGET_REACHED:
            return True
        if time > group.homing_timeout:
            raise axis.error(f"has not found its switch within {group.homing_timeout:g} s")
        travel = drive.ends[1] - drive.ends[0] + group.back_off
        if abs(self._way) > travel:
            text = f"has gone {abs(self._way):.3f} m, more than its travel of {travel:.3f} m"
            raise axis.error(f"{text}: does its switch work?")
        down = self._highest - self._way
        if drive.homing_method is None and down > group.back_off:
            text = f"went down {1e3 * down:.1f} mm, more than {1e3 * group.back_off:g} mm"
            raise axis.error(f"{text}: does its switch stick?")
        return False
