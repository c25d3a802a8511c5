"""What three drives are told: in each cycle the same kind of frames, and behind them one SYNC."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from tri_glide_kinematics.drives import cia402
from tri_glide_kinematics.drives.axis import Axis
from tri_glide_kinematics.drives.bus import OPERATIONAL, Bus, Command
from tri_glide_kinematics.drives.cia402 import DriveError
from tri_glide_kinematics.drives.group_settings import GroupSettings
from tri_glide_kinematics.vectors import Vector3

# Targets go no faster than so many times the largest speed.
JUMP = 1.6

# A quick stop takes no longer than from the largest speed to rest, and this [s].
REACTING = 0.1


class Orders:
    """What the drives are told from now on, until something else is.

    Attributes:
        axes: the drives; each has its own target.
        now: time of now [s].
        word: control word of each axis.
        is_enabled: whether the drives ought to have torque and follow their targets.
        rests_at: time at which they rest after a quick stop, at the latest [s].
        beats: whether heartbeats are sent.
        cycles: whether SYNC is sent.
        leads: whether control words and targets are sent.
    """

    def __init__(self, bus: Bus, settings: GroupSettings) -> None:
        """Send nothing yet."""
        self.axes = tuple(Axis(number, bus, settings) for number in (1, 2, 3))
        self.now = self.rests_at = self._beat_at = -inf
        self.word: Callable[[Axis], int] = lambda axis: cia402.QUICK_STOP
        self.is_enabled = False
        self.beats = self.cycles = self.leads = False
        self._bus = bus
        self._settings = settings

    def tell(self, word: int) -> None:
        """Tell all drives the same control word."""
        self.word = lambda axis: word

    def brake(self) -> None:
        """Have the drives brake; from then on targets are where they are."""
        self.tell(cia402.QUICK_STOP)
        for axis in self.axes:
            axis.target, axis.rate = None, 0
        self.is_enabled = False
        times = (drive.largest_speed / drive.brake for drive in self._settings.drives)
        self.rests_at = self.now + max(times) + REACTING

    def follow(self, heights: Vector3, velocities: Vector3) -> None:
        """Set the next targets. Shapes (3,) [m], (3,) [m/s].

        Raises:
            DriveError: if one is too far from the one before it.
        """
        for axis, height, velocity in zip(self.axes, heights, velocities):
            target, before = axis.count_of(height), axis.target
            step = abs(target - (target if before is None else before)) / axis.per_metre
            longest = JUMP * axis.settings.largest_speed * self._settings.period
            if step > longest + 1 / axis.per_metre:
                text = f"the target of {axis.name} jumps by {step:.6f} m in one period"
                raise DriveError(f"{text}, at most by {longest:.6f}")
            axis.target, axis.rate = target, axis.rate_of(velocity)

    def send(self) -> None:
        """Send heartbeat, commands and SYNC.

        Raises:
            BusError: if the bus is lost.
        """
        if self.beats and self.now >= self._beat_at:
            self._bus.send_heartbeat(OPERATIONAL)
            # Some may be late or lost.
            self._beat_at = self.now + self._settings.consumer_time / 4
        if self.cycles:
            self._bus.send_cycle([self._command(axis) for axis in self.axes if self.leads])

    def _command(self, axis: Axis) -> Command:
        target = axis.position if axis.target is None else axis.target
        rate = axis.rate if self._settings.sends_velocity else None
        return Command(axis.settings.node, self.word(axis), target, rate)
