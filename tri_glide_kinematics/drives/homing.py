"""What is watched while all three drives look for their switches."""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.drives.axis import Axis
from tri_glide_kinematics.drives.cia402 import HOMING_ATTAINED, HOMING_ERROR, TARGET_REACHED
from tri_glide_kinematics.drives.group_settings import GroupSettings

# So long a drive may go on telling that it has attained its home, of the time before [s].
STALE = 0.1

# A step so many times as long as it may be is no motion: the drive has begun to count anew.
NEW_COUNT = 3.0


class _Way:
    """The way of one slider since the start, up positive, whatever becomes of its counts."""

    def __init__(self, axis: Axis) -> None:
        self.axis = axis
        self.is_under_way = False
        self.now = self.highest = 0.0
        self._count = axis.positions[-1]

    def look(self, longest: float) -> None:
        """Take in the newest position; a step is ``longest`` [m] at the most."""
        units = self.axis.settings.units
        step = (self.axis.positions[-1] - self._count) * units.direction / float(units.per_metre)
        self._count = self.axis.positions[-1]
        if abs(step) <= longest:
            self.now += step
            self.highest = max(self.highest, self.now)


class Homing:
    """Three drives that have been told to look for their switches, all in the same cycle.

    Attributes:
        waiting: the axes that have not attained their homes.
    """

    def __init__(self, axes: Sequence[Axis], settings: GroupSettings, now: float) -> None:
        """Begin at ``now`` [s]."""
        self.waiting = list(axes)
        self._ways = {axis: _Way(axis) for axis in axes}
        self._settings = settings
        self._began = now
        # With what is lost in a row, and a count or two of noise.
        cycles = 1 + settings.lost_in_a_row
        self._longest = NEW_COUNT * settings.homing_speed * settings.period * cycles

    def look(self, now: float) -> None:
        """Take in what the drives have told.

        Raises:
            DriveError: if one of them fails, takes too long, or goes where no switch can be.
        """
        for axis in tuple(self.waiting):
            self._look_at(axis, now - self._began)
            done = HOMING_ATTAINED | TARGET_REACHED
            has_begun = self._ways[axis].is_under_way or now - self._began > STALE
            if has_begun and axis.status_word & done == done:
                self.waiting.remove(axis)

    def _look_at(self, axis: Axis, time: float) -> None:
        settings, drive, way = self._settings, axis.settings, self._ways[axis]
        if not axis.status_word & (HOMING_ATTAINED | HOMING_ERROR):
            way.is_under_way = True
        way.look(self._longest)
        if way.is_under_way and axis.status_word & HOMING_ERROR:
            raise axis.error("tells an error of homing")
        if time > settings.homing_timeout:
            raise axis.error(f"has not found its switch within {settings.homing_timeout:g} s")
        longest = drive.upper_height - drive.lower_height + settings.back_off
        if abs(way.now) > longest:
            raise axis.error(
                f"has gone {abs(way.now):.3f} m without finding its switch, at most {longest:.3f} "
                "m are its travel: does the switch work?"
            )
        if drive.homing_method is None and way.highest - way.now > settings.back_off:
            raise axis.error(
                f"went down {1e3 * (way.highest - way.now):.1f} mm in homing, at most "
                f"{1e3 * settings.back_off:g} mm leave a switch: does it stick?"
            )
