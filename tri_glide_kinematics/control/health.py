"""The health of a node: how regularly its loop runs, and a level, a line and numbers about it."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

from tri_glide_kinematics.control.operating_state import (
    DISABLED,
    FAULT,
    MOVING,
    PAUSED,
    WAITING,
    ControllerStatus,
    OperatingState,
)
from tri_glide_kinematics.reason_log import ReasonLog

if TYPE_CHECKING:
    from tri_glide_kinematics.control.controller import MotionController
    from tri_glide_kinematics.control.supervision import Supervisor


# A cycle is late if it starts later than this part of a period after it should have.
LATE = 0.5
# A cycle that is later than this many periods is a stall.
STALL = 5.0
# Upper ends of the classes of delays, in periods; the last class has none.
CLASSES = (0.1, 0.25, LATE, 1.0, STALL)


class LoopReport(NamedTuple):
    """A stretch of cycles.

    Attributes:
        rate: cycles per second.
        jitter: root mean square of what the intervals differ from the period [s].
        largest_delay: most that an interval was longer than the period [s].
        late_cycles: intervals that were longer by more than half a period.
        stalls: intervals that were longer by more than five periods.
    """

    rate: float
    jitter: float
    largest_delay: float
    late_cycles: int
    stalls: int


class LoopStatistics:
    """Collects the intervals between cycles.

    Attributes:
        histogram: number of cycles since the start in each class of delays; Shape (6,). The first
            class has those that were early, too.
        longest_delay: most that an interval was longer than the period, since the start [s].
    """

    def __init__(self, period: float) -> None:
        """Expect a cycle each ``period`` [s]."""
        self.histogram = [0] * (len(CLASSES) + 1)
        self.longest_delay = 0.0
        self._period = period
        self._ends = tuple(end * period for end in CLASSES)
        self._last = math.nan
        self._cycles = 0
        self._time = 0.0
        self._squares = 0.0
        self._largest = 0.0
        self._late = 0
        self._stalls = 0

    @property
    def total_late(self) -> int:
        """Late cycles since the start."""
        return sum(self.histogram[CLASSES.index(LATE) + 1 :])

    def cycle(self, now: float) -> float | None:
        """Note that a cycle starts ``now`` [s].

        Returns:
            By how much it is late [s] if that is a stall, otherwise None.
        """
        interval = now - self._last
        self._last = now
        if interval != interval:
            return None
        delay = interval - self._period
        self._cycles += 1
        self._time += interval
        self._squares += delay * delay
        self.histogram[bisect_left(self._ends, delay)] += 1
        if delay > self._largest:
            self._largest = delay
            self.longest_delay = max(self.longest_delay, delay)
        if delay <= LATE * self._period:
            return None
        self._late += 1
        if delay <= STALL * self._period:
            return None
        self._stalls += 1
        return delay

    def report(self) -> LoopReport:
        """Return what was collected since the last report, and start anew."""
        count = max(self._cycles, 1)
        report = LoopReport(
            self._cycles / self._time if self._time > 0.0 else 0.0,
            math.sqrt(self._squares / count),
            self._largest,
            self._late,
            self._stalls,
        )
        self._cycles, self._time, self._squares, self._largest = 0, 0.0, 0.0, 0.0
        self._late, self._stalls = 0, 0
        return report


class Level(IntEnum):
    """Levels as in ``diagnostic_msgs/DiagnosticStatus`` and REP 107."""

    OK = 0  # does its work
    WARN = 1  # does its work, but somebody should look
    ERROR = 2  # does not do its work
    STALE = 3  # has no data yet


class Health(NamedTuple):
    """What a node says about itself.

    Attributes:
        level: how well it does its work.
        message: one line.
        values: numbers behind it.
    """

    level: Level
    message: str
    values: Mapping[str, object]


# More late cycles than this part of all are worth a look.
TOO_MANY_LATE = 0.05

LEVELS = {WAITING: Level.WARN, DISABLED: Level.WARN, FAULT: Level.ERROR}


def told_state(state: OperatingState) -> OperatingState:
    """Return the state as texts name it: standard tools know a pause as a motion."""
    return MOVING if state is PAUSED else state


def line_of(status: ControllerStatus) -> str:
    """Return state and reason in a line."""
    return f"{told_state(status.state).value}: {status.reason}"


def status_of(status: ControllerStatus, refused: ReasonLog, remark: str = "") -> Health:
    """Return state, reason, newest target and last refusal, as they are latched on ``~/status``.

    A ``remark`` is something beside the state that somebody should know; empty for none.
    """
    level = LEVELS.get(status.state, Level.OK)
    if status.target_missed or remark:
        level = max(level, Level.WARN)
    return Health(
        level,
        line_of(status),
        {
            "state": told_state(status.state).name.lower(),
            "reason": status.reason.text,
            "newest target": status.newest_target,
            "refused commands": refused.total,
            "last refusal": refused.last,
            "remark": remark,
        },
    )


def health_of(
    controller: MotionController,
    supervisor: Supervisor,
    loop: LoopStatistics,
    refused: ReasonLog,
    unusable: int,
    remark: str = "",
    continuous_forces: Sequence[float] | None = None,
) -> Health:
    """Return the health of the last second.

    Args:
        controller: state and reason.
        supervisor: tracking error.
        loop: intervals of the control loop since the last call.
        refused: commands that were refused.
        unusable: measurements without a meaning in the last second.
        remark: something beside the state that somebody should know; empty for none.
        continuous_forces: of the sliders. Shape (3,) [N]; None where none are known.
    """
    timing = loop.report()
    refused_now = refused.end_of_second()
    level, message, values = status_of(controller.status, refused, remark)
    warnings = []
    if timing.late_cycles > TOO_MANY_LATE * timing.rate:
        warnings.append(f"{timing.late_cycles} late cycles")
    if timing.stalls:
        delay = 1000.0 * timing.largest_delay
        warnings.append(f"a cycle late by more than five periods, by {delay:.3g} ms")
    if refused_now:
        warnings.append(f"{refused_now} refused commands")
    if unusable:
        warnings.append(f"{unusable} unusable measurements")
    if warnings:
        level = max(level, Level.WARN)
        message = f"{message} ({', '.join(warnings)} in the last second)"
    return Health(
        level,
        message,
        {
            **values,
            "loop rate [1/s]": timing.rate,
            "jitter, root mean square [s]": timing.jitter,
            "largest delay of a cycle [s]": timing.largest_delay,
            "late cycles in the last second": timing.late_cycles,
            "late cycles": loop.total_late,
            **delay_counts(loop),
            "largest delay of a cycle since the start [s]": loop.longest_delay,
            "refused commands in the last second": refused_now,
            "unusable measurements in the last second": unusable,
            "tracking error [m]": supervisor.tracking_error,
            "distance from the moving target [m]": controller.tracking_distance,
            "duration of the shaper [s]": controller.shaper_duration,
            **{
                f"continuous force of slider {index} [N]": force
                for index, force in enumerate(continuous_forces or (), start=1)
            },
        },
    )


def delay_counts(loop: LoopStatistics) -> dict[str, int]:
    """Return how many cycles were how late since the start."""
    lower = ("", *(f"{end:g} to " for end in CLASSES[:-1]))
    names = [f"{begin or 'up to '}{end:g} periods" for begin, end in zip(lower, CLASSES)]
    names.append("more than five periods")
    return {f"cycles late by {name}": count for name, count in zip(names, loop.histogram)}
