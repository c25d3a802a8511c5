"""Three drives that are led as one: set up, enabled, fed with targets, homed and stopped together.

It is told the time, and waits for nothing: what takes long is a procedure that goes on in each
cycle.
"""

from __future__ import annotations

from enum import Enum

from tri_glide_kinematics.drives.axis import Axis, Steps
from tri_glide_kinematics.drives.bus import Bus, BusError, Event, Foreign
from tri_glide_kinematics.drives.cia402 import DriveError
from tri_glide_kinematics.drives.group_settings import GroupSettings
from tri_glide_kinematics.drives.orders import JUMP, Orders
from tri_glide_kinematics.drives.playout import Playout, Setpoint
from tri_glide_kinematics.drives.procedures import Procedures
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.vectors import Vector3, three


class GroupState(Enum):
    """What the three drives do together.

    Attributes:
        SILENT: they are not heard, or are being set up.
        OFF: they are ready, without torque.
        ENABLING: on the way to ON; nothing moves.
        ON: they have torque, and follow setpoints, or hold where none have come.
        BRAKING: on the way to rest: setpoints have ceased, or it was asked for.
        HOLDING: at rest, with torque. Setpoints are not followed: it takes an enabling.
        HOMING: they look for their switches.
        FAULT: they were told to stop quickly; ``message`` says why. It takes a reset.
        BUS_LOST: nothing can be sent, and nothing is sent. It takes a reset.
    """

    SILENT = "silent"
    OFF = "off"
    ENABLING = "enabling"
    ON = "on"
    BRAKING = "braking"
    HOLDING = "holding"
    HOMING = "homing"
    FAULT = "fault"
    BUS_LOST = "bus lost"


_WITHOUT_HEIGHTS = (GroupState.SILENT, GroupState.HOMING, GroupState.FAULT, GroupState.BUS_LOST)


