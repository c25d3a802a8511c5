"""Leads the machine for one who asks at a time. Told the time, it never waits for anything."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias, TypeVar

from tri_glide_kinematics.control import IDLE, WAS_STOPPED, Cause, OperatingState
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.vectors import Vector3, combined, minus
from tri_glide_kinematics.wording import number_text

# The measured heights of the last seconds.


class RecordingError(KinematicsError):
    """There is nothing, or nothing steady, that could be noted."""


# How long measurements are kept: longer than a stop from the speed of a probe takes [s].
KEPT = 10.0
# The sliders rest if they stay within a range for a time [m], [s].
RESTING_RANGE = 2e-5
RESTING_TIME = 0.2
# No less than these make a mean value.
FEWEST = 3


class _Sample(NamedTuple):
    """Measured heights, with their times by our own clock and by that of the machine."""

    received: float
    stamp: float
    heights: Vector3


class HeightRecord:
    """Measured heights with their times, by the clock of the machine and by our own."""

    def __init__(self) -> None:
        """Hold nothing yet."""
        self._samples: deque[_Sample] = deque()

    def add(self, heights: Vector3, stamp: float, now: float) -> None:
        """Take in a measurement.

        Args:
            heights: as reported; some that are not finite are left out. Shape (3,) [m].
            stamp: when they were measured, by the clock of the machine [s].
            now: when they came in, by a steady clock [s].
        """
        if not all(map(math.isfinite, heights)):
            return
        samples = self._samples
        if samples and stamp <= samples[-1].stamp:
            # The clock was set back: what was before has no place in time any more.
            samples.clear()
        samples.append(_Sample(now, stamp, heights))
        while samples[0].received < now - KEPT:
            samples.popleft()

    def resting(self, now: float) -> Vector3:
        """Return the mean heights of the last moments, in which nothing moved. Shape (3,) [m].

        Raises:
            RecordingError: if there are no measurements, or the sliders move.
        """
        begin = now - RESTING_TIME
        recent = [each.heights for each in reversed(self._samples) if each.received > begin]
        if len(recent) < FEWEST or self._samples[0].received > begin:
            raise RecordingError(
                f"{len(recent)} measured heights in the last {RESTING_TIME:g} s, "
                f"at least {FEWEST} are needed"
            )
        for slider, heights in enumerate(zip(*recent)):
            moved = max(heights) - min(heights)
            if moved > RESTING_RANGE:
                raise RecordingError(
                    f"slider {slider + 1} moves: by {number_text(moved, 3)} m in the last "
                    f"{RESTING_TIME:g} s, more than {RESTING_RANGE:g} m"
                )
        h1, h2, h3 = (math.fsum(heights) / len(recent) for heights in zip(*recent))
        return h1, h2, h3

    def at(self, stamp: float) -> Vector3:
        """Return the heights at a time by the clock of the machine [s]. Shape (3,) [m].

        Raises:
            RecordingError: if no measurements from before and after that time are there.
        """
        samples = self._samples
        if not samples or not samples[0].stamp <= stamp <= samples[-1].stamp:
            raise RecordingError(
                "no measured heights from before and after the contact: are the clocks of the "
                "drives and of the switch the same?"
            )
        # From the newest on, as a contact is not long ago.
        index = len(samples) - 1
        while index > 1 and samples[index - 1].stamp > stamp:
            index -= 1
        (_, begin, low), (_, end, high) = samples[index - 1], samples[index]
        part = (stamp - begin) / (end - begin) if end > begin else 1.0
        return combined(1.0, low, part, minus(high, low))


# Longest wait [s] for the time of rest: a request right after a motion has to wait for it.
LONGEST_WAIT = 1.0
STOP_ASKED = "stop was asked for"
# A stamp farther than this from the time of sending is by another clock [s].
LARGEST_STAMP_AGE = 0.1

Result = TypeVar("Result")

# The steps of a request: each ``yield`` is the end of one look.
Course: TypeAlias = Generator[None, None, Result]


class LeadingError(KinematicsError):
    """The machine cannot be led now, or may not be led any more."""


@dataclass(frozen=True)
class MachineView:
    """What ik_node told last of itself.

    Attributes:
        state: None before it has told one, or if it is none that is known here.
        cause: of the state; None likewise.
        text: the reason, for people.
        stops: changes when it is stopped, disabled, in a fault or started anew; None before it has
            told them.
    """

    state: OperatingState | None = None
    cause: Cause | None = None
    text: str = ""
    stops: int | None = None

    def __str__(self) -> str:
        """Return state and reason in words."""
        state = "not heard yet" if self.state is None else self.state.name.lower()
        return f"ik_node is {state}: {self.text}"


class Delivery(NamedTuple):
    """When a message was under way.

    Attributes:
        sent: by the clock of its sender's computer [s].
        received: by that clock of our computer [s].
        now: when it came in, by a steady clock [s].
    """

    sent: float
    received: float
    now: float


class Leader:
    """One who leads the machine: it takes in what comes meanwhile, here nothing of it."""

    def contact(self, is_touched: bool, delivery: Delivery) -> None:
        """Take in what the switch says."""

    def measured(self, heights: Vector3, stamp: float, delivery: Delivery) -> None:
        """Take in reported heights [m], measured at a time by the clock of the sender [s]."""

    def machine(self, view: MachineView) -> None:
        """Take in what ik_node tells of itself."""

    def target_pose(self) -> None:
        """Notice a command of somebody else before it makes a state."""

    def setpoints(self, state: SliderState | None, delivery: Delivery) -> None:
        """Take in where ik_node commands the sliders to be; None if it does not lead them."""

    def sample(self, values: Vector3 | None, stamp: float, delivery: Delivery) -> None:
        """Take in what an accelerometer tells [m/s^2]; None if it measures no such thing."""


class Leading:
    """Lets those who ask go on, in each look; one of them at a time leads the machine.

    Attributes:
        record: of reported heights.
        machine: what ik_node told last of itself.
        is_touched: what the switch said last; None before it has said anything.
        switch_heard: when that was, by a steady clock [s].
        now: time of the present look, by a steady clock [s].
        leader: takes in what comes.
    """

    def __init__(self) -> None:
        """Lead for nobody yet."""
        self.record = HeightRecord()
        self.machine = MachineView()
        self.is_touched: bool | None = None
        self.switch_heard = self.now = 0.0
        self.leader = Leader()
        self._courses: list[tuple[Course[Any], Any]] = []
        # The name of the leader, empty if there is none, and why it has to end.
        self._name = self._reason = ""
        self._stops_asked = 0
        self._end = ""

    def begin(self, course: Course[Any], future: Any, now: float) -> None:
        """Begin with a ``course``; the ``future`` gets its result, or what it raises."""
        self.now = now
        self._go_on(course, future)

    def look(self, now: float) -> None:
        """Do what is due at a time [s]; to be called again and again."""
        self.now = now
        courses, self._courses = self._courses, []
        for each in courses:
            self._go_on(*each)

    def _go_on(self, course: Course[Any], future: Any) -> None:
        try:
            next(course)
            self._courses.append((course, future))
        except StopIteration as end:
            future.set_result(end.value)
        except Exception as error:
            future.set_exception(error)

    def measured(self, heights: Vector3, stamp: float, delivery: Delivery) -> None:
        """Take in reported heights [m] and their stamp [s], if that is by the sender's clock."""
        stamp = stamp if abs(delivery.sent - stamp) < LARGEST_STAMP_AGE else delivery.sent
        self.record.add(heights, stamp, delivery.now)
        self.leader.measured(heights, stamp, delivery)

    def contact(self, is_touched: bool, delivery: Delivery) -> None:
        """Take in what the switch says."""
        self.is_touched, self.switch_heard = is_touched, delivery.now
        self.leader.contact(is_touched, delivery)

    def told(self, view: MachineView) -> None:
        """Take in what ik_node tells of itself."""
        self.machine = view
        self.leader.machine(view)

    def resting_heights(self) -> Course[Vector3]:
        """Return the heights at which the sliders rest, as reported. Shape (3,) [m].

        Raises:
            RecordingError: if they do not.
        """
        end = self.now + LONGEST_WAIT
        while True:
            try:
                return self.record.resting(self.now)
            except RecordingError:
                if self.now >= end:
                    raise
            yield

    @property
    def stops(self) -> tuple[int, int | None]:
        """What changes when we or ik_node are told to stop."""
        return self._stops_asked, self.machine.stops

    def check_free(self) -> None:
        """Check that the machine is led for nobody.

        Raises:
            LeadingError: if it is, or will not be any more.
        """
        if self._name:
            raise LeadingError(f"{self._name} is under way")
        if self._end:
            raise LeadingError(self._end)

    def check_not_stopped(self, before: tuple[int, int | None]) -> None:
        """Check that the machine may still be led for one who has waited.

        Args:
            before: the ``stops`` when it was asked for.

        Raises:
            LeadingError: if it is led for somebody else, or a stop has come.
        """
        self.check_free()
        if self.stops != before:
            raise LeadingError(STOP_ASKED if self._stops_asked > before[0] else WAS_STOPPED)

    def check_idle(self) -> None:
        """Check that the machine is ready for a motion.

        Raises:
            LeadingError: if it is not.
        """
        if self.machine.state is not IDLE:
            raise LeadingError(str(self.machine))

    def lead(self, leader: Leader, course: Course[None], name: str) -> Course[None]:
        """Lead the machine along the ``course`` of a ``leader``, whose looks are ``next_look``."""
        self.leader, self._name, self._reason = leader, name, ""
        try:
            yield from course
        finally:
            self.leader, self._name = Leader(), ""

    def next_look(self, longest: float) -> Course[float]:
        """Wait for the next look of one who leads, and return the time until then [s].

        Raises:
            LeadingError: if there was a reason to end it, or it took longer than the ``longest``.
        """
        before = self.now
        yield
        gap = self.now - before
        if self._reason:
            raise LeadingError(self._reason)
        if gap > longest:
            raise LeadingError(f"this node was held up for {number_text(gap, 3)} s")
        return gap

    def fail(self, reason: str) -> None:
        """End what leads the machine; of several reasons in one look, the first counts."""
        self._reason = self._reason or reason

    def stop(self, reason: str = STOP_ASKED) -> bool:
        """End what leads the machine, and what waits for that; tell whether anything led it."""
        self._stops_asked += 1
        self.fail(reason)
        return bool(self._name)

    def end(self, reason: str) -> None:
        """Stop, and lead the machine no more."""
        self._end = reason
        self.stop(reason)
