"""What takes drives more than a cycle: to be set up, enabled, homed, let go.

Each is a procedure that goes on once in each cycle, and raises ``DriveError`` where it fails.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from statistics import fmean

from tri_glide_kinematics.drives import cia402
from tri_glide_kinematics.drives.axis import AVERAGED, Axis, Steps
from tri_glide_kinematics.drives.bus import START
from tri_glide_kinematics.drives.cia402 import (
    FAULTS,
    HOMING_ATTAINED,
    HOMING_ERROR,
    TARGET_REACHED,
    DriveState,
    Mode,
)
from tri_glide_kinematics.drives.group_settings import LARGEST_GOOD_LOAD, GroupSettings
from tri_glide_kinematics.drives.orders import Orders
from tri_glide_kinematics.drives.set_up import apply, set_up, travel
from tri_glide_kinematics.vectors import three

# What is watched while a drive looks for its switch.

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


# Who else leads the drives is heard within this time [s].
LISTENING = 0.2

# Within these times a drive answers to SYNC, shows a mode, and changes its state; a brake may have
# to open for that [s].
ANSWERING = 2.0
CONFIRMING = 2.0
LEADING = 3.0

# A drive that has come to its target is no farther from it [m].
NEAR = 0.001


def _word_towards_switched_on(axis: Axis) -> int:
    """Return the control word that leads a drive to SWITCHED ON, and no farther."""
    if axis.state in (None, *FAULTS, DriveState.QUICK_STOP_ACTIVE):
        return cia402.DISABLE_VOLTAGE
    is_disabled = axis.state is DriveState.SWITCH_ON_DISABLED
    return cia402.SHUTDOWN if is_disabled else cia402.SWITCH_ON


class Procedures:
    """Procedures of three drives; one at a time.

    Attributes:
        remarks: what was found while setting up and can be lived with.
        progress: what is waited for while the drives are set up, for people.
        searches: drives that still look for their switches.
    """

    def __init__(self, orders: Orders, settings: GroupSettings) -> None:
        """Begin none; they change the ``orders``."""
        self.remarks: list[str] = []
        self.progress = ""
        self.searches: list[Search] = []
        self._orders = orders
        self._axes = orders.axes
        self._settings = settings

    def set_up(self, resets: bool) -> Steps:
        """Set the drives up; with ``resets``, reset their faults, too. Ends without torque."""
        orders, load = self._orders, self._settings.load
        orders.cycles = orders.leads = False
        for axis in self._axes:
            axis.forget()
        self.remarks = []
        if load > LARGEST_GOOD_LOAD:
            self.remarks.append(f"the bus is in use for {100 * load:.0f} % of the time")
        self.progress = "listens whether somebody else leads the drives"
        yield from self._wait(orders.now + max(LISTENING, 2 * self._settings.consumer_time))
        orders.beats = True
        # Another number for each time: who still has the last one has had power since.
        mark = 1 + int(1e3 * orders.now) % 2**31
        yield from self._together(lambda axis: set_up(axis, mark))
        for axis in self._axes:
            axis.network_state = None
            axis.send_state(START)
        orders.cycles = True
        yield from self._until(lambda axis: axis.is_up, ANSWERING, "heard to answer SYNC")
        orders.leads = True
        if not resets:
            for axis in self._axes:
                if axis.state in (*FAULTS, DriveState.QUICK_STOP_ACTIVE):
                    raise axis.error("has stopped before: it takes a reset, which ends its torque")
        yield from self._wait(orders.rests_at)
        orders.word = lambda axis: (
            cia402.RESET_FAULT if axis.state is DriveState.FAULT else cia402.DISABLE_VOLTAGE
        )
        yield from self._until(lambda axis: axis.state not in FAULTS, LEADING, "without a fault")
        yield from self._until_state(DriveState.SWITCH_ON_DISABLED)
        for axis in self._axes:
            axis.forget_emergency()

    def enable(self, mode: Mode = Mode.POSITION) -> Steps:
        """Give torque where the sliders are."""
        orders = self._orders
        yield from self._together(lambda axis: self._confirmed_mode(axis, mode))
        if orders.is_enabled:
            return
        # From a quick stop that holds, torque goes on.
        if any(axis.state is not DriveState.QUICK_STOP_ACTIVE for axis in self._axes):
            orders.word = _word_towards_switched_on
            yield from self._until_state(DriveState.SWITCHED_ON)
        yield from self._hold()
        # The targets are there for a cycle before anything acts on them.
        yield
        orders.tell(cia402.ENABLE_OPERATION)
        yield from self._until_state(DriveState.OPERATION_ENABLED)
        orders.is_enabled = True

    def home(self) -> Steps:
        """Look for the switches together; ends with torque, within the travel."""
        self.searches = []
        # Limits of the travel that the drive has had up to now.
        yield from self._together(lambda axis: apply(axis, travel(axis.settings, False)))
        yield from self.enable(Mode.HOMING)
        self.searches = [Search(axis, self._orders.now) for axis in self._axes]
        self._orders.tell(cia402.START_HOMING)
        while self.searches:
            yield
            now = self._orders.now
            self.searches = [each for each in self.searches if not each.has_ended(now)]
        self._orders.tell(cia402.ENABLE_OPERATION)
        yield from self._hold()
        yield from self._together(lambda axis: apply(axis, travel(axis.settings, True)))
        yield from self.enable()
        yield from self._come_into_the_travel()
        for axis in self._axes:
            axis.is_homed = True

    def brake(self) -> Steps:
        """Wait until a quick stop has ended."""
        return self._wait(self._orders.rests_at)

    def disable(self, moves: Callable[[], bool]) -> Steps:
        """Take the torque away once nothing ``moves``."""
        while moves():
            yield
        if self._orders.is_enabled:
            # The drive closes its brake first.
            self._orders.is_enabled = False
            self._orders.tell(cia402.SWITCH_ON)
            holds = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, None)
            yield from self._until(lambda axis: axis.state not in holds, LEADING, "SWITCHED ON")
        yield from self.let_go()
        yield from self._until_state(DriveState.SWITCH_ON_DISABLED)

    def let_go(self) -> Steps:
        """Take the torque away after a quick stop."""
        yield from self.brake()
        for axis in self._axes:
            axis.target = None
        self._orders.tell(cia402.DISABLE_VOLTAGE)

    def _hold(self) -> Steps:
        """Have the targets stay where the drives rest; noise of their encoders is averaged."""
        for axis in self._axes:
            axis.positions.clear()
        yield from self._until(lambda axis: len(axis.positions) == AVERAGED, ANSWERING, "heard")
        for axis in self._axes:
            axis.target = round(fmean(axis.positions))

    def _come_into_the_travel(self) -> Steps:
        """Go down together, as the switches may be above it."""
        settings, axes = self._settings, self._axes
        starts = [axis.height_of(axis.target or 0) for axis in axes]
        way = max(0.0, *(h - axis.settings.upper_height for axis, h in zip(axes, starts)))
        # Greatest speed and acceleration of the polynomial below, for a way and a time of 1.
        braking = math.sqrt(5.774 * way / settings.homing_acceleration)
        cycles = math.ceil(max(1.875 * way / settings.homing_speed, braking) / settings.period)
        for cycle in range(1, cycles + 1):
            part = cycle / cycles
            gone = way * part**3 * (10.0 + part * (6.0 * part - 15.0))
            self._orders.follow(three(start - gone for start in starts), (0.0, 0.0, 0.0))
            yield
        yield from self._until(self._is_at_target, ANSWERING, "where it was sent")

    @staticmethod
    def _is_at_target(axis: Axis) -> bool:
        return axis.target is None or abs(axis.position - axis.target) <= NEAR * axis.per_metre

    def _confirmed_mode(self, axis: Axis, mode: Mode) -> Generator[None, None, list[str]]:
        end = self._orders.now + CONFIRMING
        while True:
            # A drive may refuse it until it has come to rest.
            written = yield from axis.write(cia402.MODE, mode)
            shown = yield from axis.read(cia402.MODE_SHOWN)
            if not shown.error and shown.value == mode:
                return []
            if self._orders.now > end:
                text = f"shows mode {shown.value} (0x6061), {mode.value} was asked for (0x6060)"
                raise axis.error(f"{text} {written.error}".rstrip())

    def _together(self, begin: Callable[[Axis], Generator[None, None, list[str]]]) -> Steps:
        """Go on with something for each axis; what they return are remarks."""
        tasks = {axis: begin(axis) for axis in self._axes}
        while tasks:
            for axis, task in tuple(tasks.items()):
                try:
                    next(task)
                except StopIteration as end:
                    self.remarks += end.value
                    del tasks[axis]
            self.progress = "waits for " + ", ".join(axis.name for axis in tasks)
            yield

    def _wait(self, until: float) -> Steps:
        while self._orders.now < until:
            yield

    def _until_state(self, state: DriveState) -> Steps:
        return self._until(lambda axis: axis.state is state, LEADING, state.text)

    def _until(self, fits: Callable[[Axis], bool], seconds: float, wanted: str) -> Steps:
        end = self._orders.now + seconds
        while late := [axis for axis in self._axes if not fits(axis)]:
            if self._orders.now > end:
                raise late[0].error(f"is not {wanted} within {seconds:g} s")
            yield