class DriveGroup:
    """Three drives on a bus.

    Attributes:
        state: what they do.
        load: share of time for which the cycles use the bus.
    """

    def __init__(self, bus: Bus, settings: GroupSettings) -> None:
        """Send nothing before ``step`` has heard for a while that nobody else leads.

        Args:
            bus: with the drives.
            settings: checked when they are made.
        """
        self.load = settings.load
        self._bus = bus
        self._settings = settings
        self._orders = Orders(bus, settings)
        self._axes = self._orders.axes
        self._procedures = Procedures(self._orders, settings)
        brake = three(drive.brake for drive in settings.drives)
        self._playout = Playout(settings.playout_delay, settings.period, brake)
        # What goes on, and the state that it leads to.
        self.state = self._next = GroupState.SILENT
        self._task: Steps | None = None
        # Whether a reset was asked for, that is still under way.
        self._resets = False
        self._enter(GroupState.SILENT, self._procedures.set_up(False), GroupState.OFF)

    @property
    def message(self) -> str:
        """Why it is as it is, for people; of a fault it names axis, error code and EMCY."""
        if self._culprit is not None:
            return f"{self._cause} [{self._culprit.text}]"
        return self._procedures.progress if self.state is GroupState.SILENT else self._cause

    @property
    def remarks(self) -> list[str]:
        """What was found while setting up and can be lived with."""
        return self._procedures.remarks

    @property
    def axes(self) -> tuple[str, ...]:
        """What each axis is, for people."""
        return tuple(axis.text for axis in self._axes)

    @property
    def counts(self) -> tuple[int | None, ...]:
        """What each drive counts; None where it has told nothing yet."""
        return tuple(axis.positions[-1] if axis.positions else None for axis in self._axes)

    @property
    def is_homed(self) -> bool:
        """Whether all drives know their heights."""
        return all(axis.is_homed for axis in self._axes)

    @property
    def waiting_axes(self) -> tuple[int, ...]:
        """The axes that still look for their switches, 0 to 2."""
        if self.state is not GroupState.HOMING:
            return ()
        return tuple(search.axis.number - 1 for search in self._procedures.searches)

    @property
    def heights(self) -> Vector3 | None:
        """Heights of the sliders [m]; None before homing, and where a drive is not heard."""
        if self.state in _WITHOUT_HEIGHTS or not self.is_homed:
            return None
        return three(axis.height_of(axis.position) for axis in self._axes)

    @property
    def velocities(self) -> Vector3 | None:
        """Velocities of the sliders [m/s], from one SYNC to the next; None with ``heights``."""
        if self.heights is None:
            return None
        return three(axis.velocity for axis in self._axes)

    @property
    def delay(self) -> float:
        """Momentary delay of the playing out [s]."""
        return self._playout.delay

    @property
    def moves(self) -> bool:
        """Whether setpoints are followed that do not rest."""
        return self._orders.is_enabled and not self._playout.rests

    def step(self, now: float) -> None:
        """Take in what has come, decide, and send heartbeat, commands and one SYNC.

        To be called once in each period. Nothing else sends heartbeat or SYNC, so who hangs is
        silent, and the drives stop by themselves. It raises nothing for a bus that is lost: that
        is a state.

        Args:
            now: time of a steady clock [s].
        """
        gap, self._orders.now = now - self._orders.now, now
        if self.state is GroupState.BUS_LOST:
            return
        try:
            try:
                self._take_in(self._bus.received(), gap)
                self._go_on()
                self._follow()
                if self._is_wanted and self.state is not GroupState.BRAKING:
                    self.enable(now)
            except DriveError as error:
                self._stop(GroupState.FAULT, error)
            self._orders.send()
        except BusError as error:
            self._stop(GroupState.BUS_LOST, error)

    def put(self, setpoint: Setpoint, now: float) -> bool:
        """Store a setpoint. Returns whether it will be followed: only in ON, and if homed.

        Raises:
            KinematicsError: if it is outside the travel, or the playing out refuses it, as where
                it lies somewhere else than the sliders are held. Nothing moves for it.
        """
        if self.state is not GroupState.ON or not self.is_homed:
            return False
        for axis, height, velocity in zip(self._axes, setpoint.heights, setpoint.velocities):
            low, high = axis.settings.ends
            largest = JUMP * axis.settings.largest_speed
            if abs(velocity) > largest:
                text = f"velocity of the setpoint of axis {axis.number}"
                raise OutOfBoundsError(text, velocity, f"at most {largest:g} up or down", "m/s")
            if not low <= height <= high:
                bound = f"within the travel from {low:.6f} to {high:.6f}"
                raise OutOfBoundsError(f"setpoint of axis {axis.number}", height, bound, "m")
        self._playout.put(setpoint, now)
        return True

    def enable(self, now: float) -> None:
        """Begin to give torque where the sliders are: from OFF and HOLDING. Nothing moves.

        From BRAKING it begins at rest.

        Raises:
            DriveError: in another state, but for ON and ENABLING.
        """
        self._is_wanted = self.state is GroupState.BRAKING
        if self.state in (GroupState.ON, GroupState.ENABLING, GroupState.BRAKING):
            return
        self._check("enabled", GroupState.OFF, GroupState.HOLDING)
        if self._orders.is_enabled:
            self._turn_on()
        else:
            self._enter(GroupState.ENABLING, self._procedures.enable(), GroupState.ON)

    def disable(self, now: float) -> None:
        """Bring the sliders to rest, then take the torque away; in FAULT it takes that away, too.

        Raises:
            DriveError: in SILENT and BUS_LOST.
        """
        if self.state is GroupState.OFF:
            return
        self._check("disabled", *{*GroupState} - {GroupState.SILENT, GroupState.BUS_LOST})
        if self.state is GroupState.HOMING or not self._orders.is_enabled:
            self._orders.brake()
        if self.state is GroupState.FAULT:
            self._task = self._procedures.let_go()
        else:
            task = self._procedures.disable(lambda: self.moves)
            self._enter(GroupState.BRAKING, task, GroupState.OFF)

    def reset(self, now: float) -> None:
        """Set the drives up anew after FAULT or BUS_LOST, and reset their faults; never enables.

        Raises:
            DriveError: in another state.
        """
        self._check("reset", GroupState.FAULT, GroupState.BUS_LOST)
        self._resets = True
        self._enter(GroupState.SILENT, self._procedures.set_up(True), GroupState.OFF)

    def home(self, now: float) -> None:
        """Begin to look for the switches: from OFF, HOLDING and ON at rest. It ends in ON.

        Raises:
            DriveError: in another state, and while the sliders move.
        """
        self._check("homed", GroupState.OFF, GroupState.HOLDING, GroupState.ON)
        if self.moves:
            raise DriveError("the sliders move: homing begins at rest")
        for axis in self._axes:
            axis.is_homed = False
        self._enter(GroupState.HOMING, self._procedures.home(), GroupState.ON)

    def cancel_home(self, now: float) -> None:
        """Stop the homing: the sliders brake, and then it is HOLDING.

        Raises:
            DriveError: where no homing is under way.
        """
        self._check("stopped in homing", GroupState.HOMING)
        self._orders.brake()
        task = self._procedures.brake()
        self._enter(GroupState.BRAKING, task, GroupState.HOLDING, "the homing was cancelled")

    def _take_in(self, events: list[Event], gap: float) -> None:
        """Take in what has come.

        Raises:
            DriveError: if it is a reason to stop.
        """
        now, orders = self._orders.now, self._orders
        for axis in self._axes:
            axis.take(events, now, orders.cycles)
        if self.state is GroupState.FAULT:
            return
        for event in events:
            if isinstance(event, Foreign):
                text = f"somebody else sends COB-ID 0x{event.cob_id:03X}: only one may send it"
                raise DriveError(text)
        if self.state is GroupState.SILENT:
            if orders.beats and any(axis.has_restarted for axis in self._axes):
                self._enter(self.state, self._procedures.set_up(self._resets), GroupState.OFF)
            return
        if gap > self._settings.consumer_time:
            raise DriveError(
                f"this computer was away for {gap:.3f} s, so that the drives have stopped"
            )
        heard_at = max(axis.answered_at for axis in self._axes)
        for axis in self._axes:
            trouble = axis.trouble(now, heard_at, orders.is_enabled)
            if trouble:
                raise axis.error(trouble)

    def _go_on(self) -> None:
        """Go on with what is under way."""
        if self._task is None:
            return
        try:
            next(self._task)
        except StopIteration:
            self._task, self._resets = None, False
            if self.state is not GroupState.FAULT:
                self.state = self._next
            if self.state is GroupState.ON:
                self._turn_on()

    def _follow(self) -> None:
        """Take the next setpoint as targets."""
        if self.state not in (GroupState.ON, GroupState.BRAKING) or not self._orders.is_enabled:
            return
        played = self._playout.next(self._orders.now)
        if played is None:
            return
        self._orders.follow(*played)
        if self.state is GroupState.ON and self._playout.has_run_dry:
            cause = "no setpoints come: the sliders brake and hold; enable to go on"
            self._enter(GroupState.BRAKING, cause=cause)
        if self.state is GroupState.BRAKING and self._task is None and not self.moves:
            self.state = GroupState.HOLDING

    def _check(self, what: str, *states: GroupState) -> None:
        if self.state not in states:
            raise DriveError(f"the drives cannot be {what}: {self.state.name}, {self.message}")

    def _enter(
        self,
        state: GroupState,
        task: Steps | None = None,
        after: GroupState = GroupState.HOLDING,
        cause: str = "",
        culprit: Axis | None = None,
    ) -> None:
        """Enter a ``state`` with a ``task``, which leads to the state ``after`` it."""
        self.state, self._task, self._next = state, task, after
        self._cause, self._culprit = cause, culprit
        # Whether it shall be enabled once it rests.
        self._is_wanted = False

    def _stop(self, state: GroupState, error: DriveError | BusError) -> None:
        """Have all drives stop quickly for an ``error``, in a ``state``."""
        number = error.axis if isinstance(error, DriveError) else None
        culprit = None if number is None else self._axes[number - 1]
        self._enter(state, cause=str(error), culprit=culprit)
        self._orders.brake()
        if culprit is not None:
            culprit.ask_error_code()
        if state is GroupState.BUS_LOST:
            self._orders.beats = self._orders.cycles = self._orders.leads = False
            for axis in self._axes:
                axis.was_lost = True

    def _turn_on(self) -> None:
        self._playout.restart()
        self.state, self._cause = GroupState.ON, ""
        if self.is_homed:
            # From there the first setpoint is led to, if it is near.
            now = self._orders.now
            held = three(axis.height_of(axis.target or 0) for axis in self._axes)
            self._playout.put(Setpoint(now, held, (0.0, 0.0, 0.0)), now)
