"""Three drives that are led as one: set up, enabled, fed with targets, homed and stopped together.

It is told the time, and waits for nothing: what takes long is a procedure that goes on in each
cycle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from enum import Enum
from statistics import fmean

from tri_glide_kinematics.drives import cia402
from tri_glide_kinematics.drives.axis import AVERAGED, OPERATIONAL, Axis, Steps
from tri_glide_kinematics.drives.bus import Bus, BusError, Command, Event, Foreign
from tri_glide_kinematics.drives.cia402 import FAULTS, DriveError, DriveState, Mode
from tri_glide_kinematics.drives.group_settings import LARGEST_GOOD_LOAD, GroupSettings
from tri_glide_kinematics.drives.homing import Search
from tri_glide_kinematics.drives.playout import Playout, Setpoint
from tri_glide_kinematics.drives.set_up import apply, set_up, travel
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.vectors import Vector3, three

# Who else leads the drives is heard within this time [s].
LISTENING = 0.2

# Within these times a drive answers to SYNC, shows a mode, and changes its state; a brake may have
# to open for that [s].
ANSWERING = 2.0
CONFIRMING = 2.0
LEADING = 3.0

# A drive that has come to its target is no farther from it [m].
NEAR = 0.001

# Targets go no faster than so many times the largest speed.
JUMP = 1.6

# A quick stop takes no longer than from the largest speed to rest, and this [s].
REACTING = 0.1

# Command of NMT to be operational.
START = 1


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


_SETTLED = (
    GroupState.OFF,
    GroupState.ENABLING,
    GroupState.ON,
    GroupState.BRAKING,
    GroupState.HOLDING,
)


class DriveGroup:
    """Three drives on a bus.

    Attributes:
        state: what they do.
        remarks: what was found while setting up and can be lived with.
        load: share of time for which the cycles use the bus.
    """

    def __init__(self, bus: Bus, settings: GroupSettings) -> None:
        """Send nothing before ``step`` has heard for a while that nobody else leads.

        Args:
            bus: with the drives.
            settings: checked when they are made.
        """
        self.state = GroupState.SILENT
        self.remarks: list[str] = []
        self.load = settings.load
        self._bus = bus
        self._settings = settings
        self._axes = tuple(Axis(number, bus, settings) for number in (1, 2, 3))
        brake = three(drive.brake for drive in settings.drives)
        self._playout = Playout(settings.playout_delay, settings.period, brake)
        self._now = -math.inf
        self._beat_at = self._rests_at = -math.inf
        # Whether heartbeats are sent, SYNC, and commands.
        self._is_heard = self._is_cycling = self._is_leading = False
        self._resets = False
        # Why it is as it is, the axis that it is for, and what goes on.
        self._cause = ""
        self._culprit: Axis | None = None
        self._task: Steps | None = None
        self._searches: list[Search] = []
        # What drives are told in each cycle: targets, where None is where they are, and rates.
        self._word: Callable[[Axis], int] = lambda axis: cia402.QUICK_STOP
        self._targets: list[int] | None = None
        self._rates = [0, 0, 0]
        self._is_enabled = self._is_wanted = False
        self._begin(GroupState.SILENT, self._setting_up())

    @property
    def message(self) -> str:
        """Why it is as it is, for people; of a fault it names axis, error code and EMCY."""
        return f"{self._cause} [{self._culprit.text}]" if self._culprit else self._cause

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
        return tuple(search.axis.number - 1 for search in self._searches)

    @property
    def heights(self) -> Vector3 | None:
        """Heights of the sliders [m]; None before homing, and where a drive is not heard."""
        if self.state not in _SETTLED or not self.is_homed:
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

    def step(self, now: float) -> None:
        """Take in what has come, decide, and send heartbeat, commands and one SYNC.

        To be called once in each period. Nothing else sends heartbeat or SYNC, so who hangs is
        silent, and the drives stop by themselves. It raises nothing for a bus that is lost: that
        is a state.

        Args:
            now: time of a steady clock [s].
        """
        gap, self._now = now - self._now, now
        if self.state is GroupState.BUS_LOST:
            return
        try:
            self._take_in(self._bus.received(), gap)
            self._go_on()
            self._follow()
            if self._is_wanted and self.state is not GroupState.BRAKING:
                self.enable(now)
            self._send()
        except BusError as error:
            self._stop(GroupState.BUS_LOST, str(error))
            self._is_heard = self._is_cycling = self._is_leading = False
            for axis in self._axes:
                axis.was_lost = True

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
        if self._is_enabled:
            self._turn_on()
        else:
            self._begin(GroupState.ENABLING, self._enabling())

    def disable(self, now: float) -> None:
        """Bring the sliders to rest, then take the torque away; in FAULT it takes that away, too.

        Raises:
            DriveError: in SILENT and BUS_LOST.
        """
        if self.state is GroupState.OFF:
            return
        self._check("disabled", *_SETTLED, GroupState.HOMING, GroupState.FAULT)
        if self.state is GroupState.HOMING or not self._is_enabled:
            self._brake()
        if self.state is GroupState.FAULT:
            self._task = self._letting_go()
        else:
            self._begin(GroupState.BRAKING, self._disabling())

    def reset(self, now: float) -> None:
        """Set the drives up anew after FAULT or BUS_LOST, and reset their faults; never enables.

        Raises:
            DriveError: in another state.
        """
        self._check("reset", GroupState.FAULT, GroupState.BUS_LOST)
        self._resets = True
        self._begin(GroupState.SILENT, self._setting_up())

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
        self._begin(GroupState.HOMING, self._looking_for_switches())

    def cancel_home(self, now: float) -> None:
        """Stop the homing: the sliders brake, and then it is HOLDING.

        Raises:
            DriveError: where no homing is under way.
        """
        self._check("stopped in homing", GroupState.HOMING)
        self._brake()
        self._begin(GroupState.BRAKING, self._braking(), "the homing was cancelled")

    # What has come in, and what is sent.

    def _take_in(self, events: list[Event], gap: float) -> None:
        for axis in self._axes:
            axis.take(events, self._now, self._is_cycling)
        if self.state is GroupState.FAULT:
            return None
        for event in events:
            if isinstance(event, Foreign):
                text = f"somebody else sends COB-ID 0x{event.cob_id:03X}: only one may send it"
                return self._stop(GroupState.FAULT, text)
        if self.state is GroupState.SILENT:
            if self._is_heard and any(axis.has_restarted for axis in self._axes):
                self._begin(GroupState.SILENT, self._setting_up())
            return None
        if gap > self._settings.consumer_time:
            text = f"this computer was away for {gap:.3f} s, so that the drives have stopped"
            return self._stop(GroupState.FAULT, text)
        for axis in self._axes:
            trouble = axis.trouble(self._now, self._is_enabled)
            if trouble:
                return self._stop(GroupState.FAULT, f"{axis.name} {trouble}", axis)
        return None

    def _go_on(self) -> None:
        """Go on with what is under way."""
        if self._task is None:
            return
        try:
            next(self._task)
        except StopIteration:
            self._task = None
        except DriveError as error:
            axis = None if error.axis is None else self._axes[error.axis - 1]
            self._stop(GroupState.FAULT, str(error), axis)

    def _follow(self) -> None:
        """Take the next setpoint as targets."""
        if self.state not in (GroupState.ON, GroupState.BRAKING) or self._targets is None:
            return None
        if not self._is_enabled:
            # What begins to move in the store would move them while their brakes close.
            return None
        played = self._playout.next(self._now)
        if played is None:
            return None
        for i, (axis, height, velocity) in enumerate(zip(self._axes, *played)):
            target = axis.count_of(height)
            step = abs(target - self._targets[i]) / axis.per_metre
            longest = JUMP * axis.settings.largest_speed * self._settings.period
            if step > longest + 1 / axis.per_metre:
                text = f"the target of {axis.name} jumps by {step:.6f} m in one period"
                return self._stop(GroupState.FAULT, f"{text}, at most by {longest:.6f}")
            self._targets[i], self._rates[i] = target, axis.rate_of(velocity)
        if self.state is GroupState.ON and self._playout.has_run_dry:
            self.state = GroupState.BRAKING
            self._cause = "no setpoints come: the sliders brake and hold; enable to go on"
        if self.state is GroupState.BRAKING and not self.moves:
            self._rates = [0, 0, 0]
            if self._task is None:
                self.state = GroupState.HOLDING
        return None

    def _send(self) -> None:
        if self._is_heard and self._now >= self._beat_at:
            self._bus.send_heartbeat(OPERATIONAL)
            # Some may be late or lost.
            self._beat_at = self._now + self._settings.consumer_time / 4
        if self._is_cycling:
            axes = enumerate(self._axes) if self._is_leading else ()
            self._bus.send_cycle([self._command(i, axis) for i, axis in axes])

    def _command(self, i: int, axis: Axis) -> Command:
        target = self._targets[i] if self._targets else axis.position
        rate = self._rates[i] if self._settings.sends_velocity else None
        return Command(axis.settings.node, self._word(axis), target, rate)

    # Changes of state.

    def _check(self, what: str, *states: GroupState) -> None:
        if self.state not in states:
            raise DriveError(f"the drives cannot be {what}: {self.state.name}, {self.message}")

    def _begin(self, state: GroupState, task: Steps, cause: str = "") -> None:
        self.state, self._task, self._cause, self._culprit = state, task, cause, None
        self._searches, self._is_wanted = [], False

    def _stop(self, state: GroupState, cause: str, axis: Axis | None = None) -> None:
        """Have all drives stop quickly for a ``cause``, in a ``state``."""
        self.state, self._task, self._cause, self._culprit = state, None, cause, axis
        self._searches, self._is_wanted = [], False
        self._brake()
        if axis is not None:
            axis.ask_error_code()

    def _brake(self) -> None:
        """Have the drives brake; from then on targets are where they are."""
        self._tell(cia402.QUICK_STOP)
        self._targets, self._rates = None, [0, 0, 0]
        self._is_enabled = False
        times = (drive.largest_speed / drive.brake for drive in self._settings.drives)
        self._rests_at = self._now + max(times) + REACTING

    def _tell(self, word: int) -> None:
        """Have a control word sent to all drives, in each cycle."""
        self._word = lambda axis: word

    def _turn_on(self) -> None:
        self._playout.restart()
        self.state, self._cause = GroupState.ON, ""
        if self.is_homed and self._targets is not None:
            # From there the first setpoint is led to, if it is near.
            held = three(axis.height_of(each) for axis, each in zip(self._axes, self._targets))
            self._playout.put(Setpoint(self._now, held, (0.0, 0.0, 0.0)), self._now)

    @property
    def moves(self) -> bool:
        """Whether setpoints are followed that do not rest."""
        return self._is_enabled and not self._playout.rests

    # Procedures: each goes on once in each cycle. Those that fail raise DriveError.

    def _setting_up(self) -> Steps:
        self._is_cycling = self._is_leading = False
        for axis in self._axes:
            axis.forget()
        self.remarks = []
        if self.load > LARGEST_GOOD_LOAD:
            self.remarks.append(f"the bus is in use for {100 * self.load:.0f} % of the time")
        self._cause = "listens whether somebody else leads the drives"
        yield from self._wait(self._now + max(LISTENING, 2 * self._settings.consumer_time))
        self._is_heard = True
        # Another number for each time: who still has the last one has had power since.
        mark = 1 + int(1e3 * self._now) % 2**31
        yield from self._together(lambda axis: set_up(axis, mark), "waits for ")
        for axis in self._axes:
            axis.network_state = None
            axis.send_state(START)
        self._is_cycling = True
        yield from self._until(lambda axis: axis.is_up, ANSWERING, "heard to answer SYNC")
        self._is_leading = True
        if not self._resets:
            for axis in self._axes:
                if axis.state in (*FAULTS, DriveState.QUICK_STOP):
                    raise axis.error("has stopped before: it takes a reset, which ends its torque")
        yield from self._wait(self._rests_at)
        self._word = lambda axis: (
            cia402.RESET_FAULT if axis.state is DriveState.FAULT else cia402.DISABLE_VOLTAGE
        )
        yield from self._until(lambda axis: axis.state not in FAULTS, LEADING, "without a fault")
        yield from self._until_off()
        for axis in self._axes:
            axis.forget_emergency()
        self.state, self._cause, self._resets = GroupState.OFF, "", False

    def _enabling(self) -> Steps:
        yield from self._to_operation(Mode.POSITION)
        self._turn_on()

    def _to_operation(self, mode: Mode) -> Steps:
        yield from self._change_mode(mode)
        if self._is_enabled:
            return
        # From a quick stop that holds, torque goes on.
        if any(axis.state is not DriveState.QUICK_STOP for axis in self._axes):
            self._word = lambda axis: cia402.word_towards_switched_on(axis.state)
            yield from self._until_state(DriveState.SWITCHED_ON)
        yield from self._hold()
        # The targets are there for a cycle before anything acts on them.
        yield
        self._tell(cia402.ENABLE_OPERATION)
        yield from self._until_state(DriveState.OPERATION_ENABLED)
        self._is_enabled = True

    def _hold(self) -> Steps:
        """Have the targets stay where the drives rest; noise of their encoders is averaged."""
        for axis in self._axes:
            axis.positions.clear()
        yield from self._until(lambda axis: len(axis.positions) == AVERAGED, ANSWERING, "heard")
        self._targets = [round(fmean(axis.positions)) for axis in self._axes]

    def _looking_for_switches(self) -> Steps:
        # Limits of the travel that the drive has had up to now.
        yield from self._together(lambda axis: apply(axis, travel(axis.settings, False)))
        yield from self._to_operation(Mode.HOMING)
        self._searches = [Search(axis, self._now) for axis in self._axes]
        self._tell(cia402.START_HOMING)
        while self._searches:
            yield
            self._searches = [each for each in self._searches if not each.has_ended(self._now)]
        self._tell(cia402.ENABLE_OPERATION)
        yield from self._hold()
        yield from self._together(lambda axis: apply(axis, travel(axis.settings, True)))
        yield from self._change_mode(Mode.POSITION)
        yield from self._coming_into_the_travel()
        for axis in self._axes:
            axis.is_homed = True
        self._turn_on()

    def _coming_into_the_travel(self) -> Steps:
        """Go down together, as the switches may be above it."""
        settings, starts = self._settings, self._targets or []
        heights = [axis.height_of(start) for axis, start in zip(self._axes, starts)]
        above = [h - axis.settings.upper_height for axis, h in zip(self._axes, heights)]
        way = max(0.0, *above)
        # Greatest speed and acceleration of the polynomial below, for a way and a time of 1.
        braking = math.sqrt(5.774 * way / settings.homing_acceleration)
        cycles = math.ceil(max(1.875 * way / settings.homing_speed, braking) / settings.period)
        for cycle in range(1, cycles + 1):
            part = cycle / cycles
            gone = way * part**3 * (10.0 + part * (6.0 * part - 15.0))
            self._targets = [axis.count_of(h - gone) for axis, h in zip(self._axes, heights)]
            yield
        yield from self._until(self._is_at_target, ANSWERING, "where it was sent")

    def _is_at_target(self, axis: Axis) -> bool:
        target = self._targets[axis.number - 1] if self._targets else axis.position
        return abs(axis.position - target) <= NEAR * axis.per_metre

    def _braking(self) -> Steps:
        yield from self._wait(self._rests_at)
        self.state = GroupState.HOLDING

    def _disabling(self) -> Steps:
        while self.moves:
            yield
        if self._is_enabled:
            # The drive closes its brake first.
            self._is_enabled = False
            self._tell(cia402.SWITCH_ON)
            has_ended = (DriveState.SWITCHED_ON, DriveState.READY, DriveState.SWITCH_ON_DISABLED)
            yield from self._until(lambda axis: axis.state in has_ended, LEADING, "SWITCHED ON")
        yield from self._letting_go()
        yield from self._until_off()
        self.state = GroupState.OFF

    def _letting_go(self) -> Steps:
        yield from self._wait(self._rests_at if self._targets is None else self._now)
        self._targets = None
        self._tell(cia402.DISABLE_VOLTAGE)

    def _until_off(self) -> Steps:
        return self._until_state(DriveState.SWITCH_ON_DISABLED)

    def _change_mode(self, mode: Mode) -> Steps:
        return self._together(lambda axis: self._confirmed_mode(axis, mode))

    def _confirmed_mode(self, axis: Axis, mode: Mode) -> Generator[None, None, list[str]]:
        end = self._now + CONFIRMING
        while True:
            # A drive may refuse it until it has come to rest.
            written = yield from axis.write(cia402.MODE, mode)
            shown = yield from axis.read(cia402.MODE_SHOWN)
            if not shown.error and shown.value == mode:
                return []
            if self._now > end:
                text = f"shows mode {shown.value} (0x6061), {mode.value} was asked for (0x6060)"
                raise axis.error(f"{text} {written.error}".rstrip())

    def _together(
        self, begin: Callable[[Axis], Generator[None, None, list[str]]], cause: str = ""
    ) -> Steps:
        """Go on with something for each axis; what they return are remarks."""
        tasks = {axis: begin(axis) for axis in self._axes}
        while tasks:
            for axis, task in tuple(tasks.items()):
                try:
                    next(task)
                except StopIteration as end:
                    self.remarks += end.value
                    del tasks[axis]
            if cause and tasks:
                self._cause = cause + ", ".join(axis.name for axis in tasks)
            yield

    def _wait(self, until: float) -> Steps:
        while self._now < until:
            yield

    def _until_state(self, state: DriveState) -> Steps:
        return self._until(lambda axis: axis.state is state, LEADING, state.value)

    def _until(self, fits: Callable[[Axis], bool], seconds: float, wanted: str) -> Steps:
        end = self._now + seconds
        while late := [axis for axis in self._axes if not fits(axis)]:
            if self._now > end:
                raise late[0].error(f"is not {wanted} within {seconds:g} s")
            yield
