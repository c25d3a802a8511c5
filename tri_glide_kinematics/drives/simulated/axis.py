"""The axis of a simulated drive: state machine and motion by CiA 402, and the slider that it moves.

All ways are in counts of the encoder, up or down as the drive counts. Where nothing else is said,
``position`` is the one of the slider, from a point that only the simulation knows.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from enum import Enum
from math import copysign, sqrt

from tri_glide_kinematics.drives.cia402 import DriveState, Mode
from tri_glide_kinematics.drives.simulated.dictionary import Address

# Methods of homing that look for a switch: the way to it.
TOWARDS_SWITCH = {17: -1, 18: 1}

FOLLOWING_ERROR, HEARTBEAT_LOST = 0x8611, 0x8130


WITH_TORQUE = (
    DriveState.OPERATION_ENABLED,
    DriveState.QUICK_STOP_ACTIVE,
    DriveState.FAULT_REACTION_ACTIVE,
)


class Switch(Enum):
    """How the limit switches are: in order, always active, never active."""

    WORKS = "works"
    STICKS = "sticks"
    NEVER = "never"


@dataclass
class Slider:
    """The slider of a drive; all numbers in counts and seconds.

    Attributes:
        lower: where it is stopped, by the way the drive counts.
        upper: where it is stopped at the other end.
        switch_zone: how far from either end its limit switch is active.
        strength: greatest acceleration.
        gravity: acceleration where nothing holds it; 0 where it does not fall.
        has_brake: whether the drive's brake holds it while there is no torque.
        noise: standard deviation of the encoder.
        switch: how the limit switches are.
        extrapolation: for how long its drive goes on as it did where no SYNC comes [s]. CiA 402
            leaves this open, and drives differ.
    """

    lower: float = 0.0
    upper: float = 600_000.0
    switch_zone: float = 20_000.0
    strength: float = 50_000_000.0
    gravity: float = -9_810_000.0
    has_brake: bool = True
    noise: float = 0.0
    switch: Switch = Switch.WORKS
    extrapolation: float = 0.05

    def edge(self, way: int) -> float:
        """Return where the switch at the end of a ``way`` (1 or -1) begins."""
        return self.upper - self.switch_zone if way > 0 else self.lower + self.switch_zone

    def is_on_switch(self, way: int, position: float) -> bool:
        """Tell whether the switch at the end of a ``way`` (1 or -1) is active."""
        if self.switch is not Switch.WORKS:
            return self.switch is Switch.STICKS
        return way * (position - self.edge(way)) >= 0.0


class SimulatedAxis:
    """DriveState machine, modes and motion.

    Attributes:
        slider: that it moves.
        position: of the slider.
        velocity: of the slider.
        state: by CiA 402.
        errors: codes of errors that nobody has been told yet; 0 where they have gone.
    """

    def __init__(self, objects: dict[Address, int], slider: Slider, position: float) -> None:
        """Begin without torque, counting from where the slider is.

        Args:
            objects: values of the object dictionary, which others read and write, too.
            slider: that it moves.
            position: of the slider.
        """
        self.slider = slider
        self.position = position
        self.velocity = 0.0
        self.state = DriveState.SWITCH_ON_DISABLED
        self.errors: list[int] = []
        self._objects = objects
        # Position of the slider where the drive counts 0.
        self._zero = round(position)
        self._random = random.Random(1)
        self._word = 0
        # The state that follows when a braking has ended.
        self._next: DriveState | None = None
        self._demand = position
        self._rate = 0.0
        # How much time is left for the way to the target; less than 0 behind it.
        self._time_left = 0.0
        self._phase = ""
        self._is_homed = self._homing_failed = False

    @property
    def holds(self) -> bool:
        """Whether torque or a brake holds the slider."""
        return self.state in WITH_TORQUE or self.slider.has_brake

    @property
    def has_fault(self) -> bool:
        """Whether it takes a reset to go on."""
        return self.state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)

    def command(self, word: int) -> None:
        """Take in a control word."""
        rising, self._word = word & ~self._word, word
        state, enabled = self.state, DriveState.OPERATION_ENABLED
        if state is DriveState.FAULT:
            if rising & 0x80:
                self.clear()
                self._go(DriveState.SWITCH_ON_DISABLED)
        elif word & 0x80 or state is DriveState.FAULT_REACTION_ACTIVE:
            pass
        elif not word & 0x02:
            self._go(DriveState.SWITCH_ON_DISABLED)
        elif not word & 0x04:
            self._quick_stop()
        elif not word & 0x01:
            if state is enabled and self._objects[0x605B, 0] == 1:
                self._next = DriveState.READY_TO_SWITCH_ON
            elif state is not DriveState.QUICK_STOP_ACTIVE:
                self._go(DriveState.READY_TO_SWITCH_ON)
        elif state is DriveState.READY_TO_SWITCH_ON:
            self._go(DriveState.SWITCHED_ON)
        elif word & 0x08:
            may = state is DriveState.QUICK_STOP_ACTIVE and self._objects[0x605A, 0] == 6
            if state is DriveState.SWITCHED_ON or may:
                self._go(enabled)
            self._next = None
            if rising & 0x10 and self._objects[0x6061, 0] == Mode.HOMING:
                self._begin_homing()
        elif state is enabled:
            self._next = DriveState.SWITCHED_ON
            if self._objects[0x605C, 0] == 0:
                self._go(DriveState.SWITCHED_ON)

    def latch(self) -> None:
        """Take in the target at a SYNC: the way to it takes the interpolation time."""
        value, power = self._objects[0x60C2, 1], self._objects[0x60C2, 2]
        self._time_left = value * 10.0**power

    def fail(self, code: int) -> None:
        """Have an error with a ``code``, and do what 0x605E says."""
        self.tell(code)
        if self.state in WITH_TORQUE and self._objects[0x605E, 0] != 0:
            self._brake(DriveState.FAULT_REACTION_ACTIVE)
        else:
            self._go(DriveState.FAULT)

    def clear(self) -> None:
        """Tell that the errors have gone."""
        self._objects[0x603F, 0] = self._objects[0x1001, 0] = 0
        self.errors.append(0)

    def lose_connection(self) -> None:
        """Do what 0x6007 says of a connection that is lost."""
        option = self._objects[0x6007, 0]
        if option == 1:
            self.fail(HEARTBEAT_LOST)
        elif option == 2 and self.state in (*WITH_TORQUE, DriveState.SWITCHED_ON):
            self._go(DriveState.SWITCH_ON_DISABLED)
        elif option == 3:
            self._quick_stop()

    def drop_out(self) -> None:
        """Let go without an error, as where a safety relay opens."""
        self._go(DriveState.SWITCH_ON_DISABLED)

    def refresh(self) -> None:
        """Write what the drive tells of itself into the object dictionary."""
        noise = self._random.gauss(0.0, self.slider.noise) if self.slider.noise else 0.0
        objects = self._objects
        objects[0x6064, 0] = round(self.position + noise) - self._zero
        word = self.state | 0x210
        mode = objects[0x6061, 0]
        if mode == Mode.HOMING:
            done = not self._phase and self._rate == 0.0
            word |= 0x400 * done | 0x1000 * (self._is_homed and done) | 0x2000 * self._homing_failed
        elif mode == Mode.POSITION and self.state is DriveState.OPERATION_ENABLED:
            word |= 0x1000
        objects[0x6041, 0] = word

    def step(self, dt: float) -> None:
        """Move for ``dt`` [s], a millisecond or less."""
        self._objects[0x6061, 0] = self._objects[0x6060, 0]
        slider, before = self.slider, self._demand
        if self.state not in WITH_TORQUE:
            self.velocity = 0.0 if slider.has_brake else self.velocity + slider.gravity * dt
            self._demand, self._rate, self._phase = self.position, 0.0, ""
        else:
            self._lead(dt)
            error = before - self.position
            # Not faster than it can brake again.
            back = min(abs(error) / dt, sqrt(2.0 * slider.strength * abs(error)))
            wanted = (self._demand - before) / dt + copysign(back, error)
            self.velocity = _towards(self.velocity, wanted, slider.strength * dt)
        moved = self.position + self.velocity * dt
        self.position = min(max(moved, slider.lower), slider.upper)
        if self.position != moved:
            self.velocity = 0.0
        window = self._objects[0x6065, 0]
        is_off = abs(self._demand - self.position) > window
        if is_off and window != 0xFFFFFFFF and self.state is DriveState.OPERATION_ENABLED:
            self.fail(FOLLOWING_ERROR)

    def _lead(self, dt: float) -> None:
        """Move what the slider follows."""
        if self.state is not DriveState.OPERATION_ENABLED or self._next is not None:
            is_slow = self.state is DriveState.OPERATION_ENABLED
            self._ramp(0.0, self._objects[0x6084 if is_slow else 0x6085, 0], dt)
            if self._rate == 0.0 and self._next is not None:
                self._go(self._next)
        elif self._objects[0x6061, 0] == Mode.HOMING:
            self._home(dt)
        elif self._objects[0x6061, 0] == Mode.POSITION:
            if self._time_left > 0.0:
                way = self._target() - self._demand
                self._rate = way / max(self._time_left, dt)
            elif self._time_left < -self.slider.extrapolation:
                self._rate = 0.0
            self._time_left -= dt
            self._demand += self._rate * dt
        else:
            self._ramp(0.0, self._objects[0x6084, 0], dt)

    def _target(self) -> float:
        """Return the target, inside the limits of the software where they have a meaning."""
        target = self._objects[0x607A, 0]
        if self._is_homed:
            target = max(target, self._objects[0x607D, 1])
            target = min(target, self._objects[0x607D, 2])
        return target + self._zero

    def _ramp(self, rate: float, acceleration: float, dt: float) -> None:
        self._rate = _towards(self._rate, rate, acceleration * dt)
        self._demand += self._rate * dt

    def _begin_homing(self) -> None:
        method = self._objects[0x6098, 0]
        self._homing_failed = method == 0
        self._is_homed = False
        self._phase = "seek" if method in TOWARDS_SWITCH else "stop"
        if method in (35, 37):
            self._zero, self._is_homed = round(self.position) - self._objects[0x607C, 0], True

    def _home(self, dt: float) -> None:
        """Go to the switch, then off it slowly: where it lets go, the drive counts from."""
        way = TOWARDS_SWITCH.get(self._objects[0x6098, 0], 1)
        is_on = self.slider.is_on_switch(way, self.position)
        if self._word & 0x110 != 0x10:
            self._phase = ""
        elif self._phase == "seek" and is_on:
            self._phase = "leave"
        elif self._phase == "leave" and not is_on:
            self._phase, self._is_homed = "stop", True
            self._zero = round(self.slider.edge(way)) - self._objects[0x607C, 0]
        elif self._phase == "stop" and self._rate == 0.0:
            self._phase = ""
        seek, leave = self._objects[0x6099, 1], self._objects[0x6099, 2]
        rate = {"seek": way * seek, "leave": -way * leave}.get(self._phase, 0)
        self._ramp(rate, self._objects[0x609A, 0], dt)

    def _quick_stop(self) -> None:
        if self.state is DriveState.OPERATION_ENABLED and self._objects[0x605A, 0] != 0:
            self._brake(DriveState.QUICK_STOP_ACTIVE)
        elif self.state is not DriveState.QUICK_STOP_ACTIVE and not self.has_fault:
            self._go(DriveState.SWITCH_ON_DISABLED)

    def _brake(self, state: DriveState) -> None:
        """Brake in a ``state`` that ends by itself, or does not."""
        self._go(state)
        self._demand, self._rate = self.position, self.velocity
        if state is DriveState.FAULT_REACTION_ACTIVE:
            self._next = DriveState.FAULT
        elif self._objects[0x605A, 0] == 2:
            self._next = DriveState.SWITCH_ON_DISABLED

    def _go(self, state: DriveState) -> None:
        if state is DriveState.OPERATION_ENABLED:
            self._demand, self._rate, self._time_left = self.position, 0.0, 0.0
        self._next, self.state = None, state

    def tell(self, code: int) -> None:
        """Tell an error with a ``code``, and do nothing."""
        self._objects[0x603F, 0] = code
        self._objects[0x1001, 0] |= 1 if code != HEARTBEAT_LOST else 0x11
        self.errors.append(code)


def _towards(value: float, wanted: float, most: float) -> float:
    """Return ``value``, moved towards what is ``wanted`` by at most that much."""
    return value + min(max(wanted - value, -most), most)
