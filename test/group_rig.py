"""Three simulated drives of a machine, and the group that leads them, in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import cos, pi, sin
from typing import Any

from testing.simulated_bus import SimulatedBus
from tri_glide_kinematics.drives import (
    DriveGroup,
    DriveSettings,
    DriveUnits,
    GroupSettings,
    GroupState,
    Setpoint,
    SimulatedDrive,
    Slider,
)

PERIOD = 0.002
LOWER, UPPER, ZONE = 0.3, 0.9, 0.02
NODES = (1, 2, 3)

# Homing in less time.
QUICK = {
    "homing_speed": 0.2,
    "homing_slow_speed": 0.05,
    "homing_acceleration": 4.0,
    "back_off": 0.05,
}


def settings(**changes: Any) -> GroupSettings:
    """Return settings of drives that count micrometres; the second one counts downwards."""
    drives = [
        DriveSettings(node, DriveUnits(1, 1, way), UPPER - ZONE, LOWER, UPPER)
        for node, way in zip(NODES, (1, -1, 1))
    ]
    group = GroupSettings((drives[0], drives[1], drives[2]), PERIOD)
    return replace(group, **changes)


class GroupRig:
    """Drives, their bus and their group."""

    def __init__(
        self, heights: Sequence[float] = (0.5, 0.5, 0.5), noise: float = 0.0, **changes: Any
    ) -> None:
        self.settings = settings(**changes)
        self.drives = []
        for drive, height in zip(self.settings.drives, heights):
            way = drive.units.direction
            slider = Slider(gravity=-9.81e6 * way, noise=noise)
            slider.upper, slider.lower = 600_000.0, 0.0
            self.drives.append(SimulatedDrive(drive.node, slider, self.count(height, way)))
        self.bus = SimulatedBus(self.drives)
        self.group = DriveGroup(self.bus, self.settings)
        self.now = 0.0

    @staticmethod
    def count(height: float, way: int) -> float:
        return 1e6 * (height - LOWER if way > 0 else UPPER - height)

    @property
    def true_heights(self) -> tuple[float, ...]:
        ways = (drive.units.direction for drive in self.settings.drives)
        places = (drive.axis.position * 1e-6 for drive in self.drives)
        return tuple(
            LOWER + place if way > 0 else UPPER - place for place, way in zip(places, ways)
        )

    def step(self) -> None:
        self.now += PERIOD
        self.bus.advance(self.now)
        self.group.step(self.now)

    def run(self, seconds: float) -> GroupRig:
        for _ in range(round(seconds / PERIOD)):
            self.step()
        return self

    def until(self, *states: GroupState, seconds: float = 30.0) -> GroupRig:
        """Go on to one of some states."""
        end = self.now + seconds
        while self.group.state not in states:
            assert self.now < end, (self.group.state, self.group.message)
            self.step()
        return self

    def until_true(self, happened: Callable[[], bool], seconds: float = 30.0) -> GroupRig:
        end = self.now + seconds
        while not happened():
            assert self.now < end, (self.group.state, self.group.message)
            self.step()
        return self

    def off(self) -> GroupRig:
        return self.until(GroupState.OFF)

    def on(self) -> GroupRig:
        self.off()
        self.group.enable(self.now)
        return self.until(GroupState.ON)

    def homed(self) -> GroupRig:
        self.off()
        self.group.home(self.now)
        return self.until(GroupState.ON, seconds=60.0)

    def swing(self, seconds: float, reach: float = 0.02, rate: float = 2.0) -> GroupRig:
        """Have setpoints sent that swing downwards from where the sliders are, and go on."""
        middle, began = self.group.heights, self.now
        assert middle is not None
        for _ in range(round(seconds / PERIOD)):
            turn = 2.0 * pi * rate * (self.now - began)
            ways = reach * (cos(turn) - 1.0), -reach * 2.0 * pi * rate * sin(turn)
            heights = tuple(each + ways[0] for each in middle)
            setpoint = Setpoint(self.now, heights, (ways[1], ways[1], ways[1]))  # type: ignore
            self.group.put(setpoint, self.now)
            self.step()
        return self
