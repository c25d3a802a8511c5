"""The stamps of setpoints: nominal times, which tell a lost setpoint from a late one."""

from __future__ import annotations

from tri_glide_kinematics.vectors import Vector3

# Stamps that are behind the clock catch up by this part of a period with each setpoint in motion:
# so little that the number of setpoints between two stamps stays known.
CATCH_UP = 16


class NominalTime:
    """Gives each setpoint the stamp of the one before it and a period more, however late it is.

    The motion goes on later after a late cycle, and so would the stamps fall behind the clock. They
    follow it at once at rest, where the time between setpoints means nothing, and by up to a
    sixteenth of a period with each setpoint in motion. So between two setpoints in motion, the
    difference of the stamps over the period, rounded down, is how many setpoints came, as long as
    it is below 16. A clock that is set is followed at rest, too; in motion no stamp goes back.
    """

    def __init__(self, period: float) -> None:
        """Expect a setpoint each ``period`` [s]."""
        self._period = round(1e9 * period)
        self._last: int | None = None
        self._rested = False

    def stamp(self, velocities: Vector3, now: int) -> int:
        """Return the stamp of the next setpoint; call it once for each.

        Args:
            velocities: of the sliders, exactly zero at rest. Shape (3,) [m/s].
            now: time of the clock [ns].
        """
        rests = not any(velocities)
        stamp = now if self._last is None else self._last + self._period
        behind = now - stamp
        if rests and self._rested and abs(behind) > self._period:
            stamp = now
        elif behind > self._period:
            stamp += self._period // CATCH_UP
        self._last, self._rested = stamp, rests
        return stamp
