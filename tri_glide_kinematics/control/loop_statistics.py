"""How regularly a control loop runs. No ROS in here."""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import NamedTuple

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
